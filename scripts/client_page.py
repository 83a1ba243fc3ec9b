"""The page of docs that lists every verb of the Python client; `gen_docs.py` writes it."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from typing import Any

from maya_un.client import Client, JobBuilder, JobHandle, resources
from maya_un.client.plans.streaming import Event
from maya_un.client.resources import Lease
from maya_un.client.steps import Described, Stream

INTRODUCTION = """\
# Python client

```python
from maya_un import Client

maya = Client()  # the `maya up` of this user; or Client("https://robot:4134", token="maya_...")
maya.home()
maya.pick(0.50, 1.10)
maya.place("tray[1,2]")
```

The methods of `Client` block. `AsyncClient` has the same methods: use `await` for them, and `async for` for streams.
Both work in notebooks, on the twin and on the robot. `Client.twin()` starts a separate twin, [as in the first
notebook](../tutorials/first-notebook.ipynb). Units are m, rad and s; times are those of the robot's clock. Give a place
as x, y and optionally z, or as a name: a taught pose or a cell of a pallet (`"tray[1,2]"`). In a job, the name may also
be that of a part or a place of the job.

Answers are the frozen dataclasses of the service. A refusal is raised as its class of `maya_un.errors`, with its
[code](errors.md) and its details. If the connection breaks, the client sends a request again if it only reads, or if it
has an idempotency key. Every submission of a job has one. `stop` uses a separate connection. A primitive returns when
it is done: Ctrl-C, *interrupt* in a notebook, or the end of the awaiting task cancels it, and the robot stops on its
path. A warning, `StillWaiting`, reports that a job waits for a person (a paused queue, another user's lease).
"""

LEASE = """\
`with maya.lease(note="calibration"):` holds and renews the lease while the block runs; use `async with` for
`AsyncClient`. If the lease is lost, the next request in the block, or its end, raises `LeaseLost`.
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
        "The result of `submit` and `job`. Iterating over it yields its report at each change.",
    ),
    ("A job built step by step", JobBuilder, inspect.getdoc(JobBuilder) or ""),
)
"""Title of each section, the class whose methods it lists, and its first paragraph."""

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
    yield f"`maya.events()` yields them, with `run`, `seq`, `time`, `kind`, `code`, `detail`. {inspect.getdoc(Event)}\n"
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
    stars = {parameter.VAR_POSITIONAL: "*", parameter.VAR_KEYWORD: "**"}.get(parameter.kind, "")
    default = "" if parameter.default is parameter.empty else f" = {parameter.default!r}"
    return f"{stars}{parameter.name}: {parameter.annotation}{default}"


def _returned(verb: Any) -> str:
    answer = str(_signature_of(verb).return_annotation)
    return f"Iterator[{answer}]" if isinstance(verb, Stream) else answer
