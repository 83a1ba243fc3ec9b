"""Forecast which actions a caller may do now: the checks of the gate and of the commands, without their effects.

A client shows with it which of its buttons work. The answer is a forecast: the action itself checks again.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple, Protocol

from maya_un.config import Config
from maya_un.errors import Busy, CannotPause, Faulted, MayaError, NotConnected, NothingToRecover, NotHomed, NotPaused
from maya_un.process.lease import ControlLease
from maya_un.schema.people import Permissions
from maya_un.service.access.operations import RULES, Caller, Operation, allowed, require
from maya_un.values import Mode, Notice, State


class CheckedService(Protocol):
    """The part of the service that the checks read."""

    @property
    def state(self) -> State:
        """The latest state of the machine."""
        ...

    @property
    def running(self) -> int | None:
        """The number of the running job, None without one."""
        ...

    def config(self) -> Config:
        """Return the configuration that applies."""
        ...

    def require_free(self) -> None:
        """Raise `Busy` while a job or a direct command runs."""
        ...


Check = Callable[[CheckedService], None]
"""Raises the error with which the state of the robot prevents an action."""


def connected(service: CheckedService) -> None:
    """Raise `NotConnected` without a controller."""
    if service.state.mode is Mode.DISCONNECTED:
        raise NotConnected


def healthy(service: CheckedService) -> None:
    """Raise `NotConnected` or `Faulted` if no motion is possible."""
    connected(service)
    fault = service.state.fault
    if fault is not None:
        raise Faulted(fault=fault.message)


def homed(service: CheckedService) -> None:
    """Raise `NotHomed` before homing."""
    if not service.state.homed:
        raise NotHomed(command=service.config().homing_command)


def free(service: CheckedService) -> None:
    """Raise `Busy` while a job or a direct command runs."""
    service.require_free()


def pausable(service: CheckedService) -> None:
    """Raise `CannotPause` if nothing can be paused."""
    mode = service.state.mode
    if mode is Mode.HOMING:
        raise CannotPause(reason="a homing cannot be interrupted and continued")
    if mode is Mode.STOPPING:
        raise CannotPause(reason="the robot is stopping")
    if mode is not Mode.MOVING and service.running is None:
        raise CannotPause(reason="nothing moves")


def paused(service: CheckedService) -> None:
    """Raise `NotPaused` if no motion is on hold."""
    if service.state.mode is not Mode.PAUSED:
        raise NotPaused


def faulted(service: CheckedService) -> None:
    """Raise `NothingToRecover` without a fault."""
    if service.state.fault is None:
        raise NothingToRecover


class UserAction(NamedTuple):
    """An action: its operation, the first of several that the caller's role includes, and the checks of the state."""

    operations: tuple[Operation, ...]
    checks: tuple[Check, ...] = ()


ACTIONS: dict[str, UserAction] = {
    "stop": UserAction((Operation.STOP,), (connected,)),
    "home": UserAction((Operation.COMMAND,), (free, healthy)),
    "move": UserAction((Operation.COMMAND,), (free, healthy, homed)),
    "gripper": UserAction((Operation.COMMAND,), (free, healthy)),
    "jog": UserAction((Operation.JOG,), (free, healthy, homed)),
    "speed": UserAction((Operation.SPEED,), (connected,)),
    "pause": UserAction((Operation.PAUSE,), (healthy, pausable)),
    "resume": UserAction((Operation.RESUME,), (connected, paused)),
    "datum": UserAction((Operation.DATUM,), (free, healthy)),
    "recover": UserAction((Operation.RECOVER,), (connected, faulted)),
    "submit": UserAction((Operation.SUBMIT, Operation.PROPOSE), (healthy,)),
    "approve": UserAction((Operation.APPROVE,)),
    "order": UserAction((Operation.CHANGE_JOB,)),
    "clear": UserAction((Operation.CLEAR,)),
    "pause queue": UserAction((Operation.PAUSE,)),
    "resume queue": UserAction((Operation.RESUME,)),
    "step queue": UserAction((Operation.STEP,)),
    "decide": UserAction((Operation.RESTART,)),
    "answer": UserAction((Operation.RESUME,)),
    "teach": UserAction((Operation.TEACH,), (connected, homed)),
    "zones": UserAction((Operation.ZONES,), (free,)),
    "take lease": UserAction((Operation.LEND, Operation.LEASE)),
    "break lease": UserAction((Operation.BREAK,)),
    "record": UserAction((Operation.RECORD,)),
    "configure": UserAction((Operation.CONFIGURE,)),
    "calibrate": UserAction((Operation.CALIBRATE,), (connected, homed)),
    "inject faults": UserAction((Operation.INJECT,)),
    "read log": UserAction((Operation.DIAGNOSE,)),
    "terminal": UserAction((Operation.TERMINAL,), (connected,)),
    "back up": UserAction((Operation.BACKUP,)),
    "read audit": UserAction((Operation.AUDIT,)),
    "manage users": UserAction((Operation.USERS,)),
}
"""The actions of a user by name."""


def circumstances(service: CheckedService, lease: ControlLease) -> object:
    """Return the facts on which the checks depend: while they are equal, each caller may do the same as before."""
    state = service.state
    return state.mode, state.homed, state.fault, service.running, _doing(service), lease.standing


def _doing(service: CheckedService) -> str:
    """Return what the robot is busy with, "" if nothing or a job; this is asked at every state of the robot."""
    if service.running is not None:
        return ""
    try:
        service.require_free()
    except Busy as busy:
        return str(busy.details["doing"])
    return ""


def as_permissions(refused: Mapping[str, MayaError | None], language: str) -> Permissions:
    """Return the result of `refusals` as a message in a language."""
    return Permissions({name: one and Notice(one.code, one.text(language)) for name, one in refused.items()})


def refusals(service: CheckedService, lease: ControlLease, caller: Caller) -> dict[str, MayaError | None]:
    """Return for each action the error with which it would be refused to `caller` now, None if it is allowed."""
    return {name: _refusal(service, lease, caller, action) for name, action in ACTIONS.items()}


def _refusal(service: CheckedService, lease: ControlLease, caller: Caller, action: UserAction) -> MayaError | None:
    of = action.operations
    operation = next((one for one in of if allowed(caller.role, one)), of[-1])
    try:
        require(caller, operation)
        if RULES[operation].drives:
            lease.require_drive(caller.lease, caller.name, implicit=caller.implicit)
        for check in action.checks:
            check(service)
    except MayaError as error:
        return error
    return None
