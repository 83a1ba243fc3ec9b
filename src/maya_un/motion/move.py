"""A coordinated move as the controller gets it: segments, speeds, the profile that follows, the commands."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from math import sqrt
from typing import NamedTuple

from maya_un.config import Units
from maya_un.motion.profile import Profile
from maya_un.values import Joints

Counts = tuple[int, int, int]
"""Whole encoder counts of the axes a, b, c."""


def norm(counts: Counts) -> float:
    """Return the length of a way in counts, as the controller measures it over the axes of a sequence."""
    one, two, three = counts
    return sqrt(one * one + two * two + three * three)


class Segment(NamedTuple):
    """One LI: how far each axis goes [counts], the target speed and the speed at its end [counts/s]."""

    counts: Counts
    speed: int
    end_speed: int

    @property
    def length(self) -> float:
        """Way along the path [counts]: the norm over the axes."""
        return norm(self.counts)


@dataclass(frozen=True, slots=True)
class CoordinatedMove:
    """A move in linear mode, complete before it starts.

    `start` and `end` are in counts, `va` and `vd` in counts/s², `vs` in counts/s. `columns` says which joint (0 to
    2) stands in the place of the controller's axes A, B, C …, None for an axis that takes no part. `profile` is
    the way over time, `ways` the way along the path at every segment's end [counts], `places` the counts there;
    `via_ways` is the way at every waypoint between the ends of the path [counts].
    """

    start: Counts
    end: Counts
    segments: tuple[Segment, ...]
    columns: tuple[int | None, ...]
    va: int
    vd: int
    vs: int
    units: Units
    profile: Profile
    ways: tuple[float, ...]
    places: tuple[Counts, ...]
    via_ways: tuple[float, ...] = ()

    @classmethod
    def along(
        cls,
        start: Counts,
        segments: Sequence[Segment],
        letters: tuple[str, str, str],
        va: int,
        vd: int,
        units: Units,
        vias: tuple[float, ...] = (),
    ) -> CoordinatedMove:
        """Return the move over `segments`, begun at `start`; `letters` are the controller's names of a, b, c.

        `vias` are the ways at which the waypoints between the ends are passed [counts].
        """
        lengths = [segment.length for segment in segments]
        places = tuple(accumulate((segment.counts for segment in segments), _plus, initial=start))
        legs = zip(lengths, segments, strict=True)
        return cls(
            start=start,
            end=places[-1],
            segments=tuple(segments),
            columns=_columns(segments, letters),
            va=va,
            vd=vd,
            vs=max((segment.speed for segment in segments), default=0),
            units=units,
            profile=Profile.along(((length, leg.speed, leg.end_speed) for length, leg in legs), va, vd),
            ways=tuple(accumulate(lengths)),
            places=places,
            via_ways=vias,
        )

    @property
    def axes(self) -> str:
        """Letters of the controller's axes that take part, "" for a move without segments."""
        return "".join("ABC"[place] for place, joint in enumerate(self.columns) if joint is not None)

    @property
    def duration(self) -> float:
        """Time from start to rest [s], as the controller takes it."""
        return self.profile.duration

    def via_times(self) -> tuple[float, ...]:
        """Return when the waypoints between the ends of the path are passed [s]."""
        return tuple(self.profile.when(way) for way in self.via_ways)

    def position_at(self, t: float) -> Joints:
        """Return where the axes are at time `t` [s] after the start (rad, m, m)."""
        return self._joints(self.profile.at(t)[0])

    def speed_at(self, t: float) -> float:
        """Return the speed along the path at time `t` [counts/s]."""
        return self.profile.at(t)[1]

    def velocity_at(self, t: float) -> tuple[float, float, float]:
        """Return the speed of every axis at time `t` (rad/s, m/s, m/s)."""
        way, speed = self.profile.at(t)
        if speed == 0.0:
            return 0.0, 0.0, 0.0
        segment = self.segments[min(bisect_right(self.ways, way), len(self.segments) - 1)]
        per_length = speed / segment.length
        a, b, c = (
            counts * per_length / scale for counts, scale in zip(segment.counts, self.units.per_unit, strict=True)
        )
        return a, b, c

    def stop_distance(self, speed: float) -> float:
        """Return how far along the path a stop from `speed` [counts/s] takes [counts]."""
        return 0.5 * speed * speed / self.vd

    def stop_at(self, t: float) -> tuple[float, Joints]:
        """Return how long a stop said at time `t` takes [s], and where on the path it ends (rad, m, m)."""
        way, speed = self.profile.at(t)
        return speed / self.vd, self._joints(min(self.profile.length, way + self.stop_distance(speed)))

    def _joints(self, way: float) -> Joints:
        index = bisect_right(self.ways, way)
        if index >= len(self.segments):
            return self.units.to_joints(self.end)
        segment, place = self.segments[index], self.places[index]
        share = 1.0 - (self.ways[index] - way) / segment.length
        a, b, c = (begun + counts * share for begun, counts in zip(place, segment.counts, strict=True))
        return self.units.to_joints((a, b, c))


def speed_ratio(ratio: float) -> str:
    """Return the command that scales the speeds of a sequence, also of one under way (Galil DMC-41x3, command VR)."""
    return f"VR {round(ratio, 4):g}"


def commands(move: CoordinatedMove, ratio: float = 1.0) -> list[str]:
    """Return the commands that load a move into the controller, in order; BGS starts it.

    Plane S is chosen and its speed ratio set to `ratio`, whatever somebody else left; the sequence of an earlier stop
    is cleared. A move without segments needs no commands.
    """
    if not move.segments:
        return []
    setup = ["CA S", "CS S", speed_ratio(ratio), f"LM {move.axes}", f"VA {move.va}", f"VD {move.vd}", f"VS {move.vs}"]
    return [*setup, *(_li(segment, move.columns) for segment in move.segments), "LE"]


def _li(segment: Segment, columns: tuple[int | None, ...]) -> str:
    distances = ",".join("" if joint is None else str(segment.counts[joint]) for joint in columns)
    return f"LI {distances}<{segment.speed}>{segment.end_speed}"


def _columns(segments: Sequence[Segment], letters: tuple[str, str, str]) -> tuple[int | None, ...]:
    """Return the joint in the place of A, B, C: those that move, and b and c always together."""
    moving = {joint for joint in range(3) if any(segment.counts[joint] for segment in segments)}
    if moving & {1, 2}:
        moving |= {1, 2}
    places = {letters[joint]: joint for joint in moving}
    last = max(places, default="")
    return tuple(places.get(letter) for letter in "ABC" if letter <= last)


def _plus(one: Counts, two: Counts) -> Counts:
    return one[0] + two[0], one[1] + two[1], one[2] + two[2]
