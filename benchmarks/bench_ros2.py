"""The cost of ROS 2: a service beside a bare one of the same library, and topics for 20 readers, as CPU time.

Services are called in turns by one process. The bare one is served by a process that has nothing but the library. The
CPU times are those of `maya up` in a second: at rest without ROS 2, with it, and with 20 readers of /joint_states and
of /maya_position, which together are 100 messages in a second.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from pathlib import Path
from statistics import median

from harness import Case, Goal, Sample, in_a_second, measure, report
from service import service

from maya_un.client import Client

CALLS = 200
READERS = 20
SECONDS = 2.0
"""How long one sample of CPU time lasts."""

PEER = str(Path(__file__).with_name("ros2_peer.py"))
LOOPBACK = (
    '<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces></General>'
    '<Discovery><ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers></Discovery>'
    "</Domain></CycloneDDS>"
)
"""Nothing leaves this machine."""


@contextmanager
def peer(*what: str) -> Iterator[subprocess.Popen[str]]:
    """Run a process of `ros2_peer` for the length of the block."""
    command = [sys.executable, PEER, *what]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


def called(caller: subprocess.Popen[str], name: str) -> Sample:
    """Return a sample of the median time of a call [s]."""

    def sample() -> float:
        assert caller.stdin is not None
        assert caller.stdout is not None
        caller.stdin.write(f"{CALLS} {name}\n")
        caller.stdin.flush()
        return float(caller.stdout.readline())

    return sample


def home(url: str) -> None:
    """Home a robot, so that it publishes where it is."""
    with Client(url) as robot:
        robot.home()


def main() -> None:
    os.environ["CYCLONEDDS_URI"] = LOOPBACK
    os.environ["ROS_DOMAIN_ID"] = "97"
    with ExitStack() as held:
        robot = held.enter_context(service("--ros2"))
        held.enter_context(peer("serves"))
        caller = held.enter_context(peer("calls"))
        services = [
            Case("a bare service of the library", called(caller, "/bench/empty")),
            Case(
                "/maya_command can_teleop over ROS 2", called(caller, "/maya_command"),
                goal=Goal(1.5, "a bare service of the library"),
            ),
            Case("/controller/recover, which asks the robot's loop", called(caller, "/controller/recover")),
        ]  # fmt: skip
        figures = measure(services, 9, by=median)
        with_ros = in_a_second(robot.pid, SECONDS)
        with service() as plain:
            with ThreadPoolExecutor() as both:
                list(both.map(home, (robot.url, plain.url)))
            cases = [Case("maya up at rest, CPU in a second", in_a_second(plain.pid, SECONDS), "ms"),
                     Case("with --ros2", with_ros, "ms")]  # fmt: skip
            figures += measure(cases, 5, by=median)
        readers = held.enter_context(peer("reads", str(READERS)))
        assert readers.stdout is not None
        readers.stdout.readline()
        figures += measure([Case(f"with {READERS} readers of two topics of 50 Hz", with_ros, "ms")], 5, by=median)
    report(figures)


if __name__ == "__main__":
    main()
