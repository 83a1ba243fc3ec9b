"""How long motions take, computed in a worker process."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from maya_ros.graph.timing import MotionTimer
from maya_un.assembly.staff import PEOPLE_BOUNDS, staffed
from maya_un.config import Config
from maya_un.controller.homing import homed_pose
from maya_un.controller.planner import MOST_SEGMENTS, OfflineMachine, Planner
from maya_un.controller.protocol import Preview
from maya_un.errors import TooMuchAsked, TrajectoryRefused, Unreachable
from maya_un.kinematics.mechanism import Mechanism
from maya_un.kinematics.workspace import Workspace
from maya_un.motion.path import Path, Route
from maya_un.service.computing import Computing

CONFIG = Config()
HOME = homed_pose(CONFIG)
WAY = Path.joints(HOME, HOME._replace(a=0.5))


class Robot(OfflineMachine):
    """A robot that moves with a share of its speeds, and counts the previews in this process."""

    def __init__(self, share: float = 1.0) -> None:
        super().__init__(CONFIG, Workspace.of(CONFIG), Planner(CONFIG, Mechanism.of(CONFIG)))
        self.share = share
        self.previews = 0

    def allowed(self, speed: float) -> float:
        """Return the allowed speed."""
        return self.share * speed

    def preview(self, path: Route, *, speed: float = 1.0) -> Preview:
        """Count, and preview as the robot does."""
        self.previews += 1
        return super().preview(path, speed=self.allowed(speed))


@contextmanager
def in_worker(robot: Robot) -> Iterator[MotionTimer]:
    with staffed(CONFIG) as staff:
        yield MotionTimer(robot, Computing(staff.people))


@pytest.mark.parametrize("share", [1.0, 0.25])
async def test_worker_finds_what_the_robot_finds_and_nothing_is_computed_here(share: float) -> None:
    robot, here = Robot(share), MotionTimer(Robot(share), Computing(None))
    with in_worker(robot) as timer:
        duration = await timer.duration(WAY)
        assert duration == await here.duration(WAY)
        speed = await timer.speed_for(WAY, 3.0 * duration)
        assert speed == await here.speed_for(WAY, 3.0 * duration)
        assert 0.2 < speed < 0.5
        with pytest.raises(Unreachable):
            await timer.duration(Path.joints(HOME, HOME._replace(b=0.1)))
    assert robot.previews == 0


async def test_path_without_a_duration_or_with_too_many_points_asks_no_worker() -> None:
    robot = Robot()
    with staffed(CONFIG) as staff:
        timer = MotionTimer(robot, Computing(staff.people))
        assert await timer.speed_for(WAY, 0.0) == 1.0
        long = Path.joints(*[HOME, HOME._replace(a=0.5)] * MOST_SEGMENTS)
        for refused in (timer.duration(long), timer.speed_for(long, 5.0)):
            with pytest.raises(TrajectoryRefused):
                await refused
        assert staff.people.process is None


async def test_client_has_few_requests_at_once() -> None:
    with in_worker(Robot()) as timer:
        asked = (timer.duration(WAY) for _ in range(PEOPLE_BOUNDS.each + 1))
        *answers, refused = await asyncio.gather(*asked, return_exceptions=True)
        assert isinstance(refused, TooMuchAsked)
        assert all(isinstance(answer, float) for answer in answers)
