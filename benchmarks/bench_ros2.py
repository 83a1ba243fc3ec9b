"""The time of a call of a ROS 2 service, beside that of a bare service of the same library.

Services are called in turns by one process. The bare one is served by a process that has nothing but the library.
"""

from __future__ import annotations

import subprocess
from statistics import median

from harness import Case, Goal, Sample, measure, report
from ros2_peer import running, use_loopback
from service import service

CALLS = 200


def called(caller: subprocess.Popen[str], name: str) -> Sample:
    """Return a sample of the median time of a call [s]."""

    def sample() -> float:
        assert caller.stdin is not None
        assert caller.stdout is not None
        caller.stdin.write(f"{CALLS} {name}\n")
        caller.stdin.flush()
        return float(caller.stdout.readline())

    return sample


def main() -> None:
    use_loopback()
    with service("--ros2"), running("serves"), running("calls") as caller:
        cases = [
            Case("a bare service of the library", called(caller, "/bench/empty")),
            Case(
                "/maya_command can_teleop over ROS 2", called(caller, "/maya_command"),
                goal=Goal(1.5, "a bare service of the library"),
            ),
            Case("/controller/recover, which asks the robot's loop", called(caller, "/controller/recover")),
        ]  # fmt: skip
        report(measure(cases, 9, by=median))


if __name__ == "__main__":
    main()
