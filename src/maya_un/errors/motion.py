"""2xxx: motion, its limits, and homing."""

from __future__ import annotations

from maya_un.errors.base import MachineError, RequestError


class Unreachable(RequestError):
    """A target lies outside the workspace; names the limit, by how much, and the nearest reachable point."""

    code = 2101


class PathRefused(RequestError):
    """Both ends are reachable but the way between leaves the workspace."""

    code = 2102


class NotHomed(RequestError):
    """Motion was asked for before homing."""

    code = 2103


class Busy(RequestError):
    """Another command is running; only one runs at a time."""

    code = 2104


class Faulted(RequestError):
    """Motion was asked for while a fault waits for `recover`."""

    code = 2105


class MarkerMissing(RequestError):
    """`skip_home` was asked for, but the controller holds no homing marker."""

    code = 2106


class TrajectoryRefused(RequestError):
    """A trajectory is empty, too long, or does not start where the robot is."""

    code = 2107


class NothingToRecover(RequestError):
    """`recover` was asked for, but there is no fault."""

    code = 2108


class GuardBlocked(RequestError):
    """The guard cannot be put beside the program that the controller holds."""

    code = 2109


class CannotPause(RequestError):
    """A pause was asked for where there is no motion on a path that could be held."""

    code = 2111


class NotPaused(RequestError):
    """Going on was asked for, but nothing is paused."""

    code = 2112


class Stopped(RequestError):
    """A stop ended the command early."""

    code = 2201


class Cancelled(RequestError):
    """The sender cancelled the command."""

    code = 2202


class LimitReached(MachineError):
    """A limit switch ended the motion."""

    code = 2301


class FollowingError(MachineError):
    """An axis could not follow its reference (off-on-error)."""

    code = 2302


class AbortInput(MachineError):
    """The abort input is or was active."""

    code = 2303


class AmplifierFault(MachineError):
    """The amplifier reports a fault."""

    code = 2304


class UnexpectedStop(MachineError):
    """The motion ended with a stop code nobody asked for."""

    code = 2305


class MotorOff(MachineError):
    """A motor is off though nobody switched it off."""

    code = 2306


class ControllerReset(MachineError):
    """The controller was reset; its counts mean nothing until it is homed."""

    code = 2307


class EndNotReached(MachineError):
    """The motion ended somewhere else than commanded."""

    code = 2308


class GuardNotRunning(MachineError):
    """The guard in the controller does not run; without it nothing moves."""

    code = 2309


class HostSilent(MachineError):
    """The guard stopped the axes because this program had not been heard for too long."""

    code = 2310


class PositionChanged(MachineError):
    """A position changed without a motion of Maya's, by another program or by hand; the homing is no longer valid."""

    code = 2311


class RegisterChanged(MachineError):
    """A register that safety depends on no longer has the value that Maya wrote, or found when it connected."""

    code = 2312


class ForeignMotion(MachineError):
    """An axis carries out a motion that Maya did not start; the homing is no longer valid."""

    code = 2313


class PositionNotKept(RequestError):
    """The controller holds the mark of a homing, but the axes are not where Maya left them."""

    code = 2314


class SwitchBlocks(MachineError):
    """An active limit switch prevents a motion, although the axis is not at the end of its stroke."""

    code = 2315


class WiringContradictsCn(MachineError):
    """A limit switch reads the opposite of what register CN says it should."""

    code = 2401


class HomingStalled(MachineError):
    """An axis stopped following during homing."""

    code = 2402


class SwitchNotFound(MachineError):
    """Homing went the whole stroke and met no limit switch."""

    code = 2403


class StrokeDiffers(MachineError):
    """The measured stroke of a line differs from the configuration by more than 3 %."""

    code = 2404
