"""Reasons why a command cannot be sent now, before it is sent; the robot makes the final decision."""

from __future__ import annotations

from typing import Callable

from maya_ui.robot import Command
from maya_ui.seen import Seen
from maya_ui.tasks import AIMED, HOME, PICK, PLACE, Task

Reason = str
"""The key of the word for the reason, "" without one."""


def why_not(command: Command, seen: Seen) -> Reason:
    """Return why a command cannot be sent now."""
    return _RULES[command](seen)


def why_not_now(task: Task, seen: Seen) -> Reason:
    """Return why a task cannot be done at once."""
    if task.command == HOME:
        return why_not(Command.HOME, seen)
    if task.command not in AIMED:
        return why_not(Command.GRIPPER, seen)
    reason = why_not(Command.TASK, seen)
    closed = seen.standing.gripper_closed
    if not reason and task.command == PICK and closed is True:
        return "gripper_is_closed"
    if not reason and task.command == PLACE and closed is False:
        return "gripper_is_open"
    return reason


def link(seen: Seen) -> Reason:
    """Return why no command for motion can be sent at all."""
    if not seen.presence.master and not seen.presence.controller:
        return "no_master"
    if not seen.presence.controller:
        return "no_controller"
    if not seen.here:
        return "silent"
    return "" if seen.connected else "no_machine"


def _at_rest(seen: Seen) -> Reason:
    if link(seen):
        return link(seen)
    if seen.standing.mode == "fault":
        return "recover_first"
    if seen.standing.mode == "paused":
        return "resume_first"
    return "busy" if seen.busy else ""


def _homed(seen: Seen) -> Reason:
    return _at_rest(seen) or ("" if seen.standing.homed else "home_first")


def _task(seen: Seen) -> Reason:
    return link(seen) or ("" if seen.presence.robot else "no_robot_layer") or _homed(seen)


def _recover(seen: Seen) -> Reason:
    return link(seen) or ("" if seen.standing.mode == "fault" else "no_fault")


def _pause(seen: Seen) -> Reason:
    return link(seen) or ("" if seen.standing.mode == "moving" else "nothing_moves")


def _resume(seen: Seen) -> Reason:
    return link(seen) or ("" if seen.standing.mode == "paused" else "nothing_paused")


def _queue(seen: Seen) -> Reason:
    if not seen.presence.process:
        return "no_process_layer" if seen.presence.master else "no_master"
    return ""


def _resume_queue(seen: Seen) -> Reason:
    if seen.queue.job:
        return "decide_first"
    return _queue(seen) or ("" if seen.queue.mode != "running" else "queue_runs")


def _recover_queue(seen: Seen) -> Reason:
    return _queue(seen) or ("" if seen.queue.job else "no_interrupted_job")


def _always(_: Seen) -> Reason:
    return ""


_RULES: dict[Command, Callable[[Seen], Reason]] = {
    Command.HOME: _at_rest,
    Command.TASK: _task,
    Command.GRIPPER: _at_rest,
    Command.JOG: _homed,
    Command.STOP: _always,
    Command.RECOVER: _recover,
    Command.PAUSE: _pause,
    Command.RESUME: _resume,
    Command.SPEED: link,
    Command.SEND: _queue,
    Command.START_QUEUE: _queue,
    Command.STOP_QUEUE: _queue,
    Command.RESUME_QUEUE: _resume_queue,
    Command.RECOVER_QUEUE: _recover_queue,
}
