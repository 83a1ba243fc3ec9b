"""What can be asked for, which role it needs, and whether it drives the robot: one table for every edge."""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple

from maya_un.api.access.caller import Caller, Role
from maya_un.errors import NotAllowed


class Operation(StrEnum):
    """Everything that can be asked of a running Maya, by the name that the audit log shows."""

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
    WISH = "wish"
    JOG = "jog"
    RESUME = "resume"
    SPEED = "speed"
    RECOVER = "recover"
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
    BACKUP = "backup"
    AUDIT = "audit"
    USERS = "users"
    ME = "me"


class Rule(NamedTuple):
    """What an operation needs: at least this role, and, where it `drives`, the control lease."""

    role: Role
    drives: bool = False
    meaning: str = ""


RULES: dict[Operation, Rule] = {
    Operation.READ: Rule(Role.VIEWER, meaning="look at the state, the queue, its history, places, zones, events"),
    Operation.PREVIEW: Rule(Role.VIEWER, meaning="work out what a job would be"),
    Operation.STOP: Rule(Role.VIEWER, meaning="stop on the path"),
    Operation.ABORT: Rule(Role.VIEWER, meaning="stop without deceleration"),
    Operation.ME: Rule(Role.VIEWER, meaning="see oneself, change one's password, sign out"),
    Operation.PROPOSE: Rule(Role.STUDENT, meaning="submit a job that waits for approval; change and cancel one's own"),
    Operation.PAUSE: Rule(Role.STUDENT, meaning="pause on the path, or after this step"),
    Operation.LEASE: Rule(Role.STUDENT, meaning="ask for the lease, take what is offered, release one's own"),
    Operation.RENEW: Rule(Role.STUDENT, meaning="say that one still drives"),
    Operation.SUBMIT: Rule(Role.OPERATOR, meaning="submit a job that begins when its turn comes"),
    Operation.CHANGE_JOB: Rule(Role.OPERATOR, meaning="reorder, hold, release, edit any job"),
    Operation.CANCEL: Rule(Role.OPERATOR, meaning="cancel any job"),
    Operation.APPROVE: Rule(Role.OPERATOR, meaning="approve or decline a proposal"),
    Operation.LEND: Rule(Role.OPERATOR, meaning="take the lease, hand it over"),
    Operation.TEACH: Rule(Role.OPERATOR, meaning="teach poses and pallets"),
    Operation.RECORD: Rule(Role.OPERATOR, meaning="save and fetch recordings"),
    Operation.WISH: Rule(Role.STUDENT, drives=True, meaning="one primitive, now"),
    Operation.JOG: Rule(Role.STUDENT, drives=True, meaning="jog"),
    Operation.RESUME: Rule(Role.STUDENT, drives=True, meaning="go on after a pause"),
    Operation.SPEED: Rule(Role.STUDENT, drives=True, meaning="scale the speed"),
    Operation.STEP: Rule(Role.STUDENT, drives=True, meaning="do one step"),
    Operation.RECOVER: Rule(Role.OPERATOR, drives=True, meaning="clear a fault"),
    Operation.RESTART: Rule(Role.OPERATOR, drives=True, meaning="say what becomes of an interrupted job"),
    Operation.CLEAR: Rule(Role.OPERATOR, meaning="cancel everything that waits"),
    Operation.ZONES: Rule(Role.OPERATOR, drives=True, meaning="change the zones of this run"),
    Operation.GRAPH: Rule(Role.OPERATOR, meaning="take part in the graph: publish, serve, set its parameters"),
    Operation.BREAK: Rule(Role.ADMIN, meaning="take the lease from whoever holds it"),
    Operation.BACKUP: Rule(Role.ADMIN, meaning="back the queue and its history up"),
    Operation.AUDIT: Rule(Role.ADMIN, meaning="read the audit log"),
    Operation.USERS: Rule(Role.ADMIN, meaning="keep users and tokens"),
}
"""What every operation needs. Stop and abort need neither a lease nor more than a valid token."""


STOPPING = frozenset({Operation.STOP, Operation.ABORT})
"""Operations that need no token on this machine, whether users exist or not."""


def allowed(role: Role, operation: Operation) -> bool:
    """Tell whether `role` may ask for `operation`, the lease aside."""
    return role >= RULES[operation].role


def require(caller: Caller, operation: Operation) -> None:
    """Raise `NotAllowed` where the role of `caller` does not include `operation`."""
    if not allowed(caller.role, operation):
        needed = RULES[operation].role.word
        raise NotAllowed(who=caller.name, role=caller.role.word, operation=operation.value, needed=needed)


OWN = frozenset({Operation.CHANGE_JOB, Operation.CANCEL})
"""What whoever may propose may do to his own jobs as well."""


def require_over(caller: Caller, operation: Operation, owner: str) -> None:
    """Raise `NotAllowed` where `caller` may not do this to a job of `owner`: by his role, or because it is his own.

    Whether the job is in a state for it is another question.
    """
    own = operation in OWN and caller.name == owner and allowed(caller.role, Operation.PROPOSE)
    if not own:
        require(caller, operation)
