"""A recording: its header, and everything in it in order."""

from __future__ import annotations

import os
import platform
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from pydantic import TypeAdapter, ValidationError

import maya_un
from dmc41x3.i18n import phrase
from dmc41x3.wire.transcript import WirePiece
from maya_un.config import Config
from maya_un.events import Event
from maya_un.validation import reason_of
from maya_un.values import State

FORMAT = "maya-recording"
VERSION = 1

SECTIONS = ("controller", "geometry", "scale", "axes", "gripper", "wiring", "safety", "homing", "cell", "zones")
"""Sections of the configuration in a recording: the machine's. No other goes into a file that is passed on."""


@dataclass(frozen=True, slots=True)
class TwinSource:
    """The parameters of the twin: `seed` of its start and wires, its own `truth`, its position, `parts` on its table.

    `born` is the loop's time when its clock was 0 [s], `start` its true angle [rad] and line lengths [m].
    """

    seed: int
    truth: dict[str, Any]
    start: tuple[float, float, float]
    parts: dict[str, tuple[float, float, float]]
    born: float


@dataclass(frozen=True, slots=True)
class SavingCause:
    """The event that caused the saving: number, kind, code and sentence; all empty if a user requested it."""

    seq: int = 0
    kind: str = ""
    code: int = 0
    message: str = ""


@dataclass(frozen=True, slots=True)
class RecordingOrigin:
    """Data of the robot before anything is recorded; `speed` is the speed of the loop's clock."""

    config: dict[str, Any]
    address: str
    speed: float = 1.0
    twin: TwinSource | None = None

    @classmethod
    def of(cls, config: Config, address: str, *, speed: float = 1.0, twin: TwinSource | None = None) -> RecordingOrigin:
        """Return the origin of a robot with this configuration, of which only the machine's `SECTIONS` are stored."""
        return cls(config.model_dump(mode="json", include=set(SECTIONS)), address, speed, twin)


@dataclass(frozen=True, slots=True)
class Software:
    """Software and kind of host; nothing that names the host or its user."""

    maya_un: str
    python: str
    system: str
    machine: str
    processors: int

    @classmethod
    def running(cls) -> Software:
        """Return the software and host of this process."""
        return cls(
            maya_un.__version__,
            platform.python_version(),
            f"{platform.system()} {platform.release()}",
            platform.machine(),
            os.cpu_count() or 1,
        )


@dataclass(frozen=True, slots=True)
class Header:
    """The head of a recording. Times are of the loop's clock [s]; `utc` is the date of the time `saved` [ns].

    From `whole` on nothing is missing. The wire may hold earlier pieces: those up to `opening`, in which the controller
    was configured. `complete` is whether nothing is missing at all. `firmware` is the controller's line.
    """

    reason: str
    saved: float
    utc: int
    whole: float
    complete: bool
    firmware: str
    origin: RecordingOrigin
    software: Software
    cause: SavingCause = SavingCause()
    opening: float = 0.0
    format: str = FORMAT
    version: int = VERSION

    @property
    def date(self) -> str:
        """The date of saving (ISO 8601, UTC, milliseconds)."""
        return date(self.utc)

    def utc_at(self, time: float) -> int:
        """Return the date of a loop time [ns since 1970, UTC], counted back from the instant of saving."""
        return self.utc + round((time - self.saved) / self.origin.speed * 1e9)

    def to_json(self) -> str:
        """Return the header as JSON."""
        return _adapter().dump_json(self).decode()

    @classmethod
    def from_json(cls, text: str) -> Header:
        """Read a header back; raises `ValueError` for invalid data, or another version."""
        try:
            found = _adapter().validate_json(text)
        except ValidationError as error:
            raise ValueError(
                phrase("its header is not valid: {message}", message=reason_of(error.errors(include_url=False)[0]))
            ) from error
        if (found.format, found.version) != (FORMAT, VERSION):
            raise ValueError(phrase("it is no {format} of version {version}", format=FORMAT, version=VERSION))
        return found


class TimeSpan(NamedTuple):
    """A span of a recording: times of the program's clock from `begin` on and before `end` [s]."""

    begin: float
    end: float

    def of(self, header: Header) -> tuple[int, int]:
        """Return both as dates [ns since 1970, UTC]."""
        return max(0, header.utc_at(self.begin)), max(0, header.utc_at(self.end))


def date(utc: int) -> str:
    """Return nanoseconds since 1970 as a date (ISO 8601, UTC, milliseconds)."""
    return f"{np.datetime64(utc // 1_000_000, 'ms')}Z"


@cache
def _adapter() -> TypeAdapter[Header]:
    return TypeAdapter(Header)


def plain(detail: Mapping[str, object]) -> dict[str, str | int | float | bool | None]:
    """Return the details of an event in values that JSON can hold; other values become text."""
    return {
        key: value if value is None or isinstance(value, str | int | float | bool) else str(value)
        for key, value in detail.items()
    }


@dataclass(frozen=True, slots=True)
class Recording:
    """States, events and pieces of the wire, each in order; times are of the loop's clock [s].

    The client of a piece is this program. Connections are numbered from 1.
    """

    header: Header
    states: tuple[State, ...] = ()
    events: tuple[Event, ...] = ()
    wire: tuple[WirePiece, ...] = ()

    @property
    def span(self) -> tuple[float, float]:
        """Loop times of the first and the last entry after `whole` [s]; `saved` for an empty recording."""
        whole = self.header.whole
        times = [
            thing.time for things in (self.states, self.events, self.wire) for thing in things if thing.time >= whole
        ]
        return (min(times), max(times)) if times else (self.header.saved, self.header.saved)
