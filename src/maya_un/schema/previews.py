"""Jobs and places as computed before anything moves, as messages. Units are m, rad, s."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from maya_un.values import Joints, Notice, Point


class PhasePreview(NamedTuple):
    """Name and duration [s] of one phase; the duration of a homing is not known before."""

    name: str
    duration: float | None


@dataclass(frozen=True, slots=True)
class StepPreview:
    """One step: durations in s (None for a homing), heights in m, `end_counts` in encoder counts."""

    index: int
    key: str
    step: str
    duration: float | None
    phases: tuple[PhasePreview, ...]
    lowest: float | None
    highest: float | None
    end_counts: tuple[int, int, int] | None


@dataclass(frozen=True, slots=True)
class Refusal:
    """The first step that would be refused, and why."""

    index: int
    key: str
    step: str
    notice: Notice


@dataclass(frozen=True, slots=True)
class JobPreview:
    """The preview of a job.

    `duration` [s] is the sum over the steps that can be predicted (not homing). `lowest` and `highest` are the extreme
    heights of the gripper point [m]. If there is a `refusal`, `steps` ends before the refused step. Maya would then
    refuse the whole job.
    """

    duration: float
    lowest: float | None
    highest: float | None
    steps: tuple[StepPreview, ...]
    refusal: Refusal | None


@dataclass(frozen=True, slots=True)
class Band:
    """A phase of a step, from `start` to `end` [s] of the job."""

    step: int
    phase: str
    start: float
    end: float


@dataclass(frozen=True, slots=True)
class Nearest:
    """The least margin of a job to a limit or, with `zone`, a zone of that `name`: in which step, at which time [s]."""

    name: str
    margin: float
    unit: str
    zone: bool
    step: int
    time: float


@dataclass(frozen=True, slots=True)
class Samples:
    """A motion sampled: times from the start of the job [s], joints [rad, m, m] and velocities [rad/s, m/s, m/s]."""

    step: int
    time: tuple[float, ...]
    joints: tuple[tuple[float, float, float], ...]
    velocity: tuple[tuple[float, float, float], ...]


@dataclass(frozen=True, slots=True)
class JobInspection:
    """A job in detail. A homing counts as no time, because nobody knows it before.

    `stop_time` [s] and `stop_distance` [m] are those of the longest stop; both are 0 where nothing moves.
    """

    preview: JobPreview
    bands: tuple[Band, ...]
    closest: tuple[Nearest, ...]
    stop_time: float
    stop_distance: float
    motions: tuple[Samples, ...]


@dataclass(frozen=True, slots=True)
class Distance:
    """How far a place is from a `limit`, in its `unit` ("m", "rad" or "load"); `zone` is the name of one, else ""."""

    limit: str
    zone: str
    margin: float
    unit: str


@dataclass(frozen=True, slots=True)
class Broken:
    """A `limit` that a place breaks by `excess`, in its `unit` ("m", "rad" or "load"), in words; `zone` as above."""

    limit: str
    zone: str
    excess: float
    unit: str
    text: str


@dataclass(frozen=True, slots=True)
class Reach:
    """Whether a point can be reached; by which joints (rad, m, m), or why not and where instead [m].

    Of a point that can be reached it tells the `margins` to every limit and the `tensions` of lines b and c in
    multiples of the load, of another all limits that it has `broken`; `reason` is the first of them. `nearest` is None
    where the zones leave nothing.
    """

    reachable: bool
    joints: Joints | None
    reason: str | None
    nearest: Point | None
    margins: tuple[Distance, ...] = ()
    tensions: tuple[float, float] | None = None
    broken: tuple[Broken, ...] = ()
