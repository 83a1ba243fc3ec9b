"""The controller's motion: axes and coordinate systems over time, limits, errors, stops. No text, no wire.

Time advances only in `advance`, `step` and `coast`. Nothing is computed between two events: profiles are closed-form,
and the events are the end of a profile, a new level of a switch, a start or reversal of an axis, and the crossing of a
soft limit. If the following error of an axis could reach ER, it is checked every 10 ms.

Not in the manual: an abort sets the stop code of every axis; when a limit or an error of one member ends a
sequence, that member gets the code of the cause, and the others, which brake along the path at VD, get 4 (stopped); a
sequence that ends without LE leaves code 1; a change of VD while a sequence runs is refused with 7.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, nextafter

from dmc41x3.language.codes import ErrorCode, StopCode
from dmc41x3.twin import registers, timeline
from dmc41x3.twin.expressions import Rejection
from dmc41x3.twin.motion import coordination, independent
from dmc41x3.twin.motion.axis import LETTERS, VIRTUAL, Axis, Encoder, IndependentMotion, MotionKind, ProgramTrigger
from dmc41x3.twin.motion.coordination import Contour, Feed, Pvt, SharedMotion
from dmc41x3.twin.motion.plane import Plane
from dmc41x3.twin.plant import Plant
from dmc41x3.twin.timeline import AxisProfile, Timeline, TimelinePiece

SAMPLE = 1.0 / 1024.0
"""Sample time of the servo at TM 1000 [s]."""

ERROR_LOOK = 0.010
"""Interval between checks of a following error that could reach ER [s]."""

_ON_ERROR, _ON_LIMIT = 1, 2


class MotionCore:
    """Axes, planes S and T, and the plant they drive; `now` is the present time [s].

    `cn` contains the five values of CN; `happened` the triggers of axes since the machine last cleared it;
    `errors_matter` whether following errors are also monitored if OE does not require it. Commands that cannot be
    executed raise `Rejection`.
    """

    def __init__(self, plant: Plant, axes: Sequence[Axis], planes: dict[str, Plane]) -> None:
        self.plant = plant
        self.axes = axes
        self.virtual = {letter: _virtual(place) for place, letter in enumerate(VIRTUAL, start=len(LETTERS) + 2)}
        self.encoders = tuple(Encoder(axis, plant) for axis in axes)
        self.period = int(registers.TM.default)
        self._clock = (0.0, 0.0)
        self.planes = planes
        self.contour = Contour()
        self.pvt = tuple(Pvt(axis.index) for axis in axes)
        feeds = (self.contour, *self.pvt)
        self.courses: dict[str, SharedMotion] = {**planes, **{feed.letter: feed for feed in feeds}}
        self._everyone = {axis.index: axis for axis in (*axes, *self.virtual.values())}
        self.now = 0.0
        self.cn = [-1, -1, -1, 0, 0]
        self.abort_active = False
        self.amplifier_status = 0
        self.happened: list[tuple[ProgramTrigger, Axis]] = []
        self.errors_matter = False
        self._coasted = False

    def advance(self, now: float) -> None:
        """Advance everything to time `now` [s]; an earlier time changes nothing."""
        while self.now < now:
            self.step(now)

    def step(self, now: float) -> None:
        """Advance to the next event, at most to time `now` [s], and handle it."""
        self.refresh()
        if self._coasted:
            self._coasted = False
            self._note()  # store the error at rest before a motion begins
        t = min(now, max(self._own_event(), nextafter(self.now, inf)))
        event = self.plant.next_event(t)
        if event is not None and event < t:
            t = event
        self.plant.advance(t)
        self.now = t
        self._note()
        self.look()

    def coast(self, t: float) -> None:
        """Advance to a time [s] before the next event, without anything to handle."""
        self.plant.advance(t)
        self.now = t
        self._coasted = True

    @property
    def idle(self) -> bool:
        """Whether no axis moves, follows another or waits for its brake: only the plant can have an event."""
        for axis in self._everyone.values():
            if axis.motion is not None or axis.plane or axis.bound or axis.released < inf:
                return False
        return True not in [course.running for course in self.courses.values()]

    def _note(self) -> None:
        for encoder in self.encoders:
            encoder.note(self.now)

    def next_event(self, until: float) -> float | None:
        """Return the time of the next event in (now, until] [s], None if there is none."""
        self.refresh()
        t = self._own_event()
        event = self.plant.next_event(min(t, until))
        t = t if event is None else min(t, event)
        return t if t <= until else None

    def refresh(self) -> None:
        """Apply new plans of sequences whose segments or rates have just changed."""
        for course in self.courses.values():
            if course.running and (course.stale or self.now >= course.horizon):
                coordination.refresh(self._everyone, course, self.now)

    def look(self) -> None:
        """Handle everything that is due now: ends, limits, errors."""
        if self.abort_active and any(axis.moving for axis in self.axes):
            self.abort(StopCode.ABORT_INPUT)
        for axis in self.virtual.values():
            if axis.motion is not None:
                self._look_at_motion(axis, axis.motion)
        for axis in self.axes:
            if axis.motion is not None:
                self._look_at_motion(axis, axis.motion)
            if axis.moving or axis.bound:
                self._look_at_limits(axis)
            if axis.on:
                self._look_at_error(axis)
            elif self.now >= axis.released:
                self._power(axis, False)
        for course in self.courses.values():
            if course.running and self.now >= course.end:
                coordination.finish(self._everyone, course, self.now)

    def position(self, axis: Axis) -> int:
        """Return the encoder position TP [counts]."""
        if axis.virtual:
            return axis.reference(self.now)
        return self.encoders[axis.index].position

    def error(self, axis: Axis) -> int:
        """Return the following error TE = RP - TP [counts]; a stepper, whose position is not controlled, has none."""
        return 0 if axis.stepper else axis.reference(self.now) - self.position(axis)

    def limit_active(self, axis: Axis, forward: bool) -> bool:
        """Return whether a limit switch is active, with the polarity of CN n0."""
        if axis.virtual:
            return False
        level = self.plant.inputs(axis.index)[0 if forward else 1]
        return level == (self.cn[0] == 1)

    def home_state(self, axis: Axis) -> bool:
        """Return the value of the operand `_HM`: the home input with the polarity of the second argument of CN."""
        return self.plant.inputs(axis.index)[2] == (self.cn[1] == -1)

    def stop_code(self, axis: Axis) -> StopCode:
        """Return SC now; a positioning move reports its arrival from its last deceleration on."""
        motion = axis.motion
        if motion is not None and motion.positions and not motion.stopping and self.now >= motion.profile.braking:
            return StopCode.COMMANDED
        return axis.stop_code

    def velocity(self, axis: Axis) -> float:
        """Return the velocity of the encoder as TV reports it [counts/s]."""
        return axis.timeline.at(self.now)[1] if axis.virtual else self.encoders[axis.index].velocity(self.now)

    def torque(self, axis: Axis) -> float:
        """Return the motor command TT [V], limited to TL, or to TK if larger; the time of a peak is not limited."""
        most = max(axis.registers["TL"], axis.registers["TK"])
        offset = axis.registers["OF"] if axis.on else 0.0
        return max(-most, min(most, self.plant.torque(axis.index) + offset))

    def auxiliary(self, axis: Axis) -> int:
        """Return the auxiliary encoder TD [counts], which nothing turns; for a stepper the commanded steps."""
        return axis.reference(self.now) if axis.stepper else axis.auxiliary

    def define_auxiliary(self, axis: Axis, position: int) -> None:
        """Set the position of the auxiliary encoder to `position` (DE); for a stepper that of the main one."""
        if axis.stepper:
            axis.encoder_offset += position - self.position(axis)
        else:
            axis.auxiliary = position

    @property
    def sample(self) -> float:
        """Sample time of the servo [s], as TM sets it."""
        return SAMPLE * self.period / registers.TM.default

    @property
    def samples(self) -> float:
        """Samples since power-up."""
        at, count = self._clock
        return count + (self.now - at) / self.sample

    def set_period(self, period: int) -> None:
        """Set the sample period [µs] (TM)."""
        self._clock = (self.now, self.samples)
        self.period = period

    def restart_clock(self) -> None:
        """Count samples from 0 again, at the default period."""
        self._clock = (self.now, 0.0)
        self.period = int(registers.TM.default)

    def servo(self, axis: Axis, on: bool) -> None:
        """Switch a motor on at its present position (SH), or off (MO); refused while it moves."""
        if axis.moving:
            raise Rejection(ErrorCode.NOT_WHILE_RUNNING)
        if on:
            self._rest_at(axis, self._shaft(axis))
        brake = int(axis.registers["BW"])
        if brake and axis.on and not on:
            axis.on, axis.released = False, self.now + brake * SAMPLE
            self.plant.output(axis.index + 1, False)
        else:
            self._power(axis, on)
        axis.tracking = axis.tracking and on
        self.look()

    def define(self, axis: Axis, position: int) -> None:
        """Set the present position to `position` [controller counts] (DP); refused while the axis moves."""
        if axis.moving:
            raise Rejection(ErrorCode.NOT_WHILE_RUNNING)
        here = self._shaft(axis)
        axis.offset = position - here
        self._rest_at(axis, here)

    def _shaft(self, axis: Axis) -> int:
        """Return the reference with which an axis stays at its place [motor counts]."""
        if axis.stepper or axis.virtual:
            return round(axis.timeline.at(self.now)[0])
        return round(self.plant.position(axis.index))

    def begin(self, axes: Sequence[Axis]) -> None:
        """Begin the motions set up for `axes` (BG): all of them, or none if one of them cannot begin."""
        for axis in axes:
            self._may_begin(axis, axis.direction(self.now, not axis.virtual and self.home_state(axis)))
        for axis in axes:
            self._start(axis)
        self.look()

    def begin_plane(self, plane: Plane) -> None:
        """Begin the sequence of a plane (BG S)."""
        members = [self._everyone[i] for i in plane.members]
        if plane.running or any(axis.moving for axis in members):
            raise Rejection(ErrorCode.BEGIN_WHILE_RUNNING)
        if not plane.segments:
            raise Rejection(ErrorCode.NO_SEQUENCE)
        for place, axis in enumerate(members):
            self._may_begin(axis, plane.heading(place))
        coordination.begin_plane(self._everyone, plane, self.now)
        self.look()

    def begin_feeds(self, feeds: Sequence[Feed]) -> None:
        """Begin a contour (CD), or PVT sequences (BT): all of them, or none if one of them cannot begin."""
        for feed in feeds:
            if feed.running:
                raise Rejection(ErrorCode.BEGIN_WHILE_RUNNING)
            if feed.empty or not feed.members:
                raise Rejection(ErrorCode.NO_SEQUENCE)
            for place, i in enumerate(feed.members):
                self._may_begin(self._everyone[i], feed.heading(place))
        for feed in feeds:
            coordination.begin_feed(self._everyone, feed, self.now)
        self.look()

    def stop(self, axis: Axis) -> None:
        """Decelerate an axis at DC (ST); for an axis of a sequence, stop the sequence."""
        axis.tracking = False
        if axis.bound and not axis.registers["GM"]:
            self.release(axis, axis.registers["DC"], StopCode.STOPPED)
        elif axis.plane:
            coordination.stop(self._everyone, self.courses[axis.plane], self.now)
        elif axis.motion is not None and not axis.motion.stopping:
            self._brake(axis, axis.motion, axis.registers["DC"], StopCode.STOPPED)

    def halt(self, axis: Axis, code: StopCode) -> None:
        """Hold an axis at its place, without deceleration and with its motor on."""
        self._freeze(axis, code)

    def release(self, axis: Axis, rate: float, code: StopCode) -> None:
        """Release an axis that follows another, and decelerate it at `rate` [counts/s²]; idempotent."""
        axis.bound = ""
        if axis.motion is None:
            axis.motion = IndependentMotion(MotionKind.JOG, _nothing(self.now))
        self._brake(axis, axis.motion, rate, code)

    def stop_plane(self, plane: Plane) -> None:
        """Decelerate a sequence at VD along its path (ST S)."""
        coordination.stop(self._everyone, plane, self.now)

    def abort(self, code: StopCode) -> None:
        """Stop everything at once, without deceleration; the motors of axes with OE 1 or 3 are switched off."""
        for course in self.courses.values():
            if course.running:
                course.stopping = True
                course.finish(self.now)
        for axis in (*self.axes, *self.virtual.values()):
            self._freeze(axis, code)
            if axis.on and int(axis.registers.get("OE", 0)) & _ON_ERROR:
                self._power(axis, False)

    def abort_axis(self, axis: Axis, code: StopCode) -> None:
        """Stop one axis at once, and its sequence along the path; with OE 1 or 3 its motor is switched off."""
        if int(axis.registers["OE"]) & _ON_ERROR:
            self.fault(axis, code)
            return
        course = self.courses.get(axis.plane)
        self._freeze(axis, code)
        if course is not None:
            self._leave(course)

    def _freeze(self, axis: Axis, code: StopCode) -> None:
        if axis.heading(self.now) or axis.moving or axis.bound:
            self._rest_at(axis, round(axis.timeline.at(self.now)[0]))
        axis.motion, axis.plane, axis.tracking, axis.bound = None, "", False, ""
        axis.stop_code = code

    def set_abort_input(self, active: bool) -> None:
        """Set the abort input; while it is active nothing moves."""
        self.abort_active = active
        if active:
            self.abort(StopCode.ABORT_INPUT)

    def set_amplifier_status(self, status: int) -> None:
        """Set the amplifiers' fault bits (laid out as in the data record); axes with OE are switched off."""
        if status and not self.amplifier_status:
            self.happened.append((ProgramTrigger.AMPLIFIER, self.axes[0]))
        self.amplifier_status = status
        self.look()

    def settings_changed(self, axis: Axis, register: str) -> None:
        """Act on a register that was changed while the axis may be moving."""
        motion = axis.motion
        if motion is not None and register in ("SP", "AC", "DC", "SD") and motion.kind not in independent.HOMING_KINDS:
            self._replan(axis, motion)
        if register in ("FL", "BL"):
            independent.watch_limits(axis, self.now)
        if register in ("ER", "OE", "LD"):
            self.look()
        if register in ("TL", "TK"):
            self.limit_torque(axis)

    def limit_torque(self, axis: Axis) -> None:
        """Limit the plant's motor to TL, or to TK if that is larger; the time of a peak is not limited."""
        if not axis.virtual:
            self.plant.limit_torque(axis.index, max(axis.registers["TL"], axis.registers["TK"]))

    def jog_at(self, axis: Axis, speed: float) -> None:
        """Change the velocity of a running jog [counts/s, signed]; refused during a move to a position (13)."""
        motion = axis.motion
        if motion is None:
            return
        if motion.kind is not MotionKind.JOG:
            raise Rejection(ErrorCode.JOG_ONLY_IN_JOG_MODE)
        motion.speed = speed
        if not motion.stopping:
            self._replan(axis, motion)
            self.look()

    def shift(self, axis: Axis, distance: int) -> None:
        """Increment the position (IP): lengthen a move, step a jog, or move an idle axis."""
        motion = axis.motion
        if axis.plane or (motion is not None and motion.kind in independent.HOMING_KINDS):
            raise Rejection(ErrorCode.NOT_WHILE_RUNNING)
        if motion is None:
            axis.kind, axis.distance = MotionKind.RELATIVE, distance
            self.begin([axis])
        elif motion.kind is MotionKind.JOG:
            p, v = axis.timeline.at(self.now)
            self._adopt(axis, motion, self._wanted(axis, motion, p + distance, v))
        elif motion.stopping or distance * axis.heading(self.now) < 0:
            raise Rejection(ErrorCode.IP_WRONG_SIGN)
        else:
            motion.target += distance
            self._replan(axis, motion)

    def track(self, axis: Axis, destination: int) -> None:
        """Move to `destination` [controller counts] at once, from any state of motion (PA with PT 1)."""
        if axis.motion is not None:
            axis.motion.target = destination - axis.offset
            axis.motion.stopping = False
            axis.stop_code = StopCode.RUNNING
            self._replan(axis, axis.motion)
            return
        axis.kind, axis.destination = MotionKind.ABSOLUTE, destination
        self.begin([axis])

    def reset(self) -> None:
        """End every motion and set all counters to 0 at the present positions, as power-up does."""
        self.abort(StopCode.COMMANDED)
        for course in self.courses.values():
            course.reset()
        for axis in self.axes:
            self._power(axis, False)
            self.define(axis, 0)
            axis.encoder_offset -= self.position(axis) if axis.stepper else axis.encoder_offset
            axis.commutated = axis.initialised = axis.latch_tripped = False
            axis.kind, axis.distance, axis.destination = MotionKind.RELATIVE, 0, 0
            axis.auxiliary = axis.latched = 0
            axis.latch_armed = False

    def power(self, axis: Axis, on: bool) -> None:
        """Set a motor's power to the burned setting at power-up."""
        self._power(axis, on)

    def _own_event(self) -> float:
        t = min((axis.motion.profile.end for axis in self.virtual.values() if axis.motion is not None), default=inf)
        for axis in self.axes:
            t = min(t, axis.released)
            if not axis.moving:
                continue
            if axis.motion is not None:
                t = min(t, axis.motion.profile.end)
            if axis.soft_limit is not None:
                t = min(t, axis.soft_limit)
            if axis.turns:
                t = min(t, axis.turns[0])
            if (self.errors_matter or int(axis.registers["OE"]) & _ON_ERROR) and independent.near_error_limit(axis):
                t = min(t, self.now + ERROR_LOOK)
        for course in self.courses.values():
            if course.running:
                t = min(t, course.end, course.horizon)
        return t

    def _look_at_motion(self, axis: Axis, motion: IndependentMotion) -> None:
        if self.now >= motion.profile.end:
            self._finish(axis, motion)
        elif motion.kind in independent.HOMING_KINDS and not motion.stopping:
            level = self.plant.inputs(axis.index)[2]
            if level != motion.level and (onward := independent.pass_home_edge(axis, motion, self.now)) is not None:
                self._adopt(axis, motion, onward)

    def _look_at_limits(self, axis: Axis) -> None:
        while axis.turns and axis.turns[0] <= self.now:
            del axis.turns[0]
        if axis.stop_code in independent.LIMIT_CODES:
            axis.soft_limit = None
            return
        heading = axis.heading(self.now)
        code = StopCode.FORWARD_LIMIT if heading > 0 else StopCode.REVERSE_LIMIT
        if axis.soft_limit is not None and self.now >= axis.soft_limit:
            axis.soft_limit = None
            self._limit_stop(axis, code)
        elif axis.bound and heading and independent.beyond_limit(axis, heading, self.now):
            self._limit_stop(axis, code)
        elif heading and independent.limit_enabled(axis, heading) and self.limit_active(axis, heading > 0):
            self._limit_stop(axis, code)
            if int(axis.registers["OE"]) & _ON_LIMIT:
                self.fault(axis, code)

    def _look_at_error(self, axis: Axis) -> None:
        oe = int(axis.registers["OE"])
        if oe and self.amplifier_status:
            self.fault(axis, StopCode.AMPLIFIER_FAULT)
            return
        if axis.stepper:
            return
        error = abs(axis.timeline.at(self.now)[0] - self.plant.position(axis.index))
        beyond = 0 <= axis.registers["ER"] < error
        if beyond and not axis.erring:
            self.happened.append((ProgramTrigger.POSITION_ERROR, axis))
        axis.erring = beyond
        if beyond and oe & _ON_ERROR:
            self.fault(axis, StopCode.OFF_ON_ERROR)
        elif axis.moving and not beyond and (oe & _ON_ERROR or self.errors_matter):
            independent.learn_error(axis, error, axis.timeline.at(self.now)[1], self.plant.velocity(axis.index))

    def _limit_stop(self, axis: Axis, code: StopCode) -> None:
        """Stop at a limit: a single axis at SD, a sequence along its path at VD, a contour with all its axes."""
        self.happened.append((ProgramTrigger.LIMIT, axis))
        if axis.bound:
            axis.stop_code = code
            if not axis.registers["GM"]:
                self.release(axis, axis.registers["SD"], code)
        elif axis.plane:
            coordination.stop(self._everyone, self.courses[axis.plane], self.now)
            axis.stop_code = code
        if axis.motion is not None and not axis.bound:
            self._brake(axis, axis.motion, axis.registers["SD"], code)

    def fault(self, axis: Axis, code: StopCode) -> None:
        """Switch a motor off at its place; the other axes of its sequence stop along the path."""
        course = self.courses.get(axis.plane)
        self._freeze(axis, code)
        self._power(axis, False)
        if course is not None:
            self._leave(course)

    def _leave(self, course: SharedMotion) -> None:
        """Stop a sequence along its path after an axis has left it, a contour with all its axes."""
        coordination.stop(self._everyone, course, self.now)
        if course.running and coordination.abandoned(self._everyone, course):
            coordination.finish(self._everyone, course, self.now)

    def _power(self, axis: Axis, on: bool) -> None:
        """Switch an amplifier and, at the same time, the brake if the axis has one."""
        axis.on, axis.released = on, inf
        axis.erring = axis.erring and on
        self.plant.power(axis.index, on)
        if axis.registers["BW"]:
            self.plant.output(axis.index + 1, on)

    def _rest_at(self, axis: Axis, p: int) -> None:
        axis.timeline.plan(self.now, (TimelinePiece(self.now, p, 0.0, 0.0),))
        if not axis.virtual:
            self.encoders[axis.index].note(self.now)
        axis.last_stop = p + axis.offset
        axis.turns, axis.soft_limit = [], None

    def _may_begin(self, axis: Axis, direction: int) -> None:
        if axis.bound == "cam":
            raise Rejection(ErrorCode.NOT_IN_CAM)
        if axis.plane == self.contour.letter:
            raise Rejection(ErrorCode.NOT_WHILE_CONTOURING)
        if axis.moving:
            raise Rejection(ErrorCode.BEGIN_WHILE_RUNNING)
        if not axis.on:
            raise Rejection(ErrorCode.BEGIN_MOTOR_OFF)
        if not direction:
            return
        beyond = independent.beyond_limit(axis, direction, self.now)
        if beyond or (independent.limit_enabled(axis, direction) and self.limit_active(axis, direction > 0)):
            raise Rejection(ErrorCode.BEGIN_AT_LIMIT)

    def _start(self, axis: Axis) -> None:
        t, (p, _) = self.now, axis.timeline.at(self.now)
        if axis.kind in independent.HOMING_KINDS:
            level = self.plant.inputs(axis.index)[2]
            motion = independent.begin_homing(
                axis, t, axis.direction(self.now, not axis.virtual and self.home_state(axis)) or 1, level
            )
        elif axis.kind is MotionKind.JOG:
            motion = IndependentMotion(MotionKind.JOG, _nothing(t), speed=axis.jog_speed)
            motion.profile = self._wanted(axis, motion, p, 0.0)
        else:
            absolute = axis.kind is MotionKind.ABSOLUTE
            target = axis.destination - axis.offset if absolute else round(p) + axis.distance
            motion = IndependentMotion(axis.kind, _nothing(t), target=target)
            motion.profile = self._wanted(axis, motion, p, 0.0)
        axis.motion = motion
        axis.stop_code = StopCode.RUNNING
        self._adopt(axis, motion, motion.profile)

    def _wanted(self, axis: Axis, motion: IndependentMotion, p: float, v: float) -> AxisProfile:
        """Return the profile of a jog, or of a move to a position, from a state."""
        if motion.kind is MotionKind.JOG:
            return independent.jog(axis, self.now, p, v, motion.speed, self.sample)
        return independent.move(axis, self.now, p, v, motion.target, self.sample)

    def _replan(self, axis: Axis, motion: IndependentMotion) -> None:
        p, v = axis.timeline.at(self.now)
        if motion.stopping:
            rate = "SD" if motion.result in independent.LIMIT_CODES else "DC"
            way = independent.stop(axis, self.now, p, v, axis.registers[rate], self.sample)
        else:
            way = self._wanted(axis, motion, p, v)
        self._adopt(axis, motion, way)

    def _brake(self, axis: Axis, motion: IndependentMotion, rate: float, code: StopCode) -> None:
        p, v = axis.timeline.at(self.now)
        motion.stopping, motion.result = True, code
        axis.stop_code = code
        self._adopt(axis, motion, independent.stop(axis, self.now, p, v, rate, self.sample))

    def _adopt(self, axis: Axis, motion: IndependentMotion, way: AxisProfile) -> None:
        motion.profile = way
        axis.timeline.plan(self.now, way.pieces)
        axis.peak = way.peak
        axis.turns = [turn for turn in timeline.turning_times(way.pieces) if turn > self.now]
        independent.watch_limits(axis, self.now)

    def _finish(self, axis: Axis, motion: IndependentMotion) -> None:
        if motion.kind in independent.HOMING_KINDS:
            onward = independent.continue_homing(axis, motion, self.now, self.plant.inputs(axis.index)[2])
            if onward is not None:
                self._adopt(axis, motion, onward)
                return
        axis.motion = None
        axis.stop_code = motion.result
        axis.last_stop = axis.reference(self.now)
        if motion.result is StopCode.HOMED:
            axis.offset = -round(axis.timeline.at(self.now)[0])
            axis.last_stop = 0


def _nothing(t: float) -> AxisProfile:
    return AxisProfile([], t, t, 0.0)


def _virtual(index: int) -> Axis:
    return Axis(index, Timeline(), registers.defaults(registers.VIRTUAL), on=True)
