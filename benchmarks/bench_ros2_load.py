"""The CPU time that ROS 2 costs `maya up` in a second, with homed robots at rest.

Measured are `maya up` without ROS 2, with it, and with 20 readers of /joint_states and of /maya_position, which
together are 100 messages in a second. Homing comes first, and takes four minutes.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from statistics import median

from harness import Case, in_a_second, measure, report
from ros2_peer import running, use_loopback
from service import service

from maya_un.client import Client

READERS = 20
SECONDS = 2.0
"""How long one sample of CPU time lasts."""


def home(url: str) -> None:
    """Home a robot, so that it publishes where it is."""
    with Client(url) as robot:
        robot.home()


def main() -> None:
    use_loopback()
    with service("--ros2") as robot:
        with_ros = in_a_second(robot.pid, SECONDS)
        with service() as plain:
            with ThreadPoolExecutor() as both:
                list(both.map(home, (robot.url, plain.url)))
            cases = [Case("maya up at rest, CPU in a second", in_a_second(plain.pid, SECONDS), "ms"),
                     Case("with --ros2", with_ros, "ms")]  # fmt: skip
            figures = measure(cases, 5, by=median)
        with running("reads", str(READERS)) as readers:
            assert readers.stdout is not None
            readers.stdout.readline()
            figures += measure([Case(f"with {READERS} readers of two topics of 50 Hz", with_ros, "ms")], 5, by=median)
    report(figures)


if __name__ == "__main__":
    main()
