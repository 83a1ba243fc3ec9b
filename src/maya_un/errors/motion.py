"""2xxx: motion, its limits, and homing. 3xxx: parts and gripper."""

from __future__ import annotations

from typing import Literal

from dmc41x3.i18n import Phrase
from maya_un.errors.base import MachineError, RequestError

Side = Literal["forward", "reverse"]
"""Limit switches of an axis in a sentence."""


class Unreachable(
    RequestError, code=2101, en="{target} cannot be reached: {reason}. The nearest reachable point is: {nearest}."
):
    """A target lies outside the workspace; names the limit, by how much, and the nearest reachable point."""

    target: str
    reason: Phrase
    nearest: Phrase
    limit: str | None = None
    excess: float | None = None
    zone: str | None = None
    nearest_point: tuple[float, ...] | None = None


class PathRefused(
    RequestError,
    code=2102,
    en="The path to {target} leaves the workspace: {reason}. Move to a point in between first.",
):
    """Both ends are reachable but the way between them leaves the workspace."""

    target: str
    reason: Phrase
    at: tuple[float, ...] | None = None
    share: float | None = None


class NotHomed(
    RequestError,
    code=2103,
    en="The robot is not homed, so its position is not known. Run `{command}` first.",
):
    """Motion was requested before homing; on some machines a person must give the datum, with another `command`."""

    command: Literal["maya home", "maya datum"]


class Busy(RequestError, code=2104, en="The robot is busy ({doing}). Wait until it is done, or run `maya stop`."):
    """Another command is running; only one runs at a time."""

    doing: Phrase


class Faulted(
    RequestError,
    code=2105,
    en="The robot cannot move because of a fault: {fault} `maya status` shows the fault.",
):
    """Motion was requested while a fault requires `recover`."""

    fault: Phrase


class MarkerMissing(
    RequestError,
    code=2106,
    en="Maya cannot skip the homing: since the last reset of the controller, no homing has been stored in it. Run "
    "`maya home`.",
):
    """`skip_home` was requested, but the controller stores no homing mark."""


class TrajectoryRefused(
    RequestError, code=2107, en="The trajectory is not valid: {reason}. Correct it and send it again."
):
    """A trajectory is empty, too long, or does not start at the robot's position."""

    reason: Phrase


class NothingToRecover(RequestError, code=2108, en="There is no fault to recover from."):
    """`recover` was requested, but no fault is present."""


class GuardBlocked(
    RequestError,
    code=2109,
    en="Maya cannot add its watchdog program (the guard) to the program in the controller: {reason}. "
    "Shorten or remove that program, then try again.",
):
    """The guard cannot be added to the program in the controller."""

    reason: Phrase


class CannotPause(
    RequestError,
    code=2111,
    en="Maya cannot pause now: {reason}. To stop the robot, run `maya stop`.",
):
    """A pause was requested, but no motion on a path can be held."""

    reason: Phrase


class NotPaused(RequestError, code=2112, en="Nothing is paused. A stopped motion cannot be resumed: start it again."):
    """A resume was requested, but nothing is paused."""


class DatumNeeded(
    RequestError,
    code=2113,
    en="The robot cannot find its position alone: {reason}. Bring it to a known pose with `maya datum move`, then give "
    "the joints of that pose with `maya datum give`.",
):
    """A homing was requested, but the machine lacks what it needs to find its position without a person."""

    reason: Phrase


class DatumRefused(
    RequestError,
    code=2114,
    en="Maya cannot do this with the datum now: {reason}. Run `maya datum` to see the next step.",
):
    """A datum, its confirmation or a guarded move is not possible in this state."""

    reason: Phrase


class DatumContradicted(
    RequestError,
    code=2115,
    en="The second point contradicts the datum: axis {axis} differs by {distance}. The robot is not homed any more. "
    "Measure both points again, then give the datum again.",
):
    """The robot is not where a person says after a motion from the pose that the person gave before."""

    axis: str
    distance: Phrase


class Stopped(
    RequestError, code=2201, en="A stop command ended this motion before its end. Start it again if you still need it."
):
    """A stop ended the command early."""


class Cancelled(RequestError, code=2202, en="This command was cancelled before its end."):
    """The sender cancelled the command."""


class LimitReached(
    MachineError,
    code=2301,
    en="Axis {axis} hit its {side} limit switch. Find the cause, then run `maya recover` and `maya home`.",
):
    """A limit switch ended the motion."""

    axis: str
    side: str | Side


class FollowingError(
    MachineError,
    code=2302,
    en="Axis {axis} could not follow its commanded position, so the controller switched its motor off. Look "
    "for an obstacle or a jammed line, then run `maya recover`.",
):
    """An axis could not follow its reference (off-on-error)."""

    axis: str


class AbortInput(
    MachineError,
    code=2303,
    en="The abort input is active: the emergency stop is pressed, or its circuit is open. Release the "
    "emergency stop or repair the circuit, then run `maya recover`.",
):
    """The abort input is or was active."""


class AmplifierFault(
    MachineError,
    code=2304,
    en="The amplifier reports a fault (status {status}). Check the LEDs of the amplifier and the power "
    "supply, then run `maya recover`.",
):
    """The amplifier reports a fault."""

    status: str


class UnexpectedStop(
    MachineError,
    code=2305,
    en="Axis {axis} stopped, but no command stopped it (stop code {stop_code}: {reason}). Look for an "
    "obstacle, and check the motor, its cable and the power supply. Then run `maya recover`.",
):
    """The motion ended with a stop code that no command caused."""

    axis: str
    stop_code: int
    reason: Phrase


class MotorOff(
    MachineError,
    code=2306,
    en="The motor of axis {axis} is off, but Maya did not switch it off. Look for an obstacle, and check "
    "the motor, its cable and the power supply. Then run `maya recover`.",
):
    """A motor is off though Maya did not switch it off."""

    axis: str


class ControllerReset(
    MachineError,
    code=2307,
    en="The controller was reset, so the position is lost. Run `maya recover`, then `maya home`.",
):
    """The controller was reset; its counts have no meaning until it is homed."""


class EndNotReached(
    MachineError,
    code=2308,
    en="Axis {axis} stopped {distance} away from its target. Look for an obstacle, and check the motor, its "
    "cable and the power supply. Then run `maya recover`.",
):
    """The motion ended at another position than commanded."""

    axis: str | Phrase
    distance: Phrase


class GuardNotRunning(
    MachineError,
    code=2309,
    en="Maya's watchdog program in the controller (the guard) no longer runs, so Maya does not move the "
    "robot. Another program sent HX, ST or AB, or the controller was reset. Run `maya recover`.",
):
    """The guard in the controller does not run; without it no axis moves."""


class HostSilent(
    MachineError,
    code=2310,
    en="Maya's watchdog program in the controller (the guard) stopped the axes, because it received nothing "
    "from this program for too long. Check the load of this computer and the network, then run `maya "
    "recover`.",
):
    """The guard stopped the axes because this program was silent for too long."""


class PositionChanged(
    MachineError,
    code=2311,
    en="Axis {axis} is {distance} away from where Maya left it. Another program moved it or changed its "
    "position (DP), or somebody pushed it. The homing is no longer valid. Close the other program, if "
    "there is one, and let go of the axis. Then run `maya recover` and `maya home`.",
):
    """A position changed without a motion of Maya's, by another program or by hand; the homing is no longer valid."""

    axis: str
    distance: Phrase


class RegisterChanged(
    MachineError,
    code=2312,
    en="Register {register} of the controller is {found}, but Maya expects {wanted}. Another program changed it. "
    "Motion is safe only with {register} = {wanted}. Close that program, then run `maya recover`, which writes "
    "{wanted} back.",
):
    """A register that safety depends on no longer has the value that Maya wrote, or found when it connected."""

    register: str
    found: str
    wanted: str


class ForeignMotion(
    MachineError,
    code=2313,
    en="Axis {axis} moves, but Maya did not start this motion. Maya stops it, and the homing is no longer "
    "valid. Close every other program that commands the controller, and let go of the axis. Then run "
    "`maya recover` and `maya home`.",
):
    """An axis executes a motion that Maya did not start; the homing is no longer valid."""

    axis: str


class PositionNotKept(
    RequestError,
    code=2314,
    en="The stored homing is no longer valid: axis {axis} is {distance} away from where Maya left it. "
    "Another program moved it or changed its position, or somebody pushed it. Run `maya home`.",
):
    """The controller stores the mark of a homing, but the axes are not where Maya left them."""

    axis: str
    distance: Phrase


class SwitchBlocks(
    MachineError,
    code=2315,
    en="Axis {axis} cannot begin to move. Its {side} limit switch is active, although the axis is not at "
    "the end of its stroke. Check the switch and its cable, then run `maya recover`.",
):
    """An active limit switch prevents a motion, although the axis is not at the end of its stroke."""

    axis: str
    side: str | Side


class WiringContradictsCn(
    MachineError,
    code=2401,
    en="The level of the {side} limit switch of axis {axis} is the opposite of the configured one (CN {cn}): "
    "{reason}. Correct the wiring, or `limit_active_level` in the configuration. Then run `maya recover` "
    "and `maya home`.",
):
    """A limit switch has the opposite level of the one that register CN configures."""

    side: str | Side | Literal["forward and reverse"]
    axis: str
    cn: int
    reason: Phrase


class HomingStalled(
    MachineError,
    code=2402,
    en="Axis {axis} did not follow its commanded position during homing ({reason}). Look for an obstacle, "
    "then run `maya recover`.",
):
    """An axis stopped following during homing."""

    axis: str
    reason: Phrase


class SwitchNotFound(
    MachineError,
    code=2403,
    en="Axis {axis} moved {distance} and met no {side} limit switch. Check the switch and its cable. Then "
    "run `maya recover` and `maya home`.",
):
    """Homing moved the whole stroke and met no limit switch."""

    axis: str
    distance: Phrase
    side: str | Side


class StrokeDiffers(
    MachineError,
    code=2404,
    en="The stroke of axis {axis} measures {measured}, but the configuration says {wanted}. Check the line "
    "and the configuration. Then run `maya recover` and `maya home`.",
):
    """The measured stroke of a line differs from the configuration by more than 3 %."""

    axis: str
    measured: Phrase
    wanted: Phrase


class GripperNotEmpty(
    RequestError,
    code=3001,
    en="The gripper is closed, so it cannot pick. Place the part, or open the gripper first.",
):
    """A pick was requested with the gripper closed."""


class GripperEmpty(RequestError, code=3002, en="The gripper is open, so there is nothing to place. Pick a part first."):
    """A place was requested with the gripper open."""
