"""The page of docs that lists every verb of the Python client; `gen_docs.py` writes it."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from typing import Any

from maya_un.client import Client, JobBuilder, JobHandle, resources
from maya_un.client.lease import Lease
from maya_un.client.plans.streaming import Event
from maya_un.client.verb import Described, Stream

INTRODUCTION = """\
# Python client

```python
from maya_un import Client

maya = Client()  # the `maya up` of this user; or Client("https://robot:4134", token="maya_...")
maya.home()
maya.pick(0.50, 1.10)
maya.place("tray[1,2]")
```

`Client` blocks; `AsyncClient` has the same verbs, each to be awaited, and the same streams, for `async for`. Both work
in notebooks, on the twin and on the robot alike: `Client.twin()` starts a twin of one's own, [as the first notebook
does](../tutorials/first-notebook.ipynb). Units are m, rad and s, in the robot's time where a twin's clock runs faster.
A place is a name (a taught pose, a cell like `"tray[1,2]"`, in jobs a part or a place) or x, y and perhaps z.

Answers are frozen dataclasses, the same that the service has. A refusal is raised as the leaf of `maya_un.errors` that
it is, with its [code](errors.md) and its details. What only looks, and what carries an idempotency key as every
submission does, is said again where the connection breaks; `stop` goes over a connection of its own. A primitive is
waited for: Ctrl-C, *interrupt* in a notebook, or the end of the awaiting task cancels it, which stops the robot on its
path. What waits for somebody (a paused queue, a lease of somebody else's) says so as a warning, `StillWaiting`.
"""

LEASE = """\
`with maya.lease(note="calibration"):` drives while the block runs and renews the lease meanwhile; `async with` for the
other client. Once it is lost, the next thing that is asked for inside raises `LeaseLost`, or the end of the block does.
"""

SECTIONS: tuple[tuple[str, type, str], ...] = (
    ("The robot: `maya`", Client, ""),
    ("The queue: `maya.queue`", resources.Queue, ""),
    ("The past: `maya.history`", resources.History, ""),
    ("Taught poses: `maya.poses`", resources.Poses, ""),
    ("Taught pallets: `maya.pallets`", resources.Pallets, ""),
    ("Zones: `maya.zones`", resources.Zones, ""),
    ("Users: `maya.users`", resources.Users, ""),
    ("Recordings: `maya.recordings`", resources.Recordings, ""),
    ("The control lease: `maya.lease`", Lease, LEASE.rstrip()),
    (
        "A job that was submitted",
        JobHandle,
        "What `submit` and `job` return. Iterating over it yields its report as it goes on.",
    ),
    ("A job built step by step", JobBuilder, inspect.getdoc(JobBuilder) or ""),
)
"""Title of each section, the class whose verbs it lists, and what is said first."""

_HIDDEN = {"perform", "iterate", "beside"}


def page() -> str:
    """Return the page."""
    return "\n".join(_lines()) + "\n"


def _lines() -> Iterator[str]:
    yield INTRODUCTION
    for title, owner, words in SECTIONS:
        yield f"## {title}\n"
        if words:
            yield f"{words}\n"
        for name in _names(owner):
            yield from _entry(name, getattr(owner, name))
    yield "## Events\n"
    yield f"What `maya.events()` yields, with `run`, `seq`, `time`, `kind`, `code`, `detail`. {inspect.getdoc(Event)}\n"
    yield "Their kinds are [listed](events.md)."


def _names(owner: type) -> list[str]:
    """Return the verbs of a class, its own first, in the order in which they are written."""
    found = [name for base in owner.__mro__ for name in vars(base) if not name.startswith("_")]
    return [name for name in dict.fromkeys(found) if name not in _HIDDEN and _is_verb(getattr(owner, name))]


def _is_verb(found: object) -> bool:
    return isinstance(found, Described) or callable(found)


def _signature_of(verb: Any) -> inspect.Signature:
    return verb.__signature__ if isinstance(verb, Described) else inspect.signature(verb)


def _entry(name: str, verb: Any) -> Iterator[str]:
    yield f"### `{name}({_parameters(verb)}) -> {_returned(verb)}`\n"
    yield f"{inspect.getdoc(verb)}\n"


def _parameters(verb: Any) -> str:
    """Return the arguments of a verb as they are written."""
    found = [one for one in _signature_of(verb).parameters.values() if one.name not in {"self", "cls"}]
    words = [_parameter(one) for one in found]
    named = next((place for place, one in enumerate(found) if one.kind is one.KEYWORD_ONLY), None)
    return ", ".join(words if named is None else [*words[:named], "*", *words[named:]])


def _parameter(parameter: inspect.Parameter) -> str:
    stars = "**" if parameter.kind is parameter.VAR_KEYWORD else ""
    default = "" if parameter.default is parameter.empty else f" = {parameter.default!r}"
    return f"{stars}{parameter.name}: {parameter.annotation}{default}"


def _returned(verb: Any) -> str:
    answer = str(_signature_of(verb).return_annotation)
    return f"Iterator[{answer}]" if isinstance(verb, Stream) else answer
