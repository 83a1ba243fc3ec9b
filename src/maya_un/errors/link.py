"""1xxx: the link to the controller, to a service, and to a node."""

from __future__ import annotations

from dmc41x3.i18n import Phrase
from maya_un.errors.base import MachineError, RequestError


class ParameterMismatch(
    MachineError,
    code=1007,
    en="Maya set {register} to {wanted}, but the controller still has {found}. Correct the value in the "
    "configuration, or end the program that changes it. Then run `maya recover`.",
):
    """The controller did not accept the configured value of a parameter."""

    register: str
    found: str
    wanted: str


class NodeGone(
    MachineError,
    code=1011,
    en="{node} has ended, so the controller stopped the robot on its path. Start {node} again, then check "
    "the position of the robot before you continue.",
):
    """The node that executed the request has ended or does not exist; if only its action is known, that is named."""

    node: str


class ServiceNotRunning(
    RequestError,
    code=1020,
    en="`maya up` does not run on this computer. Start it, then run the command again. To stop a robot "
    "without `maya up`, run `maya stop --address real` (or HOST:PORT).",
):
    """No running `maya up` was found."""


class ServiceNotAnswering(
    RequestError,
    code=1021,
    en="`maya up` runs but does not answer ({reason}). Stop the robot with `maya stop`, then restart `maya up`.",
):
    """`maya up` runs but does not answer."""

    reason: Phrase


class TwinNotFound(
    RequestError,
    code=1022,
    en="Maya cannot tell which twin to use: {reason}. Start `maya up` or `maya dmc serve`, or give the address of a "
    "running twin with `--twin` (running now: {running}).",
):
    """The options select no running twin, or more than one matches."""

    reason: Phrase
    running: Phrase


class ControllerOwned(
    RequestError,
    code=1030,
    en="Another running program, {holder}, owns the controller at {address}. Use that program, or end it. If you "
    "cannot, check that the robot is at rest, then take the controller over with `--take-over`.",
):
    """Another running program owns the controller; nothing was written to it."""

    holder: Phrase
    address: str


class OwnershipLost(
    MachineError,
    code=1031,
    en="Another program, {holder}, took the controller over. This program moves nothing any more and keeps its "
    "waiting jobs. Use the other program. When it has ended, run `maya recover` here, then `maya queue resume`.",
):
    """Another program took the controller over; this one no longer moves anything, and its waiting jobs stay."""

    holder: Phrase


class OwnerErased(
    MachineError,
    code=1033,
    en="Another program erased the variable that names the owner of the controller (ZAB), so Maya does not "
    "move the robot. Close the other program, then run `maya recover`.",
):
    """Another program erased the variable that names this program as the controller's owner."""


class ControllerMoves(
    RequestError,
    code=1032,
    en="The program {holder} still moves axes, so you cannot take the controller over now. Wait until the "
    "axes are at rest, or stop them from any computer with `maya stop --address {address}`. Then try "
    "again.",
):
    """Axes move by commands of another program, so the controller cannot change its owner yet."""

    holder: Phrase
    address: str


class RobotNotReached(
    RequestError,
    code=1050,
    en="The robot's rosbridge at {url} does not answer: {reason}. Start the robot with `maya up "
    "--rosbridge`, or give the address of its rosbridge with --rosbridge (or $IP). This program tries "
    "again by itself.",
):
    """The link to supervisors cannot reach the robot's rosbridge."""

    url: str
    reason: Phrase


class SupervisorsNotReached(
    RequestError,
    code=1051,
    en="The server of the supervisors, {where}, does not answer: {reason}. Check that it runs. Then check "
    "the address, user and password given to this program.",
):
    """The link to supervisors cannot reach their broker or database."""

    where: str
    reason: Phrase


class BrokerRefused(
    RequestError,
    code=1052,
    en="The broker {where} refuses the command: {reason}. Ask the administrator of the broker for access to "
    "this robot (ACL).",
):
    """A broker refuses a supervisor's command by its rules."""

    where: str
    reason: Phrase


class SessionTakenOver(
    RequestError,
    code=1053,
    en="Another robot is connected to {where} under the name {name}, so this robot does not connect again. "
    "Give each robot its own name (coms.name in the configuration, or $NAME), then start this program "
    "again.",
):
    """Another robot is connected to the supervisors' broker or database under the same name."""

    where: str
    name: str


class WrongRobot(
    RequestError,
    code=1054,
    en="The rosbridge at {url} belongs to the robot {found!r}, but this program is for the robot {name}, so "
    "it sends no commands. Start it with --rosbridge and the address of the rosbridge of {name}, or give "
    "the robot the name {name} (coms.name in the configuration, or $NAME).",
):
    """The rosbridge belongs to another robot than the one of this link."""

    url: str
    found: str
    name: str
