"""Judge readings and answers: which mistake in the wiring explains them. Pure: no input or output.

Axes are 0 (a), 1 (b), 2 (c). A motion is judged by two independent witnesses: the encoders, and the person.

| encoder of the axis | person saw | mistake |
|---|---|---|
| counted forward | forward | none |
| counted backward | forward | the encoder is reversed |
| counted backward | backward | the motor is reversed |
| counted forward | backward | both are reversed |
| nothing, another one counted | the axis | the encoders are exchanged |
| nothing | the axis | the encoder is dead |
| nothing | another axis | the motors are exchanged |
| counted | another axis | the whole axes are exchanged |
| counted | nothing | the coupling slips |
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

from maya_un.axes import AXES
from maya_un.errors import (
    AxesExchanged,
    AxisBackwards,
    EncoderDead,
    EncoderReversed,
    EncodersExchanged,
    EncoderWithoutMotion,
    MachineError,
    MotorReversed,
    MotorsExchanged,
    PressedSwitchInactive,
    StopInverted,
    StopNotConnected,
    StopStuck,
    SwitchAtOtherInput,
    SwitchesExchanged,
    SwitchInverted,
    SwitchLevelsInverted,
    SwitchNotConnected,
)

Side = Literal["reverse", "forward"]
SIDES: tuple[Side, Side] = ("reverse", "forward")

Switch = tuple[int, Side]
"""A limit switch: its axis (0 to 2) and side."""

Readings = Mapping[Switch, bool]
"""Which limit inputs read active."""

SWITCHES: tuple[Switch, ...] = tuple((axis, side) for axis in range(3) for side in SIDES)


class Press(NamedTuple):
    """The readings before and while a switch was pressed; `already` if the axis itself pressed it all the time."""

    before: Readings
    pressed: Readings
    already: bool = False

    @property
    def changed(self) -> tuple[Switch, ...]:
        """The inputs that changed."""
        return tuple(switch for switch in SWITCHES if self.before[switch] != self.pressed[switch])


class SwitchVerdict(NamedTuple):
    """The mistakes of all limit switches; `letters` (by axis) and `level` are corrections of the configuration."""

    errors: tuple[MachineError, ...]
    letters: str | None = None
    level: int | None = None
    axes: frozenset[int] = frozenset()


def stop(before: bool, pressed: bool) -> MachineError | None:
    """Return the mistake of the emergency stop; the values are whether the abort input was active."""
    if not before:
        return None if pressed else StopNotConnected()
    return StopStuck() if pressed else StopInverted()


def switches(presses: Mapping[Switch, Press], letters: str, level: int) -> SwitchVerdict:
    """Return the mistakes of the switches that were pressed; `letters` and `level` are the configured ones.

    `axes` of the verdict are those that must not move before a correction of the wiring.
    """
    places = _places(presses)
    if places is not None:
        exchanged = [axis for axis in range(3) if places[axis] != axis]
        found = "".join(letters[places[axis]] for axis in range(3))
        rest = switches({switch: _moved(press, places) for switch, press in presses.items()}, found, level)
        error = AxesExchanged(names=" ".join(AXES[axis] for axis in exchanged), letters=found)
        return rest._replace(errors=(error, *rest.errors), letters=found)
    inverted = [switch for switch, press in presses.items() if _inverted(switch, press)]
    if len(inverted) == len(presses) > 1:
        return SwitchVerdict((SwitchLevelsInverted(level=-level),), level=-level)
    errors: list[MachineError] = []
    axes: set[int] = set()
    for axis in range(3):
        found = _of_axis(axis, {side: presses[axis, side] for side in SIDES if (axis, side) in presses})
        errors += found
        axes |= {axis} if found else set()
    return SwitchVerdict(tuple(errors), axes=frozenset(axes))


def _inverted(switch: Switch, press: Press) -> bool:
    return not press.pressed[switch] and (press.already or (press.before[switch] and press.changed == (switch,)))


def _of_axis(axis: int, presses: Mapping[Side, Press]) -> list[MachineError]:
    other: dict[Side, Side] = {"reverse": "forward", "forward": "reverse"}
    answered: dict[Side, tuple[Switch, ...]] = {side: _answered(axis, side, press) for side, press in presses.items()}
    if answered and all(answered[side] == ((axis, other[side]),) for side in answered):
        return [SwitchesExchanged(axis=AXES[axis])]
    found: list[MachineError] = []
    for side, press in presses.items():
        if not answered[side]:
            found.append(SwitchNotConnected(side=side, axis=AXES[axis]))
        elif answered[side] != ((axis, side),):
            inputs = ", ".join(f"{AXES[one]} {at}" for one, at in answered[side])
            found.append(SwitchAtOtherInput(side=side, axis=AXES[axis], inputs=inputs))
        elif press.already and not press.pressed[axis, side]:
            found.append(PressedSwitchInactive(side=side, axis=AXES[axis]))
        elif _inverted((axis, side), press):
            found.append(SwitchInverted(side=side, axis=AXES[axis]))
    return found


def _answered(axis: int, side: Side, press: Press) -> tuple[Switch, ...]:
    """Return the inputs that answered a press. A switch that its axis presses is judged by its present reading."""
    if not press.already:
        return press.changed
    here: Switch = (axis, side)
    other: Switch = (axis, SIDES[side == "reverse"])
    return (other,) if press.pressed[other] and not press.pressed[here] else (here,)


def _moved(press: Press, places: Sequence[int]) -> Press:
    """Return a press as it reads with other letters."""

    def read(readings: Readings) -> Readings:
        return {(axis, side): readings[places[axis], side] for axis, side in SWITCHES}

    return Press(read(press.before), read(press.pressed), press.already)


def _places(presses: Mapping[Switch, Press]) -> tuple[int, int, int] | None:
    """Return the axes at whose inputs the switches of a, b, c are, if whole axes are exchanged, else None."""
    places = [0, 1, 2]
    for axis in range(3):
        own = [press for (one, _), press in presses.items() if one == axis and not press.already]
        at = {one for press in own for one, _ in press.changed}
        if len(own) == 0 or len(at) != 1 or any(len(press.changed) != 1 for press in own):
            continue
        places[axis] = at.pop()
    if places == [0, 1, 2] or sorted(places) != [0, 1, 2]:
        return None
    return places[0], places[1], places[2]


@dataclass(frozen=True, slots=True)
class Seen:
    """The motion that a person saw: its `axis` and `sign`; None for nothing."""

    axis: int
    sign: int


@dataclass(frozen=True, slots=True)
class Trial:
    """A short motion: commanded `axis` and `sign`, what the encoders counted [shares of the commanded way].

    `tripped` is whether the controller switched the motor off.
    """

    axis: int
    sign: int
    counted: tuple[float, float, float]
    tripped: bool


COUNTS = 0.05
"""An encoder counted if it moved by more than this share of the commanded way."""


def direction(trial: Trial, seen: Seen | None, letters: str = "ABC") -> MachineError | None:
    """Return the mistake that explains a short motion, None without one; see the table above.

    `letters` are the configured ones of a, b, c.

    If nothing moved and nothing was counted, the cause is the torque, the amplifier or the brake: see `steps`.
    """
    axis, name = trial.axis, AXES[trial.axis]
    own = trial.counted[axis]
    counted = abs(own) > COUNTS
    others = [one for one in range(3) if one != axis and abs(trial.counted[one]) > COUNTS]
    if seen is None:
        return EncoderWithoutMotion(axis=name) if counted else None
    if seen.axis != axis:
        if counted:
            order = list(letters)
            order[axis], order[seen.axis] = order[seen.axis], order[axis]
            names = " ".join(sorted((name, AXES[seen.axis])))
            return AxesExchanged(names=names, letters="".join(order))
        return MotorsExchanged(axis=name, other=AXES[seen.axis])
    if not counted:
        return EncodersExchanged(axis=name, other=AXES[others[0]]) if others else EncoderDead(axis=name)
    agrees = (own > 0.0) == (trial.sign > 0)
    if seen.sign == trial.sign:
        return None if agrees else EncoderReversed(axis=name)
    return AxisBackwards(axis=name) if agrees else MotorReversed(axis=name)


def nothing_moved(trial: Trial, seen: Seen | None) -> bool:
    """Return whether neither the encoder nor the person noticed a motion."""
    return seen is None and abs(trial.counted[trial.axis]) <= COUNTS


def scale_factor(counted: float, measured: float, tolerance: float) -> float | None:
    """Return how many times too many counts an encoder gives, None if it is right within `tolerance` (a share).

    `counted` is the way by the encoder, `measured` the way that the person measured [rad or m].
    """
    if measured <= 0.0:
        return None
    factor = counted / measured
    return None if 1.0 / (1.0 + tolerance) <= factor <= 1.0 + tolerance else factor
