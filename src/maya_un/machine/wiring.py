"""The wiring of one machine: which mistakes somebody made between the cabinet and the motors. Default: none.

Axes are named a, b, c, and switches "b forward" or "b reverse" (forward is the long end). Other mistakes are constants
of the machine already: `letters`, `active_high`, `gripper_output`, `gripper_closes_on`, `friction`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from dmc41x3.i18n import phrase

Names = tuple[str, ...]

AXES = "abc"
SIDES = ("reverse", "forward")


@dataclass(frozen=True, slots=True)
class Wiring:
    """The mistakes in the wiring of a machine.

    `encoder_reversed`, `encoder_dead`, `motor_reversed`, `amplifier_off` (no enable signal), `brake_closed` and
    `switches_exchanged` (forward and reverse) name axes. `encoders_exchanged` and `motors_exchanged` name two axes.
    `encoder_factor` is how many times as many counts the encoders of a, b, c give. `switch_open` and `switch_inverted`
    name switches. `stop` is the wiring of the emergency stop to the abort input.
    """

    __pydantic_config__: ClassVar = {"extra": "forbid"}

    encoder_reversed: Names = ()
    encoder_dead: Names = ()
    encoder_factor: tuple[float, float, float] = (1.0, 1.0, 1.0)
    encoders_exchanged: Names = ()
    motor_reversed: Names = ()
    motors_exchanged: Names = ()
    amplifier_off: Names = ()
    brake_closed: Names = ()
    switches_exchanged: Names = ()
    switch_open: Names = ()
    switch_inverted: Names = ()
    stop: Literal["wired", "open", "inverted"] = "wired"

    def __post_init__(self) -> None:
        """Raise `ValueError` for a name of no axis or switch."""
        axes = (
            *(self.encoder_reversed + self.encoder_dead + self.encoders_exchanged),
            *(self.motor_reversed + self.motors_exchanged + self.amplifier_off + self.brake_closed),
            *self.switches_exchanged,
        )
        switches = {f"{axis} {side}" for axis in AXES for side in SIDES}
        if not set(axes) <= set(AXES) or not set(self.switch_open + self.switch_inverted) <= switches:
            raise ValueError(phrase("axes are a, b, c, and switches are like 'b forward'"))

    def encoder_of(self, axis: int) -> int:
        """Return the axis (0 to 2) whose movement the encoder input of `axis` counts."""
        return _exchanged(self.encoders_exchanged, axis)

    def motor_of(self, axis: int) -> int:
        """Return the axis (0 to 2) that the amplifier of `axis` moves."""
        return _exchanged(self.motors_exchanged, axis)

    def servo_faulty(self, axis: int) -> bool:
        """Return whether the loop of motor and encoder of an axis (0 to 2) has a mistake."""
        name = AXES[axis]
        lists = (
            self.encoder_reversed,
            self.encoder_dead,
            self.encoders_exchanged,
            self.motor_reversed,
            self.motors_exchanged,
            self.amplifier_off,
            self.brake_closed,
        )
        return any(name in names for names in lists) or self.encoder_factor[axis] != 1.0

    def closed_apart(self, axis: int) -> bool:
        """Return whether the motor of an axis (0 to 2) is in a loop with a mistake, which its own model closes."""
        return any(self.servo_faulty(one) and self.motor_of(one) == axis for one in range(len(AXES)))

    def abort_active(self, *, pressed: bool) -> bool:
        """Return whether the abort input is active while the emergency stop is pressed, or released."""
        return pressed if self.stop == "wired" else not pressed and self.stop == "inverted"


WIRED = Wiring()
"""A machine without mistakes."""


def _exchanged(pair: Names, axis: int) -> int:
    name = AXES[axis]
    return next((AXES.index(other) for other in pair if other != name), axis) if name in pair else axis
