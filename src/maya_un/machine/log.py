"""The parts on the table, and the log of the mechanics: extremes, stalls, drops.

The mechanics write it, and any code may read it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import dist
from typing import NamedTuple, Protocol

import numpy as np

from maya_un.machine.truth import Floats, Triple

Place = tuple[float, float, float]

REACH = 0.015
"""Closing jaws take a part whose grasp point is within this distance of the gripper point [m]."""

FALL = 0.005
"""A part that falls farther than this when the jaws open was dropped, not put down [m]."""


@dataclass(frozen=True, slots=True)
class PartDrop:
    """A part was released at time `time` [s] and fell by `height` [m] to `place` [m]."""

    time: float
    name: str
    height: float
    place: Place


class PartTable:
    """Named parts, each at its grasp point (x, y, z) [m]; on the table each part keeps the z of its first place.

    `closed` is whether the jaws are closed at power-up; jaws that are closed already take no part.
    """

    def __init__(self, parts: Mapping[str, Place], *, closed: bool) -> None:
        self._places: dict[str, Place] = {}
        self._rest: dict[str, float] = {}
        self._closed = closed
        self._carried: str | None = None
        self._lift = 0.0
        for name, place in parts.items():
            self.add(name, place)

    @property
    def closed(self) -> bool:
        """Whether the jaws are closed."""
        return self._closed

    @property
    def carried(self) -> str | None:
        """The name of the part between the jaws, None without one."""
        return self._carried

    def add(self, name: str, place: Place) -> None:
        """Put a part on the table at `place` [m]; raises `ValueError` if the name is taken."""
        if name in self._places:
            raise ValueError(f"a part called {name} is on the table already")
        x, y, z = place
        self._places[name] = (x, y, z)
        self._rest[name] = z

    def places(self, gripper: Place) -> dict[str, Place]:
        """Return the places of the parts [m], with the gripper point at `gripper` [m]."""
        places = dict(self._places)
        if self._carried is not None:
            x, y, z = gripper
            places[self._carried] = (x, y, z + self._lift)
        return places

    def close(self, gripper: Place) -> str | None:
        """Close the jaws at `gripper` [m]; return the name of the part they take, or None.

        The jaws centre the part: its x and y become theirs, its height relative to them stays.
        """
        if self._closed:
            return None
        self._closed = True
        near = [(dist(place, gripper), name) for name, place in self._places.items()]
        distance, name = min(near, default=(REACH + 1.0, ""))
        if distance > REACH:
            return None
        self._carried = name
        self._lift = self._places[name][2] - gripper[2]
        return name

    def open(self, gripper: Place, time: float) -> PartDrop | None:
        """Open the jaws at `gripper` [m]; a part between them comes to rest below.

        Returns the drop if it fell farther than 5 mm, else None.
        """
        self._closed = False
        name, self._carried = self._carried, None
        if name is None:
            return None
        x, y, z = gripper
        rest = self._places[name] = (x, y, self._rest[name])
        height = z + self._lift - rest[2]
        return PartDrop(time, name, height, rest) if height > FALL else None


@dataclass(frozen=True, slots=True)
class Window:
    """The extremes of a stretch of time that begins at `since` [s] with the gripper at `start_height` [m].

    `tension` is the greatest line tension [multiples of the load] and `slack` the greatest surplus length of a line
    [m]; `lowest` and `highest` bound the gripper's height [m]; `low` and `high` bound the true angle and line lengths
    [rad, m, m]; `stalled` is how long each axis pushed against an obstacle [s]; `outside` is the way that both lines
    travelled while one of them was slack, that is outside 0 ≤ u ≤ W [m]; `limited` is how long the torque limit held
    each axis back [s].
    """

    since: float
    start_height: float
    tension: float
    slack: float
    lowest: float
    highest: float
    low: Triple
    high: Triple
    stalled: Triple = (0.0, 0.0, 0.0)
    outside: float = 0.0
    drops: tuple[PartDrop, ...] = ()
    limited: Triple = (0.0, 0.0, 0.0)

    @property
    def sunk(self) -> float:
        """Greatest descent of the gripper below its height at the start of the window [m]."""
        return self.start_height - self.lowest

    @property
    def stall_time(self) -> float:
        """The greatest total time for which an axis was stalled [s]."""
        return max(self.stalled)

    def then(self, later: Window) -> Window:
        """Return the window that covers this one and `later`, which follows it."""
        return Window(
            self.since,
            self.start_height,
            max(self.tension, later.tension),
            max(self.slack, later.slack),
            min(self.lowest, later.lowest),
            max(self.highest, later.highest),
            _each(min, self.low, later.low),
            _each(max, self.high, later.high),
            _each(_sum, self.stalled, later.stalled),
            self.outside + later.outside,
            self.drops + later.drops,
            _each(_sum, self.limited, later.limited),
        )


def _each(pick: Callable[[float, float], float], one: Triple, other: Triple) -> Triple:
    return pick(one[0], other[0]), pick(one[1], other[1]), pick(one[2], other[2])


def _sum(one: float, other: float) -> float:
    return one + other


class Trace(NamedTuple):
    """Samples in order of time, each of shape (n,): time [s], angle [rad], lengths [m], greater tension."""

    t: Floats
    a: Floats
    b: Floats
    c: Floats
    tension: Floats


class MechanicsListener(Protocol):
    """Receives the entries of the mechanics, as they are written."""

    def added(self, window: Window) -> None:
        """Take the window of a further stretch of time."""
        ...

    def held(self, axes: tuple[bool, ...]) -> None:
        """Take which axes an obstacle holds back from now on."""
        ...

    def gripped(self, name: str) -> None:
        """Take the name of a part that the jaws took."""
        ...

    def released(self, name: str, place: Place, drop: PartDrop | None) -> None:
        """Take the name and place of a part that the jaws released, and its drop, if it fell."""
        ...


class MechanicsLog:
    """The record that the mechanics write. Windows between marks are separate, so that each mark can be queried."""

    def __init__(self, first: Window) -> None:
        self._windows = [first]
        self._samples: list[Trace] = []
        self._held: tuple[bool, ...] = (False, False, False)
        self.tracing = False
        self.listener: MechanicsListener | None = None

    def add(self, window: Window) -> None:
        """Add the window of a further stretch of time."""
        self._windows[-1] = self._windows[-1].then(window)
        if self.listener is not None:
            self.listener.added(window)

    def hold(self, axes: tuple[bool, ...]) -> None:
        """Record which axes an obstacle holds back."""
        if axes != self._held:
            self._held = axes
            if self.listener is not None:
                self.listener.held(axes)

    def grip(self, name: str) -> None:
        """Record that the jaws took a part."""
        if self.listener is not None:
            self.listener.gripped(name)

    def release(self, name: str, place: Place, drop: PartDrop | None) -> None:
        """Record that the jaws released a part, which rests at `place` [m], and its fall, if it fell."""
        if drop is not None:
            self._windows[-1] = replace(self._windows[-1], drops=(*self._windows[-1].drops, drop))
        if self.listener is not None:
            self.listener.released(name, place, drop)

    def trace(self, samples: Trace) -> None:
        """Store samples, if tracing is switched on."""
        if self.tracing:
            self._samples.append(samples)

    def mark(self, now: Window) -> int:
        """Begin a new window with the state `now`; return its number."""
        self._windows.append(now)
        return len(self._windows) - 1

    def since(self, mark: int) -> Window:
        """Return the window from a mark to the present."""
        window = self._windows[mark]
        for later in self._windows[mark + 1 :]:
            window = window.then(later)
        return window

    def samples(self) -> Trace:
        """Return all stored samples."""
        if not self._samples:
            return Trace(*(np.empty(0) for _ in Trace._fields))
        return Trace(*(np.concatenate(column) for column in zip(*self._samples, strict=True)))


class MechanicsRecord:
    """The mechanics' own record, from power-up to the present. Nothing outside the mechanics can write it.

    Extremes hold for continuous time: motion is evaluated where its law changes or an axis turns, and every 50 ms.
    """

    __slots__ = ("_log", "_now", "_table", "_where")

    def __init__(
        self, log: MechanicsLog, table: PartTable, where: Callable[[], Place], now: Callable[[], Window]
    ) -> None:
        """`now` updates the log and returns the present state; `where` returns the gripper point."""
        self._log = log
        self._table = table
        self._where = where
        self._now = now

    def mark(self) -> int:
        """Begin a window here; `since` with the returned number returns its extremes."""
        return self._log.mark(self._now())

    def since(self, mark: int) -> Window:
        """Return the extremes from `mark` to the present; 0 is power-up."""
        self._now()
        return self._log.since(mark)

    @property
    def whole(self) -> Window:
        """The extremes since power-up."""
        return self.since(0)

    @property
    def start_height(self) -> float:
        """Height of the gripper point at power-up [m]."""
        return self.whole.start_height

    @property
    def peak_tension(self) -> float:
        """Greatest tension of a line [multiples of the load]."""
        return self.whole.tension

    @property
    def peak_slack(self) -> float:
        """Greatest surplus length of a slack line [m]."""
        return self.whole.slack

    @property
    def stalled(self) -> Triple:
        """How long each axis pushed against an obstacle [s]."""
        return self.whole.stalled

    @property
    def stall_time(self) -> float:
        """The longest of the three stall times [s]."""
        return self.whole.stall_time

    @property
    def limited(self) -> Triple:
        """How long the torque limit held each axis back [s]."""
        return self.whole.limited

    @property
    def lowest(self) -> float:
        """Lowest height of the gripper point [m]."""
        return self.whole.lowest

    @property
    def sunk(self) -> float:
        """Greatest descent of the gripper below its height at power-up [m]."""
        return self.whole.sunk

    @property
    def outside(self) -> float:
        """The way that the lines travelled while one was slack [m]."""
        return self.whole.outside

    @property
    def drops(self) -> tuple[PartDrop, ...]:
        """The parts that fell."""
        return self.whole.drops

    @property
    def parts(self) -> dict[str, Place]:
        """The places of the parts: their grasp points [m]."""
        return self._table.places(self._where())

    @property
    def gripper_closed(self) -> bool:
        """Whether the jaws are closed."""
        return self._table.closed

    @property
    def carried(self) -> str | None:
        """The part between the jaws, None without one."""
        return self._table.carried

    @property
    def trace(self) -> Trace:
        """The samples since tracing was switched on."""
        self._now()
        return self._log.samples()
