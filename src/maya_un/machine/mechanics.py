"""Maya as a body: two lines and a boom, driven by three motors, with a gripper over a table.

Motion is free or in contact. Free motion is the delayed reference in closed form; it is evaluated only on request,
however long it took. In contact (an axis is held back by a hard stop, or because two lines cannot be shorter together
than the distance of their anchors) and while an unlocked drum pays out, the state is stepped by at most 2 ms, until all
axes are again at their commanded positions. See docs/explanation/mechanics.md.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import ceil, cos, inf, nextafter, sin, sqrt
from typing import NamedTuple

import numpy as np

from dmc41x3.twin.plant import CONTACT_STEP, TORQUE_LIMIT, Sensing
from dmc41x3.twin.timeline import FLAT, Timeline, TimelinePiece
from maya_un.machine.drive import GIVE, AxisDrive
from maya_un.machine.log import MechanicsListener, MechanicsLog, MechanicsRecord, PartTable, Place, Trace, Window
from maya_un.machine.truth import Floats, LoadStatics, StartPose, Statics, Switch, Triple, TrueConstants

SAMPLE = 0.05
"""Longest time between two samples of free motion in the record [s]."""

_OLDEST = 60.0
"""Free motion is written to the record after this time at the latest [s]."""

_AFTER = 1e-6
"""The future is searched to this long after the last motion [s], so that rounding hides no arrival ..."""

_FAR = 1e6
"""... and where an axis jogs for ever, no farther than this [s]."""

_LIGHT = 1.1
"""A motor with less strength than this is monitored whenever it moves [loads]."""

_MIDDLE = 1.05
"""On an ellipse about the anchors whose middle carries more than a load, no place carries more than this times that."""

_SLACK = 1e-5
"""A line counts as slack from this surplus on [m]: ten encoder counts, beyond the rounding of a target."""


class _Outlook(NamedTuple):
    """The events of free motion until `until` [s], as long as the plans counted by `key` hold."""

    key: int
    until: float
    contact: float
    switch: float


class MayaMechanics:
    """Maya's body, a `Plant`. `truth` has its constants, `start` its pose at power-up, `parts` the parts on the table.

    A `Plant` has the axes of the controller, A to C; the constants say which of them drive a, b and c. Parts are named
    and placed by their grasp points (x, y, z) [m]. With `trace` the record stores samples.
    """

    def __init__(
        self,
        truth: TrueConstants | None = None,
        start: StartPose | None = None,
        parts: Mapping[str, Place] | None = None,
        *,
        trace: bool = False,
    ) -> None:
        self._truth = truth or TrueConstants()
        self._start = start or StartPose()
        self._statics = Statics.of(self._truth)
        self._drives = tuple(AxisDrive(self._truth, axis, self._start[axis]) for axis in range(3))
        self._own = tuple(self._truth.letters.index(letter) for letter in "ABC")
        self._timelines = tuple(self._drives[own].timeline for own in self._own)
        self._shortest = (self._truth.width - self._start.b - self._start.c) * self._truth.counts_per_metre
        self._now = self._written = 0.0
        self._epoch = 0
        self._sensing = Sensing()
        self._stepping = not self._truth.self_locking
        self._supported = False
        self._outlook = _Outlook(-1, 0.0, inf, inf)
        self._table = PartTable(parts or {}, closed=not self._truth.gripper_closes_on)
        self._log = MechanicsLog(self._instant())
        self._log.tracing = trace
        self._record = MechanicsRecord(self._log, self._table, self.gripper_point, self._settled)

    @property
    def truth(self) -> TrueConstants:
        """The true constants of this machine."""
        return self._truth

    @property
    def start(self) -> StartPose:
        """Its pose at power-up [rad, m, m]."""
        return self._start

    @property
    def record(self) -> MechanicsRecord:
        """The mechanics' own record."""
        return self._record

    @property
    def parts(self) -> dict[str, Place]:
        """The places of the parts: their grasp points [m]."""
        return self._record.parts

    @property
    def written(self) -> Window:
        """The record since power-up, without free motion that is not evaluated yet."""
        return self._log.since(0)

    @property
    def now(self) -> float:
        """The time last advanced to [s]."""
        return self._now

    @property
    def timelines(self) -> Sequence[Timeline]:
        """The references of the axes, in motor counts since power-up."""
        return self._timelines

    def add_part(self, name: str, place: Place) -> None:
        """Put another part on the table. Raises `ValueError` if the name is taken."""
        self._table.add(name, place)

    def listen(self, listener: MechanicsListener) -> None:
        """Report new entries to `listener`, in place of a former one."""
        self._log.listener = listener

    def settle(self) -> None:
        """Write the free motion up to the present into the record."""
        self._write()

    def true_joints(self) -> Triple:
        """Return the true angle [rad] and the true line lengths [m]."""
        a, b, c = self._drives
        return a.q, b.q, c.q

    def gripper_point(self) -> Place:
        """Return the gripper point: x, y, z [m]."""
        a, b, c = self.true_joints()
        hang = self._statics.hang(b, c)
        return hang.d * sin(a), hang.d * cos(a), hang.z

    def tension(self) -> tuple[float, float]:
        """Return the tensions of lines b and c [multiples of the load]."""
        hang = self._hang()
        return hang.tension_b, hang.tension_c

    def advance(self, t: float) -> None:
        """Advance body and record to time `t` [s]; an earlier time has no effect."""
        while self._now < t:
            if self._stepping:
                self._step(min(t, self._now + CONTACT_STEP))
                continue
            contact = max(self._now, self._look(t).contact)
            self._move(min(t, contact))
            if contact <= t:
                self._write()
                self._stepping = True

    def next_event(self, until: float) -> float | None:
        """Return the earliest time in (now, until] at which the machine must be evaluated, None without one.

        That is a time at which a switch changes or contact begins; in contact every 2 ms.
        """
        if until <= self._now:
            return None
        if self._stepping:
            return min(until, self._now + CONTACT_STEP)
        outlook = self._look(until)
        event = max(min(outlook.contact, outlook.switch), nextafter(self._now, inf))
        return event if event <= until else None

    def position(self, axis: int) -> float:
        """Return the motor position of the encoder [counts]: the actual one, unless the encoder has failed."""
        own = self._own[axis]
        return self._sensing.position(own, self._drives[own].position)

    def velocity(self, axis: int) -> float:
        """Return the actual velocity [counts/s]."""
        own = self._own[axis]
        return self._sensing.velocity(own, self._drives[own].velocity)

    def torque(self, axis: int) -> float:
        """Return the motor command [V], within ±9.9982, positive toward a longer line or a larger angle.

        Shortening lifts the load against friction. With a self-locking drum the motor only overcomes friction when
        lengthening, and applies nothing at rest; with another drum the load always pulls. A blocked axis pushes harder
        by its following error, and so does an axis whose encoder has stopped counting.
        """
        own = self._own[axis]
        drive = self._drives[own]
        if not drive.powered:
            return 0.0
        held_back = drive.held_back()
        toward = held_back or drive.velocity
        load = self._truth.torque_per_load * self.tension()[own - 1] if own else 0.0
        if toward < 0.0:
            command = -(load + drive.friction)
        else:
            command = drive.friction if toward > 0.0 else 0.0
            if not self._truth.self_locking:
                command -= load
        if self._sensing.lost(own):
            held_back = drive.wanted + drive.shift - self.position(axis)
        command += drive.stiffness * held_back
        return max(-TORQUE_LIMIT, min(TORQUE_LIMIT, command))

    def inputs(self, axis: int) -> tuple[bool, bool, bool]:
        """Return the electrical levels (true = high) of forward limit, reverse limit and home input."""
        own = self._own[axis]
        reverse, forward = self._drives[own].levels()
        return self._sensing.inputs(own, (forward, reverse, True))

    def power(self, axis: int, on: bool) -> None:
        """Switch a motor on or off; without power a self-locking drum stays, another pays out its line."""
        self._write()
        own = self._own[axis]
        drive = self._drives[own]
        drive.shift = self.position(axis) - drive.position
        drive.power(self._now, on)
        drive.velocity = 0.0
        drive.wanted = drive.position
        self._epoch += 1
        self._stepping = self._stepping or self._pays_out(own)

    def limit_torque(self, axis: int, volts: float) -> None:
        """Limit a motor to `volts` [V]; it stands still if friction and the load need more."""
        self._write()
        self._drives[self._own[axis]].limit = volts
        self._epoch += 1

    def output(self, bit: int, on: bool) -> None:
        """Set a digital output; one of them moves the gripper's jaws."""
        if bit != self._truth.gripper_output:
            return
        gripper = self.gripper_point()
        if on == self._truth.gripper_closes_on:
            taken = self._table.close(gripper)
            if taken is not None:
                self._log.grip(taken)
            return
        carried = self._table.carried
        drop = self._table.open(gripper, self._now)
        if carried is not None:
            self._log.release(carried, self._table.places(gripper)[carried], drop)

    def press(self, own: int, side: Switch, *, down: bool) -> None:
        """Press a limit switch of a (0), b (1) or c (2) by hand, or let it go; the machine sees it at its next look."""
        self._drives[own].pressed[side] = down

    def support(self, on: bool) -> None:
        """Support the gripper, so that a drum without power pays out no line; or take the support away."""
        self._write()
        self._supported = on
        self._epoch += 1
        self._stepping = self._stepping or any(map(self._pays_out, (1, 2)))

    def fail_encoder(self, axis: int, on: bool) -> None:
        """Make an encoder stop counting, or continue from its last count; the body and its record are unchanged."""
        own = self._own[axis]
        self._sensing.fail_encoder(own, self._drives[own].position, on)

    def force_inputs(self, axis: int, **levels: bool | None) -> None:
        """Hold inputs at an electrical level independent of the axis, or release them (None)."""
        self._sensing.force_inputs(self._own[axis], levels)

    def _hang(self) -> LoadStatics:
        return self._statics.hang(self._drives[1].q, self._drives[2].q)

    def _key(self) -> int:
        return self._epoch + sum(timeline.version for timeline in self._timelines)

    def _look(self, until: float) -> _Outlook:
        """Return the events of free motion at least until `until`; cached as long as they hold."""
        known, key = self._outlook, self._key()
        if key == known.key and until <= known.until and self._now < known.switch:
            return known
        if key != known.key or self._now - self._written > _OLDEST:
            self._write()
            self._move(self._now)
        rest = max(drive.rest() for drive in self._drives) + _AFTER
        horizon = max(self._now, rest) if rest < inf else min(max(until, self._now + 1.0), self._now + _FAR)
        switches = (drive.switching(self._now, horizon) for drive in self._drives)
        contacts = (drive.collision(self._now, horizon) for drive in self._drives)
        self._outlook = _Outlook(
            key,
            inf if rest < inf else horizon,
            min(self._coupling(horizon), self._weak(horizon), *(inf if t is None else t for t in contacts)),
            min(inf if t is None else t for t in switches),
        )
        return self._outlook

    def _coupling(self, until: float) -> float:
        """Return when b + c is commanded shorter than W, or than the motors can pull them; inf for never.

        It evaluates free motion from now to `until`.
        """
        _, b, c = self._drives
        until = min(until, max(b.rest(), c.rest()) + _AFTER)
        if until <= self._now:
            return inf  # lines at rest get no shorter
        level = max(self._shortest - GIVE, self._tightest())
        if b.bounds(self._now, until)[0] + c.bounds(self._now, until)[0] >= level:
            return inf
        times = {self._now, until, *b.boundaries(self._now, until), *c.boundaries(self._now, until)}
        ts = np.array(sorted(times))
        half = 0.5 * np.diff(ts)  # the law is evaluated between boundaries, where it is unambiguous
        of_b, of_c = b.motion(ts[:-1] + half), c.motion(ts[:-1] + half)
        p, v, a = (one + other for one, other in zip(of_b, of_c, strict=True))
        first = _first_below(ts, p - v * half + 0.5 * a * half * half, v - a * half, a, level)
        return inf if first is None else first

    def _strength(self, axis: int) -> float:
        """Return the greatest tension against which an axis can shorten its line [multiples of the load]."""
        drive = self._drives[axis]
        return (drive.limit - drive.friction) / self._truth.torque_per_load

    def _limited(self, axis: int) -> bool:
        drive = self._drives[axis]
        return drive.powered and drive.limit < TORQUE_LIMIT

    def _tightest(self) -> float:
        """Return b + c [counts] below which a motor whose torque is limited might stay behind.

        In the middle of an ellipse about the anchors T = A / (2 sqrt(A² - 1)) with A = (b + c) / W.
        """
        strengths = [self._strength(axis) for axis in (1, 2) if self._limited(axis)]
        least = min((strength for strength in strengths if strength >= _LIGHT), default=inf) / _MIDDLE
        if least == inf:
            return -inf
        ratio = sqrt(4.0 * least * least / (4.0 * least * least - 1.0))
        return self._shortest + (ratio - 1.0) * self._truth.width * self._truth.counts_per_metre

    def _weak(self, until: float) -> float:
        """Return when an axis with a weak motor leaves its place, from now to `until`; inf for never."""
        times = (drive.leaving(self._now, until) for drive in self._weaklings())
        return min((t for t in times if t is not None), default=inf)

    def _weaklings(self) -> list[AxisDrive]:
        """Return the drives whose motors are weak: they may not move at all."""
        weak = [self._drives[axis] for axis in (1, 2) if self._limited(axis) and self._strength(axis) < _LIGHT]
        boom = self._drives[0]
        return [*weak, boom] if self._limited(0) and boom.limit <= boom.friction else weak

    def _doubtful(self) -> bool:
        """Return whether an axis moves now whose motor may be too weak to continue."""
        _, b, c = self._drives
        near = b.position + c.position <= self._tightest()
        return any(drive.rest() + _AFTER > self._now for drive in [*self._weaklings(), *((b, c) if near else ())])

    def _within_strength(self, axis: int, place: float) -> float:
        """Return how far an axis gets towards `place` [counts] with its limited torque."""
        drive = self._drives[axis]
        if not self._limited(axis) or place == drive.position:
            return place
        if axis == 0 or place > drive.position:
            return place if drive.limit > drive.friction else drive.position
        most = self._strength(axis)
        if self._pull(axis, place) <= most:
            return place
        if self._pull(axis, drive.position) >= most:
            return drive.position
        near, far = drive.position, place
        while near - far > 0.5 * GIVE:
            middle = 0.5 * (near + far)
            near, far = (middle, far) if self._pull(axis, middle) <= most else (near, middle)
        return near

    def _pull(self, axis: int, place: float) -> float:
        """Return the tension of a line with its motor at `place` [counts] and the other line unchanged [loads]."""
        drive, other = self._drives[axis], self._drives[3 - axis]
        q = drive.start + place / drive.scale
        b, c = (q, other.q) if axis == 1 else (other.q, q)
        if b + c <= self._truth.width:
            return inf
        hang = self._statics.hang(b, c)
        return hang.tension_b if axis == 1 else hang.tension_c

    def _move(self, t: float) -> None:
        """Advance to time `t` in free motion."""
        for drive in self._drives:
            drive.follow(t)
        self._now = t

    def _pays_out(self, axis: int) -> bool:
        drive = self._drives[axis]
        free = axis > 0 and not drive.powered and not self._truth.self_locking and not self._supported
        return free and drive.position < drive.stops[1]

    def _step(self, t: float) -> None:
        """Advance to time `t` in contact: every axis moves toward its commanded position, as far as it can."""
        length = t - self._now
        places: list[float] = []
        for axis, drive in enumerate(self._drives):
            drive.wanted = self._toward(axis, t)
            low, high = drive.stops
            places.append(max(low, min(high, drive.wanted)))
        possible = [self._within_strength(axis, place) for axis, place in enumerate(places)]
        weak = [abs(place - wanted) > GIVE for place, wanted in zip(possible, places, strict=True)]
        places = possible
        places[1:] = self._coupled(places[1], places[2])
        for drive, place in zip(self._drives, places, strict=True):
            drive.velocity = (place - drive.position) / length
            drive.position = place
        self._now = self._written = t
        held_back = [drive.held_back() != 0.0 for drive in self._drives]
        self._note(length, held_back, weak)
        stalled = [held and not limit for held, limit in zip(held_back, weak, strict=True)]
        self._log.hold(tuple(stalled))
        if not any(held_back) and not any(map(self._pays_out, (1, 2))) and not self._doubtful():
            self._stepping = False
            self._epoch += 1

    def _toward(self, axis: int, t: float) -> float:
        """Return the commanded position of an axis at time `t`; an unlocked drum under load pays out by itself."""
        drive = self._drives[axis]
        if self._pays_out(axis) and self.tension()[axis - 1] > 0.0:
            way = self._truth.fall_speed * drive.scale * (t - self._now)
            return min(drive.position + way, drive.stops[1])
        return drive.desired(t)[0]

    def _coupled(self, b: float, c: float) -> tuple[float, float]:
        """Return where lines commanded to `b` and `c` [counts] can go, since b + c ≥ W.

        A line that lengthens goes first; a line that shortens gets the remaining length; two that shorten share it.
        """
        was_b, was_c = self._drives[1].position, self._drives[2].position
        room = was_b + was_c - self._shortest
        shorter_b, shorter_c = was_b - b, was_c - c
        if b + c >= self._shortest or (shorter_b <= 0.0 and shorter_c <= 0.0):
            return b, c
        if shorter_b <= 0.0:
            return b, self._shortest - b
        if shorter_c <= 0.0:
            return self._shortest - c, c
        share = room / (shorter_b + shorter_c)
        return was_b - share * shorter_b, was_c - share * shorter_c

    def _settled(self) -> Window:
        self.settle()
        return self._instant()

    def _instant(self) -> Window:
        """Return the present state as a window."""
        q, hang = self.true_joints(), self._hang()
        return Window(self._now, hang.z, hang.tension, hang.slack, hang.z, hang.z, q, q)

    def _note(self, length: float, held_back: Sequence[bool], weak: Sequence[bool]) -> None:
        """Write a step of `length` [s] to the record, with the axes that were held back, or too weak to continue."""
        a, b, c = (length if held and not limit else 0.0 for held, limit in zip(held_back, weak, strict=True))
        limited_a, limited_b, limited_c = (length if limit else 0.0 for limit in weak)
        now = replace(self._instant(), stalled=(a, b, c), limited=(limited_a, limited_b, limited_c))
        if now.slack > _SLACK:
            way = sum(abs(drive.velocity) / drive.scale for drive in self._drives[1:]) * length
            now = replace(now, outside=way)
        self._log.add(now)
        if self._log.tracing:
            values = (self._now, *self.true_joints(), now.tension)
            self._log.trace(Trace(*(np.array([value]) for value in values)))

    def _write(self) -> None:
        """Write the free motion since the last write to the record."""
        t0, t1 = self._written, self._now
        if t1 <= t0:
            return
        self._written = t1
        if self._log.tracing or any(drive.rest() > t0 for drive in self._drives):
            self._log.add(self._looked_over(t0, t1))
        else:
            self._log.add(self._instant())
        for drive in self._drives:
            drive.forget(t1)

    def _looked_over(self, t0: float, t1: float) -> Window:
        """Return the extremes of the free motion in [t0, t1], and trace it."""
        ts = self._instants(t0, t1)
        a, b, c = (drive.sample(ts) for drive in self._drives)
        z, tension, slack = self._statics.hang_many(b, c)
        self._log.trace(Trace(ts, a, b, c, tension))
        return Window(
            t0,
            float(z[0]),
            float(tension.max()),
            float(slack.max()),
            float(z.min()),
            float(z.max()),
            (float(a.min()), float(b.min()), float(c.min())),
            (float(a.max()), float(b.max()), float(c.max())),
            outside=_way(b, c, slack),
        )

    def _instants(self, t0: float, t1: float) -> Floats:
        """Return the times at which to evaluate free motion in [t0, t1].

        They come every 50 ms while it lasts, and where its law changes.
        """
        moving = min(t1, max(t0, *(drive.rest() for drive in self._drives)))
        count = ceil((moving - t0) / SAMPLE)
        grid = np.arange(count) * ((moving - t0) / max(1, count)) + t0
        changes = [drive.changes(t0, t1) for drive in self._drives]
        ts = np.concatenate((grid, *changes, (moving, t1)))
        ts.sort()
        return ts


def _first_below(ts: Floats, p: Floats, v: Floats, a: Floats, level: float) -> float | None:
    """Return when a motion first falls below `level`; p, v, a hold from ts[i] to ts[i + 1]."""
    length = np.diff(ts)
    turn = np.clip(np.divide(-v, a, out=np.zeros_like(a), where=a >= FLAT), 0.0, length)
    lowest = np.minimum(np.minimum(p, p + (v + 0.5 * a * length) * length), p + (v + 0.5 * a * turn) * turn)
    below = np.flatnonzero(lowest < level - 1e-6)
    if below.size == 0:
        return None
    i = int(below[0])
    start, end = float(ts[i]), float(ts[i + 1])
    if p[i] <= level:
        return start
    arrival = TimelinePiece(start, float(p[i]), float(v[i]), float(a[i])).arrival(level, rising=False)
    return min(max(arrival, start), end)


def _way(b: Floats, c: Floats, slack: Floats) -> float:
    """Return the way that both lines travelled while one was slack [m]."""
    loose = slack[:-1] > _SLACK
    if not loose.any():
        return 0.0
    return float((np.abs(np.diff(b)) + np.abs(np.diff(c)))[loose].sum())
