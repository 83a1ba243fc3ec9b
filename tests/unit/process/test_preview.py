from __future__ import annotations

import pytest

from maya_un.process.outlook import Course, preview_tasks
from maya_un.process.spec.job import Job
from maya_un.process.spec.tasks import expand
from maya_un.robot.robot import MayaRobot
from maya_un.schema.previews import JobPreview
from tests.fakes import FakeController
from tests.generators import finished


async def previewed(controller: FakeController, *steps: object, repeat: int = 1) -> JobPreview:
    robot = MayaRobot(controller, controller.config)
    tasks = expand(Job.parse({"steps": list(steps), "repeat": repeat}), controller.config.cell.grasp_height).tasks
    return finished(preview_tasks(robot, tasks, Course((robot.pose,)))).preview


async def test_a_preview_adds_up_its_steps() -> None:
    controller = FakeController()
    preview = await previewed(controller, {"pick": [0.5, 1.1]}, {"place": [1.1, 0.5]})
    assert preview.refusal is None
    assert preview.duration == pytest.approx(sum(step.duration or 0.0 for step in preview.steps))
    for step in preview.steps:
        assert step.duration == pytest.approx(sum(phase.duration or 0.0 for phase in step.phases))
    assert preview.lowest == pytest.approx(0.4, abs=1e-5)
    assert preview.highest == pytest.approx(controller.state.point.z if controller.state.point else 0.0)
    assert preview.steps[-1].end_counts is not None
    assert controller.calls == []


async def test_a_refusal_names_the_step_and_ends_the_preview() -> None:
    preview = await previewed(FakeController(), "home", {"pick": [0.5, 1.1]}, {"pick": [0.5, 1.1]}, "home")
    assert preview.refusal is not None
    assert (preview.refusal.index, preview.refusal.key, preview.refusal.notice.code) == (3, "steps.2", 3001)
    assert [step.step for step in preview.steps] == ["home", "pick 0.5 1.1"]


async def test_rounds_that_repeat_are_worked_out_once() -> None:
    controller = FakeController()
    await previewed(controller, {"pick": [0.5, 1.1]}, {"place": [0.5, 1.1]}, repeat=2)
    few = controller.previews
    again = FakeController()
    await previewed(again, {"pick": [0.5, 1.1]}, {"place": [0.5, 1.1]}, repeat=200)
    assert again.previews == few
