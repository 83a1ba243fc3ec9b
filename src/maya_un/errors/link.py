"""1xxx: the link to the controller, to a service, and to a node."""

from __future__ import annotations

from maya_un.errors.base import MachineError, RequestError


class ParameterMismatch(MachineError):
    """The controller did not keep a parameter as configured."""

    code = 1007


class NodeGone(MachineError):
    """The node that did this ended by itself, or is not there; where only its action is known, that is named."""

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


class ControllerOwned(RequestError):
    """Another running program owns the controller; nothing was written to it."""

    code = 1030


class OwnershipLost(MachineError):
    """Another program took the controller over; this one no longer moves anything and keeps its waiting jobs."""

    code = 1031


class OwnerErased(MachineError):
    """Another program erased the variable that names this program as the controller's owner."""

    code = 1033


class ControllerMoves(RequestError):
    """Axes move by commands of another program, so the controller cannot change its owner yet."""

    code = 1032


class RobotNotReached(RequestError):
    """The link to supervisors cannot reach the robot's rosbridge."""

    code = 1050


class SupervisorsNotReached(RequestError):
    """The link to supervisors cannot reach their broker or database."""

    code = 1051


class BrokerRefused(RequestError):
    """A broker does not carry a supervisor's command, by its rules."""

    code = 1052


class SessionTakenOver(RequestError):
    """Another robot is connected to the supervisors' broker or database under the same name."""

    code = 1053


class WrongRobot(RequestError):
    """The rosbridge belongs to another robot than the one whose commands the link carries."""

    code = 1054
