"""What a machine needs of whatever its motors drive, and a bench without mechanics for tests of the machine."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from dmc41x3.twin.sensing import Sensing
from dmc41x3.twin.timeline import Timeline

TORQUE_LIMIT = 9.9982
"""The largest motor command [V] a DMC-41x3 can give (TL 9.9982)."""

CONTACT_STEP = 0.002
"""While an axis is blocked, the machine looks this often [s]."""


class Plant(Protocol):
    """The physical side of the motors. Positions are motor counts since power-up; time only goes forward.

    The machine plans the `timelines`; the plant follows them. What is read (`position`, `inputs`, ...) is of
    the time last advanced to.
    """

    @property
    def timelines(self) -> Sequence[Timeline]:
        """The reference of every axis, planned by the machine."""
        ...

    def advance(self, t: float) -> None:
        """Bring the physical state, and its own record, to time `t` [s]."""
        ...

    def next_event(self, until: float) -> float | None:
        """Return the earliest time in (now, until] at which the machine must look, None where there is none.

        A switch changes its level, or an axis meets an obstacle; while one is blocked, every 2 ms.
        """
        ...

    def position(self, axis: int) -> float:
        """Return the actual position [counts], not rounded."""
        ...

    def velocity(self, axis: int) -> float:
        """Return the actual velocity [counts/s]."""
        ...

    def torque(self, axis: int) -> float:
        """Return the motor command [V], within ±9.9982, signed as the push; 0 with the motor off."""
        ...

    def inputs(self, axis: int) -> tuple[bool, bool, bool]:
        """Return the electrical level (true = high) of forward limit, reverse limit and home input."""
        ...

    def power(self, axis: int, on: bool) -> None:
        """Switch a motor on or off at the time last advanced to."""
        ...

    def limit_torque(self, axis: int, volts: float) -> None:
        """Let a motor get no more than `volts` [V] from now on (TL, TK); a weak motor may not follow its reference."""
        ...

    def output(self, bit: int, on: bool) -> None:
        """Set digital output `bit` (from 1) at the time last advanced to."""
        ...

    def fail_encoder(self, axis: int, on: bool) -> None:
        """Let an encoder count no more, while its axis goes on; or let it count on from where it stopped."""
        ...

    def force_inputs(self, axis: int, **levels: bool | None) -> None:
        """Hold the inputs `forward`, `reverse`, `home` of an axis at an electrical level, or let them go (None).

        Those not named stay as they are. Like `fail_encoder` it announces no event: let the machine look.
        """
        ...


class BenchPlant:
    """Ideal axes on a bench: the position is the reference, the inputs idle high.

    A test may set the level of an input and hold a shaft fast; the machine sees it when it looks next.
    """

    def __init__(self, axes: int = 3) -> None:
        self.timelines: Sequence[Timeline] = tuple(Timeline() for _ in range(axes))
        self.outputs: dict[int, bool] = {}
        self.powered = [False] * axes
        self._levels = [(True, True, True)] * axes
        self._held: dict[int, float] = {}
        self._sensing = Sensing()
        self._now = 0.0

    def advance(self, t: float) -> None:
        """Bring the bench to time `t` [s]."""
        self._now = max(self._now, t)

    def next_event(self, until: float) -> float | None:
        """Return the next look of 2 ms while a shaft is held, else None."""
        if not self._held or until <= self._now:
            return None
        return min(until, self._now + CONTACT_STEP)

    def position(self, axis: int) -> float:
        """Return the reference, or where the shaft is held [counts]."""
        held = self._held.get(axis)
        return self._sensing.position(axis, self.timelines[axis].at(self._now)[0] if held is None else held)

    def velocity(self, axis: int) -> float:
        """Return the velocity of the reference [counts/s], 0 while held."""
        return 0.0 if axis in self._held else self._sensing.velocity(axis, self.timelines[axis].at(self._now)[1])

    def torque(self, axis: int) -> float:
        """Return 0, or the full command [V] toward the reference where the shaft, held or not seen, is off it."""
        if not self.powered[axis] or not (axis in self._held or self._sensing.lost(axis)):
            return 0.0
        error = self.timelines[axis].at(self._now)[0] - self.position(axis)
        return TORQUE_LIMIT * ((error > 0.0) - (error < 0.0))

    def inputs(self, axis: int) -> tuple[bool, bool, bool]:
        """Return the levels as set, high at first."""
        return self._sensing.inputs(axis, self._levels[axis])

    def power(self, axis: int, on: bool) -> None:
        """Note whether the motor is on."""
        self.powered[axis] = on
        if on:
            self._sensing.resume(axis)

    def limit_torque(self, axis: int, volts: float) -> None:
        """Change nothing: ideal axes need no torque."""

    def output(self, bit: int, on: bool) -> None:
        """Note the level of a digital output."""
        self.outputs[bit] = on

    def set_inputs(self, axis: int, *, forward: bool = True, reverse: bool = True, home: bool = True) -> None:
        """Set the electrical level of the three inputs of an axis."""
        self._levels[axis] = (forward, reverse, home)

    def fail_encoder(self, axis: int, on: bool) -> None:
        """Let an encoder count no more, or count on from where it stopped."""
        self._sensing.fail_encoder(axis, self.timelines[axis].at(self._now)[0], on)

    def force_inputs(self, axis: int, **levels: bool | None) -> None:
        """Hold inputs at a level whatever is set, or let them go (None)."""
        self._sensing.force_inputs(axis, levels)

    def hold(self, axis: int) -> None:
        """Hold the shaft of an axis fast where it is."""
        self._held[axis] = self.position(axis)

    def release(self, axis: int) -> None:
        """Let a held shaft go: it is at its reference again."""
        self._held.pop(axis, None)
