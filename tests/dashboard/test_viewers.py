"""Many people look on while the robot works: it works as fast as if it were alone."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from maya_un.machine.log import PartDrop, Place, Window
from tests.dashboard.inside import Options, TwinService, twin_service
from tests.dashboard.services import Service, service
from tests.dashboard.viewers import looking_on

SPEED = 10.0
VIEWERS, STALLED = 30, 5
ATTEMPTS = 4

JOB = {"name": "to and fro", "steps": [{"move": place} for place in ([0.8, 1.45, 1.5], [1.1, 1.5, 1.45])]}
"""It ends where it begins, so it takes as long each time."""


class MotionTimes:
    """Notes in the mechanics when the axes move: no other part of the program can change it."""

    def __init__(self) -> None:
        self.spans: list[list[float]] = []
        self._until = 0.0

    def added(self, window: Window) -> None:
        """Take the window of a further stretch of time, which ends where the next one begins."""
        if self.spans and self.spans[-1][1] == 0.0:
            self.spans[-1][1] = window.since
        if window.low != window.high:
            self.spans.append([window.since, 0.0])

    def held(self, axes: tuple[bool, ...]) -> None:
        """No obstacle stands in the way of these axes."""

    def gripped(self, name: str) -> None:
        """No part is taken."""

    def released(self, name: str, place: Place, drop: PartDrop | None) -> None:
        """No part is released."""


@pytest.fixture
def alone(tmp_path: Path) -> Iterator[TwinService]:
    """Return a homed robot with the usual configuration."""
    (tmp_path / "maya.toml").write_text("", encoding="utf-8")
    with twin_service(tmp_path, Options(SPEED)) as made:
        yield made


@pytest.fixture
def other(tmp_path: Path) -> Iterator[Service]:
    """Return a robot in a process of its own."""
    folder = tmp_path / "other"
    folder.mkdir()
    with service(folder, "--journal memory") as made:
        yield made


def times_of_job(robot: TwinService) -> tuple[float, float]:
    """Carry the job out; return how long the axes moved, and how long the job took, by the mechanics [s]."""
    times = MotionTimes()
    robot.truth(lambda twin: twin.mechanics.listen(times))
    job = robot.ask("POST /v1/jobs", JOB)["id"]
    robot.until(lambda report: report["state"] == "done", f"/v1/jobs/{job}")
    robot.require_rest()
    moved = sum(end - begin for begin, end in times.spans)
    return moved, times.spans[-1][1] - times.spans[0][0]


def test_a_job_takes_as_long_with_thirty_viewers_and_five_that_stall(alone: TwinService, other: Service) -> None:
    """The viewers look at this robot, or at another one: the machine is as busy then."""
    times_of_job(alone)
    without: list[tuple[float, float]] = []
    looked_on: list[tuple[float, float]] = []
    for _ in range(ATTEMPTS):
        for port, times in ((other.port, without), (alone.port, looked_on)):
            with looking_on(port, VIEWERS, STALLED):
                times.append(times_of_job(alone))
        if no_later(looked_on, without):
            return
    raise AssertionError(f"viewers delay the job: {looked_on}, and without them {without}")


def no_later(looked_on: list[tuple[float, float]], without: list[tuple[float, float]]) -> bool:
    """Return whether a job with viewers moved no longer than the slowest without, and ended no later."""
    least, most = (tuple(map(best, zip(*times, strict=True))) for best, times in ((min, looked_on), (max, without)))
    return least[0] < 1.01 * most[0] and least[1] < 1.02 * most[1]
