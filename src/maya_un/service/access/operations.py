"""Callers, roles, and the table of operations with the role that each needs."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum, StrEnum
from typing import NamedTuple, cast

from dmc41x3.i18n import phrase
from maya_un.errors import InvalidValue, NotAllowed
from maya_un.schema.choices import RoleName


class Role(IntEnum):
    """The role of a user. Each role includes the rights of the roles before it.

    A viewer may read and stop. A student may propose jobs, and may move the robot with a lease that an operator offers.
    An operator may move the robot, change the queue and approve jobs. An administrator may also manage users.
    """

    VIEWER = 1
    STUDENT = 2
    OPERATOR = 3
    ADMIN = 4

    @property
    def word(self) -> RoleName:
        """The name of the role in lower case."""
        return cast("RoleName", self.name.lower())

    @classmethod
    def of(cls, word: str) -> Role:
        """Return the role of this name; raises `InvalidValue`."""
        for role in cls:
            if role.word == word:
                return role
        known = ", ".join(role.word for role in cls)
        raise InvalidValue(key="role", value=repr(word), reason=phrase("it must be one of {choices}", choices=known))


assert set(RoleName.__args__) == {role.word for role in Role}


@dataclass(frozen=True, slots=True)
class Caller:
    """The sender of a request.

    `name` is that of the principal, `source` the origin of the request ("127.0.0.1", "ros", "cli"). `lease` is the
    control lease in the request, "" for none. An `implicit` caller has no lease and takes the free lease for the
    duration of a command: the local user while no users exist, and the ROS graph. `token` is the public part of the
    caller's token, "" for none.
    """

    name: str
    role: Role
    source: str = ""
    lease: str = ""
    implicit: bool = False
    token: str = ""


LOCAL = Caller("local", Role.ADMIN, "local", implicit=True)
"""The local user while no users exist: has full access, and needs no lease."""

ROS = Caller("ros", Role.OPERATOR, "ros", implicit=True)
"""The ROS graph and rosbridge: one principal, which takes the free lease for each command."""

BYSTANDER = Caller("local", Role.VIEWER, "local")
"""A client on this computer without a token, though users exist: may only stop and abort."""

RESERVED = frozenset({LOCAL.name, ROS.name, "maya", "queue", "unknown"})
"""Names that no user can have."""


class Operation(StrEnum):
    """The operations of a running Maya, by their names in the audit log."""

    READ = "read"
    PREVIEW = "preview"
    STOP = "stop"
    PROPOSE = "propose"
    SUBMIT = "submit"
    CHANGE_JOB = "change job"
    CANCEL = "cancel"
    APPROVE = "approve"
    PAUSE = "pause"
    ABORT = "abort"
    COMMAND = "command"
    JOG = "jog"
    RESUME = "resume"
    SPEED = "speed"
    RECOVER = "recover"
    DATUM = "datum"
    STEP = "step"
    GRAPH = "graph"
    RESTART = "restart"
    CLEAR = "clear"
    ZONES = "zones"
    TEACH = "teach"
    LEASE = "lease"
    RENEW = "renew"
    LEND = "drive"
    BREAK = "break"
    RECORD = "record"
    CONFIGURE = "configure"
    BACKUP = "backup"
    AUDIT = "audit"
    DIAGNOSE = "diagnose"
    INJECT = "inject"
    CALIBRATE = "calibrate"
    TERMINAL = "terminal"
    USERS = "users"
    ME = "me"


class AccessRule(NamedTuple):
    """The requirements of an operation: at least this role, and the control lease if it `drives`."""

    role: Role
    drives: bool = False
    meaning: str = ""


RULES: dict[Operation, AccessRule] = {
    Operation.READ: AccessRule(Role.VIEWER, meaning="read the state, the queue, its history, places, zones and events"),
    Operation.PREVIEW: AccessRule(Role.VIEWER, meaning="preview a job"),
    Operation.STOP: AccessRule(Role.VIEWER, meaning="stop on the path"),
    Operation.ABORT: AccessRule(Role.VIEWER, meaning="stop without deceleration"),
    Operation.ME: AccessRule(Role.VIEWER, meaning="read your account, change your password, sign out"),
    Operation.PROPOSE: AccessRule(
        Role.STUDENT, meaning="submit a job that needs approval; change and cancel your jobs"
    ),
    Operation.PAUSE: AccessRule(Role.STUDENT, meaning="pause on the path, or after the running step"),
    Operation.LEASE: AccessRule(Role.STUDENT, meaning="request the lease, accept an offer, release your lease"),
    Operation.RENEW: AccessRule(Role.STUDENT, meaning="renew your lease"),
    Operation.SUBMIT: AccessRule(Role.OPERATOR, meaning="submit a job to the queue"),
    Operation.CHANGE_JOB: AccessRule(Role.OPERATOR, meaning="reorder, hold, release, edit any job"),
    Operation.CANCEL: AccessRule(Role.OPERATOR, meaning="cancel any job"),
    Operation.APPROVE: AccessRule(Role.OPERATOR, meaning="approve or decline a proposal"),
    Operation.LEND: AccessRule(Role.OPERATOR, meaning="take the lease, offer it to another user"),
    Operation.TEACH: AccessRule(Role.OPERATOR, meaning="teach poses and pallets"),
    Operation.RECORD: AccessRule(Role.OPERATOR, meaning="save and download recordings"),
    Operation.DIAGNOSE: AccessRule(Role.OPERATOR, meaning="read the log, and check the computer and the configuration"),
    Operation.INJECT: AccessRule(Role.OPERATOR, meaning="inject faults into the twin"),
    Operation.CALIBRATE: AccessRule(Role.OPERATOR, meaning="collect points of a calibration, and fit to them"),
    Operation.COMMAND: AccessRule(Role.STUDENT, drives=True, meaning="run one primitive now"),
    Operation.JOG: AccessRule(Role.STUDENT, drives=True, meaning="jog"),
    Operation.RESUME: AccessRule(Role.STUDENT, drives=True, meaning="resume after a pause"),
    Operation.SPEED: AccessRule(Role.STUDENT, drives=True, meaning="scale the speed"),
    Operation.STEP: AccessRule(Role.STUDENT, drives=True, meaning="run one step"),
    Operation.RECOVER: AccessRule(Role.OPERATOR, drives=True, meaning="clear a fault"),
    Operation.DATUM: AccessRule(
        Role.OPERATOR, drives=True, meaning="give and confirm the datum of a robot without switches"
    ),
    Operation.RESTART: AccessRule(Role.OPERATOR, drives=True, meaning="decide about an interrupted job"),
    Operation.CLEAR: AccessRule(Role.OPERATOR, meaning="cancel all waiting jobs"),
    Operation.ZONES: AccessRule(Role.OPERATOR, drives=True, meaning="change the zones of this run"),
    Operation.GRAPH: AccessRule(Role.OPERATOR, meaning="take part in the graph: publish, serve, set its parameters"),
    Operation.BREAK: AccessRule(Role.ADMIN, meaning="take the lease from its holder"),
    Operation.CONFIGURE: AccessRule(Role.ADMIN, meaning="change the configuration of the next start"),
    Operation.BACKUP: AccessRule(Role.ADMIN, meaning="back up the queue, its history, the users and the audit log"),
    Operation.TERMINAL: AccessRule(Role.ADMIN, drives=True, meaning="send the controller commands that read"),
    Operation.AUDIT: AccessRule(Role.ADMIN, meaning="read the audit log"),
    Operation.USERS: AccessRule(Role.ADMIN, meaning="manage users and tokens"),
}
"""The requirements of every operation. Stop and abort need neither a lease nor more than a valid token."""


MOVING = frozenset(
    {
        Operation.COMMAND,
        Operation.JOG,
        Operation.RESUME,
        Operation.STEP,
        Operation.DATUM,
        Operation.RESTART,
    }
)
"""Operations that may begin a motion: a stop that comes after one of them, before it begins, ends it."""

QUEUEING = frozenset({Operation.SUBMIT, Operation.CHANGE_JOB, Operation.APPROVE})
"""Operations after which a job may begin."""

STOPPING = frozenset({Operation.STOP, Operation.ABORT})
"""Operations that need no token on this computer, even if users exist."""


def allowed(role: Role, operation: Operation) -> bool:
    """Return whether `role` includes `operation`, without regard to the lease."""
    return role >= RULES[operation].role


def require(caller: Caller, operation: Operation) -> None:
    """Raise `NotAllowed` if the role of `caller` does not include `operation`."""
    if not allowed(caller.role, operation):
        needed = RULES[operation].role.word
        raise NotAllowed(who=caller.name, role=caller.role.word, operation=operation.value, needed=needed)


OWN = frozenset({Operation.CHANGE_JOB, Operation.CANCEL})
"""Operations on a user's own jobs that the right to propose includes."""


def require_over(caller: Caller, operation: Operation, owner: str) -> None:
    """Raise `NotAllowed` if neither the role nor the ownership of the job allows `caller` this operation.

    The state of the job is checked elsewhere.
    """
    own = operation in OWN and caller.name == owner and allowed(caller.role, Operation.PROPOSE)
    if not own:
        require(caller, operation)
