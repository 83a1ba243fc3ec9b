"""/diagnostics: the status of every layer, in words and levels that ROS tools show.

Levels: OK; WARN if a person must act before the robot moves; ERROR in a fault or without a connection; STALE for the
axes without a connection. The message of a fault is its code and sentence.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from math import degrees

from maya_ros.graph.protocol import Message, header
from maya_un.axes import AXES
from maya_un.values import Mode, Notice, State

CONTROLLER = "maya: controller"
"""The name of the controller layer's status."""


class DiagnosticLevel(IntEnum):
    """Level of a status (diagnostic_msgs/DiagnosticStatus)."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(frozen=True, slots=True)
class DiagnosticStatus:
    """Status of one part of Maya: its `name`, one sentence, and further `values` by key."""

    name: str
    level: DiagnosticLevel
    message: str
    values: Mapping[str, object] = field(default_factory=dict[str, object])


_WORDS = {
    Mode.DISCONNECTED: "no connection to the controller",
    Mode.NOT_HOMED: "not homed: the lengths of the lines are not known",
    Mode.HOMING: "homing",
    Mode.IDLE: "homed and at rest",
    Mode.MOVING: "moving",
    Mode.PAUSED: "paused: nothing moves until it is resumed",
    Mode.STOPPING: "braking on the path",
}
_LEVELS = {
    Mode.DISCONNECTED: DiagnosticLevel.ERROR,
    Mode.FAULT: DiagnosticLevel.ERROR,
    Mode.NOT_HOMED: DiagnosticLevel.WARN,
    Mode.PAUSED: DiagnosticLevel.WARN,
}


def controller(state: State, address: str = "") -> DiagnosticStatus:
    """Return the status of the controller layer, connected to `address`."""
    values: dict[str, object] = {
        "address": address,
        "mode": state.mode,
        "homed": state.homed,
        "moving": state.moving,
        "gripper": "closed" if state.gripper_closed else "open",
        "speed override": f"{state.override:.0%}",
        "code": "" if state.fault is None else state.fault.code,
    }
    if state.progress is not None:
        values["progress"] = f"{state.progress.phase} {state.progress.fraction:.0%}"
    return DiagnosticStatus(CONTROLLER, _LEVELS.get(state.mode, DiagnosticLevel.OK), _sentence(state), values)


def axes(state: State) -> DiagnosticStatus:
    """Return the status of the motors and limit switches."""
    limits = [f"{axis} {side}" for axis, side, active in _switches(state) if active]
    off = [axis for axis, on in zip(AXES, state.motors_on, strict=True) if not on]
    values: dict[str, object] = {
        "motors off": " ".join(off),
        "limit switches": ", ".join(limits),
        "stop codes": " ".join(map(str, state.stop_code)),
        "counts": " ".join(map(str, state.counts)),
    }
    if state.joints is None and state.mode is not Mode.DISCONNECTED:
        values["joints"] = "not known before homing: /joint_states is silent, and tf holds two trees, base and hook"
    if state.joints is not None:
        a, b, c = state.joints
        values["joints"] = f"a {degrees(a):.2f} deg, b {b:.4f} m, c {c:.4f} m"
    if state.mode is Mode.DISCONNECTED:
        return DiagnosticStatus(
            "maya: axes", DiagnosticLevel.STALE, "not connected: nothing is known of the axes", values
        )
    if limits and state.mode is not Mode.HOMING:
        return DiagnosticStatus("maya: axes", DiagnosticLevel.WARN, f"on a limit switch: {', '.join(limits)}", values)
    if off:
        return DiagnosticStatus("maya: axes", DiagnosticLevel.WARN, f"motors off: {', '.join(off)}", values)
    return DiagnosticStatus("maya: axes", DiagnosticLevel.OK, "motors on", values)


def robot(*, controller_there: bool, can_teleop: bool, running: str = "", why: str = "") -> DiagnosticStatus:
    """Return the status of the robot layer; `running` names the primitive under way, "" for none.

    `why` is the reason why the layer takes no command now, "" if unknown.
    """
    values = {"can_teleop": can_teleop, "running": running}
    if not controller_there:
        return DiagnosticStatus("maya: robot", DiagnosticLevel.ERROR, "1011 the controller layer is not there", values)
    message = f"at {running}" if running else "ready" if can_teleop else why or "waits for the controller layer"
    return DiagnosticStatus(
        "maya: robot", DiagnosticLevel.OK if running or can_teleop else DiagnosticLevel.WARN, message, values
    )


def process(
    *, robot_there: bool, paused: bool, running: str = "", queued: int = 0, reason: str = ""
) -> DiagnosticStatus:
    """Return the status of the process layer; `running` names the job under way, `reason` is why the queue pauses."""
    values = {"running": running, "queued": queued, "paused": paused}
    if not robot_there:
        return DiagnosticStatus("maya: process", DiagnosticLevel.ERROR, "1011 the robot layer is not there", values)
    if paused:
        return DiagnosticStatus(
            "maya: process", DiagnosticLevel.WARN, f"the queue is paused: {reason or 'no reason given'}", values
        )
    return DiagnosticStatus(
        "maya: process", DiagnosticLevel.OK, f"at {running}" if running else "the queue is empty", values
    )


def interrupted(job: int, name: str, step: str, *, robot_there: bool) -> DiagnosticStatus:
    """Return the status of the process layer while job `job`, which a program end interrupted, waits for a person."""
    values = {"interrupted": job, "step": step, "paused": True}
    if not robot_there:
        return DiagnosticStatus("maya: process", DiagnosticLevel.ERROR, "1011 the robot layer is not there", values)
    message = f"job {job} ({name}) was interrupted: decide about it (`maya queue recover`, /recover_queue)"
    return DiagnosticStatus("maya: process", DiagnosticLevel.WARN, message, values)


def bridge(name: str, *, there: bool, clients: int = 0, message: str = "") -> DiagnosticStatus:
    """Return the status of a bridge; `there` is whether the layer below it is available."""
    said = message or ("connected" if there else "waits for the layer below")
    return DiagnosticStatus(
        f"maya: {name}", DiagnosticLevel.OK if there else DiagnosticLevel.WARN, said, {"clients": clients}
    )


def array(statuses: Iterable[DiagnosticStatus], seconds: float, hardware: str = "maya") -> Message:
    """Return diagnostic_msgs/DiagnosticArray at the time `seconds` since the epoch."""
    return {"header": header(seconds), "status": [_plain(status, hardware) for status in statuses]}


def _plain(status: DiagnosticStatus, hardware: str) -> Message:
    return {
        "level": int(status.level),
        "name": status.name,
        "message": status.message,
        "hardware_id": hardware,
        "values": [{"key": key, "value": _text(value)} for key, value in status.values.items()],
    }


def _text(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _sentence(state: State) -> str:
    if state.fault is not None:
        return coded(state.fault)
    return (
        "no connection to the controller" if state.mode is Mode.DISCONNECTED else _WORDS.get(state.mode, "in a fault")
    )


def coded(notice: Notice) -> str:
    """Return a fault as it is shown everywhere: its code, then its sentence."""
    return f"{notice.code} {notice.message}"


def _switches(state: State) -> Iterable[tuple[str, str, bool]]:
    for axis, forward, reverse in zip(AXES, state.forward_limit, state.reverse_limit, strict=True):
        yield axis, "long end" if axis != "a" else "forward", forward
        yield axis, "short end" if axis != "a" else "reverse", reverse
