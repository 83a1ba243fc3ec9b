"""Every error of the house, its stable code, and the branch that decides whether the robot stops.

MayaError
├── RequestError            somebody asked for something impossible: refused, the robot is not disturbed
│   ├── NotConnected 1010 · ServiceNotRunning 1020 · ServiceNotAnswering 1021
│   │   TwinNotFound 1022
│   ├── Unreachable 2101 · PathRefused 2102 · NotHomed 2103 · Busy 2104 · Faulted 2105
│   │   MarkerMissing 2106 · TrajectoryRefused 2107 · NothingToRecover 2108 · GuardBlocked 2109
│   │   ProgramRuns 2110 · CannotPause 2111 · NotPaused 2112
│   ├── Stopped 2201 · Cancelled 2202
│   ├── GripperNotEmpty 3001 · GripperEmpty 3002
│   ├── InvalidValue 4001 · InvalidJob 4002 · UnknownName 4003 · NotFound 4004 · InvalidRequest 4005
│   │   SpeedOnRealMachine 4006 · FileUnreadable 4007 · InvalidCommandLine 4008
│   │   NotIdentifiable 4009 · NotTaught 4010 · NameTaken 4011 · KeyReused 4012
│   │   EventsForgotten 4013 · WrongState 4014 · AnswerNeeded 4015 · StreamLagging 4016
│   │   DependencyFailed 4017 · InvalidMessage 4018 · UnknownInterface 4019 · ServiceFailed 4020
│   │   NotOverRos 4021
│   ├── NotSignedIn 4101 · NotAllowed 4102 · LeaseHeld 4103 · LeaseNeeded 4104 · LeaseLost 4105
│   │   TooManyRequests 4106
│   └── InvalidConfig 5001 · FileUnwritable 5002 · AddressInUse 5003 · AlreadyRunning 5004
│       FileNotOurs 5005 · NothingToRevert 5006 · StorageFailed 5007 · StorageDamaged 5008
│       StorageTooNew 5009 · StorageInUse 5010 · MasterGone 5011 · RosMissing 5012
└── MachineError            the machine did something unexpected: motion ends, a person recovers
    ├── LinkLost 1001 · ConnectFailed 1002 · LinkTimeout 1003 · CommandRejected 1004
    │   WrongController 1005 · UnexpectedReply 1006 · ParameterMismatch 1007
    │   ProgramDiffers 1008 · MemoryDamaged 1009 · NodeGone 1011
    ├── LimitReached 2301 · FollowingError 2302 · AbortInput 2303 · AmplifierFault 2304
    │   UnexpectedStop 2305 · MotorOff 2306 · ControllerReset 2307 · EndNotReached 2308
    │   GuardNotRunning 2309 · HostSilent 2310
    ├── WiringContradictsCn 2401 · HomingStalled 2402 · SwitchNotFound 2403 · StrokeDiffers 2404
    └── InternalError 5999

1xxx link · 2xxx motion · 3xxx work-piece · 4xxx request · 5xxx house. The words belong to the code and
stand in `maya_un.messages`, one module a language; every edge shows the same code and words.
"""

from __future__ import annotations

from typing import ClassVar

from maya_un import messages


class MayaError(Exception):
    """Base of all errors.

    Parameters are the details that the sentence of this code names; they are kept in `details`
    and stay machine-readable at every edge.
    """

    code: ClassVar[int] = 0

    def __init__(self, **details: object) -> None:
        if type(self).code == 0:
            raise TypeError(f"{type(self).__name__} is a branch of the tree, raise one of its leaves")
        self.details = details
        self.said = False
        super().__init__(messages.sentence(type(self).code, details))

    def text(self, language: str = "en") -> str:
        """Return the sentence (what, why, what next) in `language` ("en" or "es").

        Of an error that came in words only (`as_said`) they are those words.
        """
        return str(self) if self.said else messages.sentence(type(self).code, self.details, language)


class RequestError(MayaError):
    """Somebody asked for something impossible. The robot is not disturbed."""


class MachineError(MayaError):
    """The machine or the link did something unexpected. Motion ends; a person recovers."""


class LinkLost(MachineError):
    """The connection to the controller ended by itself."""

    code = 1001


class ConnectFailed(MachineError):
    """Nobody answers at the controller's address."""

    code = 1002


class LinkTimeout(MachineError):
    """The controller accepted the connection but does not answer in time."""

    code = 1003


class CommandRejected(MachineError):
    """The controller answered `?` to a command of ours; carries the TC code."""

    code = 1004


class WrongController(MachineError):
    """The device at the address is not a DMC-41x3 with three axes."""

    code = 1005


class UnexpectedReply(MachineError):
    """A reply could not be understood."""

    code = 1006


class ParameterMismatch(MachineError):
    """The controller did not keep a parameter as configured."""

    code = 1007


class ProgramDiffers(MachineError):
    """The controller holds another program than the one just downloaded."""

    code = 1008


class MemoryDamaged(MachineError):
    """The controller's EEPROM failed a checksum when it last powered up."""

    code = 1009


class NotConnected(RequestError):
    """A wish came while there is no link to the controller."""

    code = 1010


class NodeGone(MachineError):
    """The node that did this ended by itself, or is not there."""

    code = 1011


class ServiceNotRunning(RequestError):
    """No running `maya up` was found."""

    code = 1020


class ServiceNotAnswering(RequestError):
    """`maya up` runs but does not answer."""

    code = 1021


class TwinNotFound(RequestError):
    """No running `maya dmc serve` is meant, or more than one."""

    code = 1022


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
    """One wish at a time: another is under way."""

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


class ProgramRuns(RequestError):
    """A download was asked for while the controller runs a program."""

    code = 2110


class CannotPause(RequestError):
    """A pause was asked for where there is no motion on a path that could be held."""

    code = 2111


class NotPaused(RequestError):
    """Going on was asked for, but nothing is paused."""

    code = 2112


class Stopped(RequestError):
    """The wish ended early because somebody said stop."""

    code = 2201


class Cancelled(RequestError):
    """The wish was cancelled by the one who made it."""

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


class GripperNotEmpty(RequestError):
    """A pick was asked for with the gripper closed."""

    code = 3001


class GripperEmpty(RequestError):
    """A place was asked for with the gripper open."""

    code = 3002


class InvalidValue(RequestError):
    """A value is of the wrong kind or out of range."""

    code = 4001


class InvalidJob(RequestError):
    """A job file names a wrong key, step or value."""

    code = 4002


class UnknownName(RequestError):
    """A name is not known; lists the names that are."""

    code = 4003


class NotFound(RequestError):
    """No task or job has this number."""

    code = 4004


class InvalidRequest(RequestError):
    """A request body could not be understood."""

    code = 4005


class SpeedOnRealMachine(RequestError):
    """`--speed` scales the twin's time; a real machine has no such thing."""

    code = 4006


class FileUnreadable(RequestError):
    """A file cannot be read or parsed."""

    code = 4007


class InvalidCommandLine(RequestError):
    """The command line could not be understood."""

    code = 4008


class NotIdentifiable(RequestError):
    """Measured points cannot tell constants of the machine apart; names them and what to measure next."""

    code = 4009


class NotTaught(RequestError):
    """No pose or pallet has been taught under this name; lists those that have."""

    code = 4010


class NameTaken(RequestError):
    """Something is taught under this name already."""

    code = 4011


class KeyReused(RequestError):
    """An idempotency key came again with another request."""

    code = 4012


class EventsForgotten(RequestError):
    """Events were asked for that are not kept any more; names the oldest that is."""

    code = 4013


class WrongState(RequestError):
    """A job cannot be changed like that in the state it is in."""

    code = 4014


class AnswerNeeded(RequestError):
    """A person has to say something first that nobody else can know."""

    code = 4015


class StreamLagging(RequestError):
    """A reader of the stream does not keep up with the events."""

    code = 4016


class DependencyFailed(RequestError):
    """A job that another depends on ended otherwise than done, so the other is held."""

    code = 4017


class InvalidMessage(RequestError):
    """A message does not fit its type."""

    code = 4018


class UnknownInterface(RequestError):
    """No topic, service, action or type of this name."""

    code = 4019


class ServiceFailed(RequestError):
    """A service of the graph failed, or went away before it answered."""

    code = 4020


class NotOverRos(RequestError):
    """A wish for which the graph between the floors has no words."""

    code = 4021


class NotSignedIn(RequestError):
    """A request came without a token, or with one that is not valid."""

    code = 4101


class NotAllowed(RequestError):
    """The role of whoever asks does not include this."""

    code = 4102


class LeaseHeld(RequestError):
    """Somebody else drives the robot."""

    code = 4103


class LeaseNeeded(RequestError):
    """Only who holds the control lease may do this, and nobody does."""

    code = 4104


class LeaseLost(RequestError):
    """The control lease that was shown has ended."""

    code = 4105


class TooManyRequests(RequestError):
    """A client asks more often than it may."""

    code = 4106


class InvalidConfig(RequestError):
    """A configuration key is unknown, out of range or contradicts another."""

    code = 5001


class FileUnwritable(RequestError):
    """A file cannot be written."""

    code = 5002


class AddressInUse(RequestError):
    """A port to listen on is taken."""

    code = 5003


class AlreadyRunning(RequestError):
    """Another `maya up` of this user runs already."""

    code = 5004


class FileNotOurs(RequestError):
    """A file that we would write over is somebody else's."""

    code = 5005


class NothingToRevert(RequestError):
    """There is no calibration to take back, or its values were changed since."""

    code = 5006


class StorageFailed(RequestError):
    """What is to be kept cannot be written; nothing of it is acknowledged."""

    code = 5007


class StorageDamaged(RequestError):
    """The file of the queue and its history is damaged; it is left as it is."""

    code = 5008


class StorageTooNew(RequestError):
    """The file of the queue was written by a newer version."""

    code = 5009


class StorageInUse(RequestError):
    """Another program keeps its queue in this file."""

    code = 5010


class MasterGone(RequestError):
    """No ROS master answers."""

    code = 5011


class RosMissing(RequestError):
    """What is needed of ROS is not installed here, or cannot be loaded by this Python."""

    code = 5012


class InternalError(MachineError):
    """A defect of ours: reported as one sentence, with the log's place."""

    code = 5999


def _walk(branch: type[MayaError]) -> dict[int, type[MayaError]]:
    found: dict[int, type[MayaError]] = {}
    for child in branch.__subclasses__():
        if child.code:
            found[child.code] = child
        found.update(_walk(child))
    return found


def by_code() -> dict[int, type[MayaError]]:
    """Return every leaf of the tree by its code."""
    return dict(sorted(_walk(MayaError).items()))


def from_notice(code: int, details: dict[str, object]) -> MayaError:
    """Rebuild an error from its code and details, as an edge received them.

    Raises `KeyError` for a code that is not in the tree.
    """
    return by_code()[code](**details)


def as_said(code: int, sentence: str) -> MayaError:
    """Return the error of `code` with the sentence that an edge received, where its details did not come along.

    Raises `KeyError` for a code that is not in the tree.
    """
    leaf = by_code()[code]
    error = leaf.__new__(leaf)
    Exception.__init__(error, sentence)
    error.details, error.said = {}, True
    return error
