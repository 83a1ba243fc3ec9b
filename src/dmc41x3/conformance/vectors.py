"""The table: each vector is a conversation with its valid answers and their sources."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Any, Literal

TABLE = Path(__file__).parent / "table"
_SHARED = "shared.json"
_KEYS = {"name", "steps", "source", "certainty", "axes", "demands", "setup", "restore", "keep", "whole", "udp"}

Certainty = Literal["two", "one", "inferred"]


class Demand(Enum):
    """A demand of a vector on the controller, beside its answers; the controller's owner may forbid it."""

    MOVES = "switches motors on and off, turns them by a few thousand counts, defines positions"
    OUTPUTS = "switches digital outputs"
    PROGRAM = "replaces the program in memory, and runs it"
    CLIENTS = "ends the connections of other clients"
    FRESH = "expects factory settings, no program, idle inputs, and no other client"
    BURNS = "writes to EEPROM, or resets the controller"


class Special(Enum):
    """A step that is not a simple exchange of bytes."""

    WAIT = "let time pass"
    UNTIL = "ask again until the answer comes"
    RECORD = "ask for the data record"
    CLOSE = "hang up"
    CLOSED = "find the connection ended by the other side"


@dataclass(frozen=True, slots=True)
class VectorStep:
    """One step on connection `on`: bytes sent, and the valid replies (see `Pattern`); "" means no reply.

    `seconds` is how long to wait or to repeat the request. `fields` are fields of a record: offset, kind as in
    `struct`, smallest and largest value, and a bit mask, 0 for all bits. `times` is how often the step is done.
    """

    send: str = ""
    expect: tuple[str, ...] = ("",)
    on: str = ""
    special: Special | None = None
    seconds: float = 0.0
    fields: tuple[tuple[int, str, int, int, int], ...] = ()
    times: int = 1


@dataclass(frozen=True, slots=True)
class Vector:
    """One conversation.

    `sources` are letters explained in `sources()`. `certainty` states whether two sources or one state the answer, or
    the answer follows from them. `axes` are the smallest and largest number of axes to which the vector applies.
    `setup` and `restore` are commands sent before and after; the controller must accept those of `setup`. `keep` names
    registers (`SPA`) whose values are restored. `whole` means that its lines must not arrive in pieces. `udp` is the
    reason why the vector cannot run over UDP, empty if it can.
    """

    name: str
    steps: tuple[VectorStep, ...]
    sources: str
    certainty: Certainty
    axes: tuple[int, int] = (1, 8)
    demands: frozenset[Demand] = frozenset()
    setup: tuple[str, ...] = ()
    restore: tuple[str, ...] = ()
    keep: tuple[str, ...] = ()
    whole: bool = False
    udp: str = ""
    group: str = field(default="", compare=False)

    def fits(self, axes: int) -> bool:
        """Return whether the vector applies to a controller with `axes` axes."""
        return self.axes[0] <= axes <= self.axes[1]


@cache
def load() -> tuple[Vector, ...]:
    """Return the whole table. Raises `ValueError` for an invalid entry."""
    setups = _json(_SHARED)["setups"]
    return tuple(_vectors(setups))


@cache
def sources() -> Mapping[str, str]:
    """Return the meaning of every letter in `Vector.sources`."""
    return _json(_SHARED)["sources"]


@cache
def fresh() -> tuple[str, ...]:
    """Return the commands that restore the factory settings of a controller, except those of its network."""
    return tuple(_json(_SHARED)["fresh"])


def _json(name: str) -> dict[str, Any]:
    return json.loads((TABLE / name).read_text("utf-8"))


def _vectors(setups: Mapping[str, list[str]]) -> Iterator[Vector]:
    for file in sorted(TABLE.glob("*.json")):
        if file.name == _SHARED:
            continue
        for entry in json.loads(file.read_text("utf-8")):
            try:
                yield _vector(entry, file.stem, setups)
            except (KeyError, TypeError, ValueError) as error:
                raise ValueError(f"{file.name}: {entry.get('name')}: {error!r}") from error


def _vector(entry: dict[str, Any], group: str, setups: Mapping[str, list[str]]) -> Vector:
    unknown = entry.keys() - _KEYS
    if unknown:
        raise ValueError(f"unknown keys {sorted(unknown)}")
    least = entry.get("axes", 1)
    certainty: Certainty = entry["certainty"]
    if certainty not in ("two", "one", "inferred"):
        raise ValueError(f"certainty {certainty!r}")
    return Vector(
        name=entry["name"],
        steps=tuple(map(_step, entry["steps"])),
        sources=entry["source"],
        certainty=certainty,
        axes=(least[0], least[1]) if isinstance(least, list) else (least, 8),
        demands=frozenset(Demand[name.upper()] for name in entry.get("demands", ())),
        setup=_commands(entry.get("setup", ()), setups),
        restore=_commands(entry.get("restore", ()), setups),
        keep=tuple(entry.get("keep", ())),
        whole=entry.get("whole", False),
        udp=entry.get("udp", ""),
        group=group,
    )


def _commands(names: list[str], setups: Mapping[str, list[str]]) -> tuple[str, ...]:
    """Return commands; `@name` stands for those of a shared setup."""
    return tuple(one for name in names for one in (setups[name[1:]] if name[:1] == "@" else [name]))


def _step(entry: list[str] | dict[str, Any]) -> VectorStep:
    """Return a step of `[sent, reply, other reply...]`, or of an object with the fields of `VectorStep`."""
    if isinstance(entry, list):
        return VectorStep(entry[0], tuple(entry[1:]))
    rest = dict(entry)
    special = next((kind for kind in Special if kind.name.lower() in rest), None)
    value = rest.pop(special.name.lower()) if special is not None else None
    if special is Special.WAIT:
        rest["seconds"] = value
    elif special is not None and special in (Special.UNTIL, Special.RECORD):
        rest["send"] = value
    elif special is not None:
        rest["on"] = value
    expect = rest.pop("expect", "")
    fields = tuple((*field[:4], field[4] if len(field) > 4 else 0) for field in rest.pop("fields", ()))
    return VectorStep(
        expect=(expect,) if isinstance(expect, str) else tuple(expect), special=special, fields=fields, **rest
    )
