"""The robots of a broker, and the steps of their supervisors, as messages. Dates are ISO 8601 in UTC."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

from maya_un.values import Notice

FleetLink: TypeAlias = Literal["none", "unsupported", "connecting", "connected", "lost"]
"""The link to the broker: `none` without a broker, and `unsupported` for a server of another kind."""

FleetRobotState: TypeAlias = Literal["idle", "waiting", "working", "failed", "offline", "lost", "unknown"]
"""The state of a robot.

It has no step, a step waits, it carries one out, its last step failed, it has disconnected, its link is lost, or the
broker does not know it any more.
"""

FleetStepState: TypeAlias = Literal["sent", "accepted", "executing", "done", "failed"]
"""The state of a step: `sent` by a supervisor, then as its robot reports it."""


@dataclass(frozen=True, slots=True)
class FleetStep:
    """A step of a robot, in this `state` since the date `since`.

    `command`, `args` (m, rad) and `supervisor` are those of its command; `command` is None if that was not seen. The
    supervisor is a claim of the sender. `duration` is the time from the beginning of an ended step to its end [s], None
    if it was not carried out, or its beginning was not seen. A failed step has an `error` and its `code`.
    """

    id: str
    state: FleetStepState
    since: str
    command: str | None = None
    args: Mapping[str, Any] = field(default_factory=dict[str, Any])
    supervisor: str | None = None
    duration: float | None = None
    error: str | None = None
    code: str | None = None


@dataclass(frozen=True, slots=True)
class FleetRobot:
    """A robot of the broker: its `state`, and the date `since` which it is connected or not, None if unknown.

    `heard` is the date of its latest message, None if none has come since the watching began. `step` is the step that
    it carries out, None without one; `waiting` further steps were sent to it or accepted. `last` are its latest ended
    steps, newest first.
    """

    name: str
    state: FleetRobotState
    since: str | None = None
    heard: str | None = None
    step: FleetStep | None = None
    waiting: int = 0
    last: tuple[FleetStep, ...] = ()


@dataclass(frozen=True, slots=True)
class FleetView:
    """The robots of the broker at the address `broker`, sorted by name, and `more` that are not listed.

    `link` is the state of the link to the broker since the date `since`, and `trouble` the error that prevents it.
    While it is lost, the robots are those of before. With `refused` the broker shows this login which robots are
    connected, but not their steps.
    """

    link: FleetLink = "none"
    broker: str = ""
    since: str | None = None
    trouble: Notice | None = None
    refused: bool = False
    robots: tuple[FleetRobot, ...] = ()
    more: int = 0
