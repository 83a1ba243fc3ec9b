"""26xx: mistakes in the wiring of a machine, which `maya commission` finds."""

from __future__ import annotations

from dmc41x3.i18n import Phrase
from maya_un.errors.base import MachineError
from maya_un.errors.motion import Side


class StopNotConnected(
    MachineError,
    code=2601,
    en="The abort input did not change when the emergency stop was pressed. The emergency stop does not reach the "
    "controller. Connect it to the abort input; until then, no axis may move.",
):
    """The emergency stop does not reach the abort input."""


class StopInverted(
    MachineError,
    code=2602,
    en="The abort input is active while the emergency stop is released, and inactive while it is pressed. Use the "
    "normally closed contact of the emergency stop; until then, no axis may move.",
):
    """The emergency stop has the wrong contact."""


class StopStuck(
    MachineError,
    code=2603,
    en="The abort input is active, whether the emergency stop is pressed or not. Look for an open circuit at the abort "
    "input.",
):
    """The abort input is always active."""


class SwitchNotConnected(
    MachineError,
    code=2604,
    en="No input changed when the {side} limit switch of axis {axis} was pressed. Check the switch, its cable and its "
    "plug.",
):
    """A limit switch does not reach any limit input."""

    side: str | Side
    axis: str


class SwitchInverted(
    MachineError,
    code=2605,
    en="The {side} limit switch of axis {axis} reads active while it is released, and inactive while it is pressed. "
    "Use its other contact (normally open or normally closed), as at the other switches.",
):
    """One limit switch has the opposite level of the others."""

    side: str | Side
    axis: str


class SwitchLevelsInverted(
    MachineError,
    code=2606,
    en="The level of all limit switches is the opposite of the configured one. Set wiring.limit_active_level to "
    "{level}.",
):
    """The configured level of the limit switches is wrong."""

    level: int


class SwitchesExchanged(
    MachineError,
    code=2607,
    en="The two limit switches of axis {axis} are exchanged. Exchange their cables at the controller.",
):
    """The limit switches of an axis are exchanged."""

    axis: str


class SwitchAtOtherInput(
    MachineError,
    code=2608,
    en="The {side} limit switch of axis {axis} changes inputs that are not its own ({inputs}). Correct its cable.",
):
    """A limit switch is connected to another input."""

    side: str | Side
    axis: str
    inputs: str


class AxesExchanged(
    MachineError,
    code=2609,
    en="The axes {names} are not connected to the configured letters of the controller. Set the letters of a, b, c to "
    "{letters}.",
):
    """The cables of whole axes are exchanged."""

    names: str
    letters: str


class GripperInverted(
    MachineError,
    code=2610,
    en='The gripper opens when it should close. gripper.closed_by must be "{closed_by}".',
):
    """The output of the gripper has the opposite effect."""

    closed_by: str


class GripperAtOtherOutput(
    MachineError,
    code=2611,
    en="Output {configured} does not move the gripper, and output {found} does. gripper.output must be {found}.",
):
    """The gripper is connected to another output."""

    configured: int
    found: int


class GripperSilent(
    MachineError,
    code=2612,
    en="No output moves the gripper. Check its cable, its valve and its supply.",
):
    """The gripper does not move."""


class EncoderReversed(
    MachineError,
    code=2613,
    en="The encoder of axis {axis} counts backwards, so the axis ran away from its target and the controller switched "
    "its motor off. Exchange channels A and B of this encoder (of a differential encoder: A+ and A-).",
):
    """An encoder counts backwards: the feedback is positive."""

    axis: str


class MotorReversed(
    MachineError,
    code=2614,
    en="The motor of axis {axis} turns backwards, so the axis ran away from its target and the controller switched "
    "its motor off. Exchange the two leads of this motor (brushless: set its direction at the amplifier).",
):
    """A motor turns backwards: the feedback is positive."""

    axis: str


class AxisBackwards(
    MachineError,
    code=2615,
    en="Axis {axis} moves backwards, with motor and encoder in agreement. Exchange the leads of the motor, and "
    "channels A and B of the encoder.",
):
    """Motor and encoder of an axis are both reversed."""

    axis: str


class EncoderDead(
    MachineError,
    code=2616,
    en="The encoder of axis {axis} does not count, although the axis moved. Check its supply, cable and plug.",
):
    """An encoder gives no counts."""

    axis: str


class EncodersExchanged(
    MachineError,
    code=2617,
    en="Axis {axis} moved, and the encoder of axis {other} counted. Exchange the encoder cables of these two axes.",
):
    """The encoders of two axes are exchanged."""

    axis: str
    other: str


class MotorsExchanged(
    MachineError,
    code=2618,
    en="The amplifier of axis {axis} moves axis {other}. Exchange the motor cables of these two axes.",
):
    """The motors of two axes are exchanged."""

    axis: str
    other: str


class AmplifierNotEnabled(
    MachineError,
    code=2619,
    en="The amplifier of axis {axis} is not enabled: its motor got no power. Check the enable signal (AEN), its "
    "jumper, and the supply of the amplifier.",
):
    """An amplifier gets no enable signal, or has no supply."""

    axis: str


class BrakeClosed(
    MachineError,
    code=2620,
    en="Axis {axis} does not move with {volts} V of motor command, and its amplifier is enabled. Release its brake, "
    "and look for a jam and for a loose motor cable.",
):
    """A motor pushes and nothing moves."""

    axis: str
    volts: str


class TorqueTooLow(
    MachineError,
    code=2621,
    en="Axis {axis} moves only with more than {allowed} V of motor command, which homing does not allow. Look for a "
    "dragging brake or a tight gear; if there is none, check homing.torque_per_load.",
):
    """The torque limit of homing is too low for the friction of an axis."""

    axis: str
    allowed: str


class EncoderScaleWrong(
    MachineError,
    code=2622,
    en="Axis {axis} moved {measured}, but its encoder counted {counted}. The scale is wrong by a factor of {factor}. "
    "Check resolution and gear of axis {axis}. If they are as intended, {key} must be about {scale} {unit}.",
):
    """The encoder counts per unit of motion differ from the configuration; `key` is that of the scale."""

    axis: str
    measured: Phrase
    counted: Phrase
    factor: str
    key: str | Phrase
    scale: str
    unit: str


class EncoderWithoutMotion(
    MachineError,
    code=2623,
    en="The encoder of axis {axis} counted, but nobody saw a motion. Check the coupling between motor and axis.",
):
    """An encoder counts although its axis does not move."""

    axis: str


class MotionNotCompleted(
    MachineError,
    code=2624,
    en="Axis {axis} moved {measured} of {wanted}, then the controller stopped it ({reason}). Look for an obstacle, and "
    "check the tuning of the axis.",
):
    """A slow move did not reach its end."""

    axis: str
    measured: Phrase
    wanted: Phrase
    reason: Phrase


class AxisUnstable(
    MachineError,
    code=2625,
    en="Axis {axis} moved as soon as its motor was switched on, and the controller switched it off: motor and encoder "
    "count in opposite directions. Exchange the leads of the motor or the channels of the encoder, then test the "
    "direction again.",
):
    """An axis ran away before it was commanded to move: the feedback is positive."""

    axis: str


class PressedSwitchInactive(
    MachineError,
    code=2626,
    en="Axis {axis} presses its {side} limit switch, but the input reads inactive. The switch is not connected, or it "
    "has the opposite contact (normally open or normally closed) of the others. Check its cable and its contact.",
):
    """A limit switch that its axis presses reads inactive. The readings do not show which of the two mistakes it is."""

    side: str | Side
    axis: str
