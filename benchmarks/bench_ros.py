"""The cost of the nodes: a launch, a service that is answered from the snapshot, and the position 50 times a second.

/maya_command can_teleop is called in turns with an empty service of rospy's own, by one process: over a connection that
is kept, and over a new one for every call. The servers are bound to one CPU, the caller to another. The cost of
the position is the CPU time, in a second, of a node that sends only it and /joint_states to one listener.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from harness import Case, Goal, Sample, in_a_second, measure, report

from tests.ros import workspace
from tests.ros.harness import Ros
from tests.ros.programs import Program

CALLS = 200
SECONDS = 2.0
"""How long one sample of the position lasts."""

PEER = str(Path(__file__).with_name("ros_peer.py"))


def pinned(pid: int, cpu: int) -> None:
    """Bind all threads of a process, and those they will begin, to a CPU."""
    for thread in Path(f"/proc/{pid}/task").iterdir():
        with suppress(ProcessLookupError):  # it has ended
            os.sched_setaffinity(int(thread.name), {cpu})


@contextmanager
def robot() -> Iterator[Ros]:
    """Have a ROS with the robot layer on the twin, in real time."""
    with TemporaryDirectory() as folder, Ros(Path(folder), workspace.provide(), cold=True) as ros:
        launched = ros.launch("maya_robot", "robot.launch", speed=1)
        launched.until("The robot layer is offered")
        yield ros


def launched() -> float:
    """Return the time from roslaunch, its master included, until the robot layer is offered [s]."""
    start = time.perf_counter()
    with robot():
        return time.perf_counter() - start


def peer(ros: Ros, what: str) -> Program:
    """Start a process of `ros_peer`."""
    program = ros.start(str(workspace.python()), PEER, what)
    program.until("ready")
    return program


def called(caller: Program, answers: Iterator[str], service: str, how: str) -> Sample:
    """Return a sample of the time that a call takes, which `caller` says in its next line."""

    def sample() -> float:
        caller.write(f"{CALLS} {service} {how}")
        return float(next(answers))

    return sample


def main() -> None:
    reason = workspace.missing()
    if reason is not None:
        print(f"left out: {reason}", file=sys.stderr)
        return
    figures = measure([Case("robot.launch, ready", launched, "s", Goal(8.0))], 3)
    with robot() as ros:
        empty, caller = peer(ros, "empty"), peer(ros, "calls")
        answers = caller.follow()
        while "ready" not in next(answers):
            pass
        cpus = sorted(os.sched_getaffinity(0))
        pinned(ros.process("/robot_controller"), cpus[0])
        pinned(empty.pid, cpus[0])
        pinned(caller.pid, cpus[-1])
        cases = [
            Case("an empty service, kept", called(caller, answers, "/bench/empty", "kept")),
            Case(
                "/maya_command can_teleop, kept", called(caller, answers, "/maya_command", "kept"),
                goal=Goal(1.5, "an empty service, kept"),
            ),
            Case("an empty service, new", called(caller, answers, "/bench/empty", "new")),
            Case(
                "/maya_command can_teleop, new", called(caller, answers, "/maya_command", "new"),
                goal=Goal(1.5, "an empty service, new"),
            ),
        ]  # fmt: skip
        figures += measure(cases, 15, by=median)
    with TemporaryDirectory() as folder, Ros(Path(folder), workspace.provide(), cold=True) as ros:
        sensors = peer(ros, "sensors")
        peer(ros, "listens")
        cost = in_a_second(sensors.pid, SECONDS)
        cases = [Case("/maya_position at 50 Hz, CPU in a second", cost, "ms", Goal(50.0))]
        figures += measure(cases, 5, by=median)
    report(figures)


if __name__ == "__main__":
    main()
