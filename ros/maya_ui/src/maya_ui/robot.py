"""The interface of a robot for the dashboard, and the facts that it reports; `ui_controller` implements it over ROS."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Callable, Protocol, Sequence, Union

from maya_ui.tasks import Task


class Command(Enum):
    """Commands of a person."""

    HOME = "home"
    TASK = "task"
    GRIPPER = "gripper"
    JOG = "jog"
    STOP = "stop"
    RECOVER = "recover"
    PAUSE = "pause"
    RESUME = "resume"
    SPEED = "speed"
    SEND = "send"
    START_QUEUE = "start_queue"
    STOP_QUEUE = "stop_queue"
    RESUME_QUEUE = "resume_queue"
    RECOVER_QUEUE = "recover_queue"


@dataclass(frozen=True)
class Standing:
    """State of the controller layer, from events on /maya_event."""

    mode: str = "disconnected"
    homed: bool = False
    moving: bool = False
    gripper_closed: bool | None = None
    override: float = 1.0
    fault_code: str = ""
    fault: str = ""


@dataclass(frozen=True)
class Happened:
    """An event: its word, an error code or "", a message, and further fields; `standing` is None if unreported."""

    word: str
    standing: Standing | None = None
    code: str = ""
    message: str = ""
    detail: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Position:
    """Position of the gripper [m]."""

    x: float
    y: float
    z: float


@dataclass(frozen=True)
class Joints:
    """The joints (rad, m, m)."""

    a: float
    b: float
    c: float


@dataclass(frozen=True)
class Presence:
    """Layers that take part in the graph now; `silent` is a present controller layer that publishes no joints."""

    master: bool = False
    controller: bool = False
    silent: bool = False
    robot: bool = False
    process: bool = False


@dataclass(frozen=True)
class Under:
    """A command is under way: its phase, and the share that is done (0 to 1)."""

    command: Command
    phase: str = ""
    share: float = 0.0


@dataclass(frozen=True)
class Ended:
    """A command has ended; after a failure, the code and the message give the reason."""

    command: Command
    done: bool
    code: str = ""
    message: str = ""


@dataclass(frozen=True)
class Cell:
    """The configuration of the cell: the height of the gripper where it grasps a standard part [m]."""

    grasp_height: float


@dataclass(frozen=True)
class Choice:
    """A choice for an interrupted job; `holding` is whether the gripper holds a part: yes, no or ""."""

    name: str
    holding: str = ""


@dataclass(frozen=True)
class Queue:
    """State of the queue of the process layer, from /queue_status.

    `reason` is why the queue is paused. `job` and `step` name an interrupted job that waits for a person, "" without
    one, and `choices` are the choices for that job.
    """

    mode: str = "running"
    reason: str = ""
    job: str = ""
    step: str = ""
    choices: tuple[Choice, ...] = ()


Fact = Union[Happened, Position, Joints, Presence, Under, Ended, Cell, Queue]

Heard = Callable[[Fact], None]
"""Called with every fact, in any thread."""


@dataclass(frozen=True)
class Path:
    """A straight path from the robot's position: ("x", "y", "z") in m, or ("a", "b", "c") in rad, m, m."""

    names: tuple[str, str, str]
    points: tuple[tuple[float, float, float], ...]


class Robot(Protocol):
    """A robot whose methods return at once; answers come as facts."""

    def open(self, heard: Heard) -> None:
        """Start listening."""
        ...

    def close(self) -> None:
        """Stop listening, and end the jog."""
        ...

    def home(self) -> None:
        """Find the switches."""
        ...

    def perform(self, task: Task) -> None:
        """Do a task now; refused while another command is under way."""
        ...

    def gripper(self, open_: bool) -> None:
        """Open or close the gripper now."""
        ...

    def stop(self) -> None:
        """Stop all motion on its path, ahead of everything that waits."""
        ...

    def recover(self) -> None:
        """Clear a fault; moves nothing."""
        ...

    def pause(self) -> None:
        """Brake on the path and hold."""
        ...

    def resume(self) -> None:
        """Continue after a pause."""
        ...

    def speed(self, ratio: float) -> None:
        """Scale the speed of all motion, 0.01 to 1."""
        ...

    def jog(self, path: Path) -> None:
        """Follow a short path, until its end or `end_jog`."""
        ...

    def end_jog(self) -> None:
        """Come to rest on the path of the jog."""
        ...

    def send(self, task: Task) -> None:
        """Append a task to the queue of the process layer."""
        ...

    def start_queue(self, tasks: Sequence[Task]) -> None:
        """Append tasks to the queue of the process layer as one job."""
        ...

    def stop_queue(self) -> None:
        """Stop all motion and cancel all jobs in the queue of the process layer."""
        ...

    def resume_queue(self) -> None:
        """Continue the paused queue of the process layer."""
        ...

    def recover_queue(self, choice: Choice) -> None:
        """Decide about the interrupted job."""
        ...
