from __future__ import annotations

import numpy as np
import pytest

from maya_un.process.outlook import Course
from maya_un.process.outlook import inspect_tasks as worked_out
from maya_un.process.spec.job import Job
from maya_un.process.spec.tasks import expand
from maya_un.robot.robot import MayaRobot
from maya_un.schema.previews import JobInspection
from tests.fakes import FakeController
from tests.generators import finished

STEPS: list[object] = [{"pick": [0.41, 1.13]}, {"place": [1.18, 0.21]}]


async def inspected(steps: list[object], samples: int = 50) -> JobInspection:
    controller = FakeController()
    robot = MayaRobot(controller, controller.config)
    tasks = expand(Job.parse({"steps": steps}), 0.4).tasks
    return finished(worked_out(robot, tasks, Course((robot.pose,)), samples))


async def test_bands_follow_each_other_and_make_up_the_job() -> None:
    found = await inspected(STEPS)
    assert [band.phase for band in found.bands] == ["approach", "down", "close", "up", "approach", "down", "open", "up"]
    assert [band.step for band in found.bands] == [1, 1, 1, 1, 2, 2, 2, 2]
    assert found.bands[0].start == 0.0
    assert [band.start for band in found.bands[1:]] == pytest.approx([band.end for band in found.bands[:-1]])
    assert found.bands[-1].end == pytest.approx(found.preview.duration)


async def test_motions_join_without_a_jump_and_end_at_the_previewed_place() -> None:
    found = await inspected(STEPS)
    for before, after in zip(found.motions, found.motions[1:], strict=False):
        assert before.joints[-1] == pytest.approx(after.joints[0], abs=1e-9)
        assert before.time[-1] <= after.time[0]
        assert before.velocity[-1] == (0.0, 0.0, 0.0)
    assert all(len(motion.time) == 50 for motion in found.motions)


async def test_the_least_margins_are_those_of_the_samples() -> None:
    found = await inspected(STEPS, samples=5000)
    least = {near.name: near for near in found.closest}
    joints = np.concatenate([np.array(motion.joints) for motion in found.motions])
    shortest = float(joints[:, 1].min()) - 0.575
    assert least["line_b_short"].margin == pytest.approx(shortest, abs=1e-4)
    assert 0.0 < least["tension_b"].margin < 5.0
    assert 0.0 <= least["boom_start"].time <= found.preview.duration


async def test_the_longest_stop_is_at_most_that_of_the_slew_speed() -> None:
    found = await inspected(STEPS)
    assert 0.1 < found.stop_time <= 45_000 / 51_200 + 0.1
    assert 0.0 < found.stop_distance < 0.05


async def test_nothing_is_shown_after_a_refusal() -> None:
    found = await inspected([STEPS[0], {"place": [3.0, 3.0]}])
    assert found.preview.refusal is not None
    assert {band.step for band in found.bands} == {1}


async def test_a_homing_takes_no_known_time() -> None:
    found = await inspected(["home", STEPS[0]])
    assert (found.bands[0].phase, found.bands[0].start, found.bands[0].end) == ("home", 0.0, 0.0)
