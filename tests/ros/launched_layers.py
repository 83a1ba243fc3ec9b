"""All layers launched on a separate ROS, fast, with parts on the twin's table; and helpers to use them."""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from maya_ros.graph.protocol import GoalStatus
from maya_ros.graph.table import STEP_COMMAND, STEP_STATUS
from maya_un.errors import Stopped
from tests.ros.driver_client import Driver, Feed, Goal, Message
from tests.ros.harness import Ros
from tests.ros.programs import Program
from tests.ros.workspace import Workspace
from tests.waiting import eventually

FAST = 50
"""Speed of the twin's clock here."""

NODES = ("/hw_simulator", "/robot_controller", "/primitive_server", "/process_controller", "/firebase_bridge")

PARTS: dict[str, tuple[float, float, float]] = {"part": (0.5, 1.2, 0.4)}
"""Parts on the table at the start."""

SLOW = 0.1
"""Share of the speed at which a motion lasts for seconds."""

HERE, THERE = (0.5, 1.2, 0.4), (0.9, 0.9, 0.4)
"""Two places for the part."""


def primitive(command: str, target: tuple[float, float, float] = (0.0, 0.0, 0.0), *, open_: bool = False) -> Message:
    """Return a maya_robot/MayaPrimitive."""
    return {"command": command, "target": dict(zip("xyz", target, strict=True)), "open": open_}


class LaunchedLayers:
    """The layers of one robot, a node that drives them, and their events."""

    def __init__(self, ros: Ros, launched: Program) -> None:
        self.ros = ros
        self.launched = launched
        self.driver: Driver = ros.driver()
        self.events: Feed = self.driver.subscribe("/maya_event", "std_msgs/String")
        self.events.until()

    @property
    def told(self) -> tuple[str, Message]:
        """The last event: its word, and how everything stands."""
        return read_event(self.events.messages[-1])

    def mark(self) -> int:
        """Return the number of events so far."""
        return len(self.events.messages)

    def until_told(self, word: str, after: int = 0) -> Message:
        """Wait for an event and return how everything stands with it."""
        return read_event(self.events.until(lambda message: read_event(message)[0] == word, after=after))[1]

    def words(self, after: int = 0) -> list[str]:
        """Return the words of the events."""
        return [read_event(message)[0] for message in self.events.messages[after:]]

    def twin(self) -> dict[str, Any]:
        """Return what the twin's mechanics know."""
        seen: dict[str, Any] = json.loads(self.driver.call("/hw_simulator/twin")["message"])
        return seen

    def step(self, name: str, place: tuple[float, float, float]) -> str:
        """Send a step of the bridge to approach a place until it is accepted, and return its id.

        After a stop the bridge refuses steps until none has come for a second.
        """
        status = self.driver.subscribe(STEP_STATUS.name, STEP_STATUS.type)
        args = dict(zip("xyz", place, strict=True))
        for number in range(10):
            id_ = f"{name} {number}"
            step = {"id": id_, "command": "approach", "args": args}
            self.driver.publish(STEP_COMMAND.name, STEP_COMMAND.type, {"data": json.dumps(step)})
            with suppress(AssertionError):
                status.until(lambda message: id_ in message["data"], within=5.0)  # noqa: B023 - it ends in this round
                return id_
        raise AssertionError("no step is accepted")

    def home(self) -> None:
        """Home, if that is not done.

        /stop_queue ends what moves, then what waits, and stops again: the second stop may end a homing of just now.
        """
        if not self.told[1]["homed"]:
            goal = self.driver.do("/home", "maya_controller/Home").ended()
            if goal[1]["code"] == str(Stopped.code):
                goal = self.driver.do("/home", "maya_controller/Home").ended()
            assert goal == (GoalStatus.SUCCEEDED, DONE)
            self.until_homed()

    def ready(self) -> None:
        """Bring it to rest, homed, whatever was before."""
        standing = self.told[1]
        if standing["fault"] is not None:
            assert self.driver.call("/controller/recover")["success"]
        self.at_speed(1.0)
        self.home()
        self.until_homed()

    def until_homed(self) -> None:
        """Wait until the upper layers know of a homing too."""
        self.eventually(self.can_teleop, "the robot layer knows that it is homed")

    def can_teleop(self) -> bool:
        """Ask whether the robot is homed and at rest."""
        return bool(self.command("can_teleop")["success"])

    def command(
        self, command: str, target: tuple[float, float, float] = (0.0, 0.0, 0.0), *, open_: bool = False
    ) -> Message:
        """Return what /maya_command answers."""
        return self.driver.call("/maya_command", {"task": primitive(command, target, open_=open_)})

    def task(self, command: str, target: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Goal:
        """Send a goal to /task."""
        return self.driver.do("/task", "maya_robot/Task", {"task": primitive(command, target)})

    def begun(self, command: str = "approach", target: tuple[float, float, float] = THERE) -> Goal:
        """Send a goal to /task and return it when its motion has begun."""
        before = self.mark()
        goal = self.task(command, target)
        self.until_told("homing" if command == "home" else "moving", before)
        return goal

    def moving(self) -> int:
        """Have the robot move, so slowly that it outlasts the start of a node or the end of a master.

        Return the number of earlier messages.
        """
        self.at_speed(0.01)
        before = self.mark()
        self.begun("approach", self.away())
        return before

    def away(self) -> tuple[float, float, float]:
        """Return the one of the two places that is farther from the gripper, for a motion that lasts."""
        x, y, _ = self.twin()["point"]
        return max(HERE, THERE, key=lambda place: (place[0] - x) ** 2 + (place[1] - y) ** 2)

    def at_rest(self) -> None:
        """Wait until the axes stand still, as the mechanics have it."""
        seen = [self.twin()["joints"]]

        def stands() -> bool:
            seen.append(self.twin()["joints"])
            return len(seen) > 3 and seen[-1] == seen[-2] == seen[-3]

        self.eventually(stands, "at rest")

    def at_speed(self, ratio: float) -> None:
        """Scale the speed of all motion, where it is another now."""
        if self.told[1]["override"] != ratio:
            before = self.mark()
            self.driver.publish("/controller/speed", "std_msgs/Float64", {"data": ratio})
            self.until_told("speed", before)

    def kill(self, node: str) -> None:
        """End a node as a crash would."""
        os.kill(self.ros.process(node), signal.SIGKILL)

    @contextmanager
    def frozen(self, node: str) -> Iterator[None]:
        """Have a node hang while the block runs."""
        pid = self.ros.process(node)
        os.kill(pid, signal.SIGSTOP)
        try:
            yield
        finally:
            os.kill(pid, signal.SIGCONT)

    def eventually(self, fact: Any, what: str) -> None:
        """Wait until something is so."""
        eventually(fact, what, told=lambda: self.launched.said)

    def unharmed(self) -> None:
        """Fail where the mechanics saw something that must not be."""
        seen = self.twin()
        assert seen["tension"] <= 6.0
        assert seen["drops"] == 0
        assert seen["slack"] <= 0.25


def read_event(message: Message) -> tuple[str, Message]:
    """Return the word of an event, and how everything stands."""
    word, _, rest = str(message["data"]).partition(" ")
    return word, json.loads(rest)


def _done() -> Message:
    return {"success": True, "code": "", "message": ""}


DONE = _done()
"""The result of what succeeded."""


def near(one: Any, other: Any, within: float = 0.002) -> bool:
    """Tell whether two places are the same to so many metres."""
    return all(abs(a - b) <= within for a, b in zip(one, other, strict=True))


@contextmanager
def launched_layers(
    folder: Path, workspace: Workspace, environment: Mapping[str, str] | None = None, **arguments: Any
) -> Iterator[LaunchedLayers]:
    """Launch all layers for as long as the block runs; `environment` is laid over that of the launch."""
    with Ros(folder, workspace) as ros:
        ros.set_param("/maya/parts", {name: list(place) for name, place in PARTS.items()})
        launched = ros.launch("maya_process", "process.launch", environment=environment, **{"speed": FAST, **arguments})
        ros.until_nodes(*NODES)
        launched.until("The queue is worked")
        yield LaunchedLayers(ros, launched)
