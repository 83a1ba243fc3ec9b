"""A job as it is kept comes to what it came to when it was accepted, whatever is taught or forgotten since."""

from __future__ import annotations

import json

import pytest

from maya_un.errors import InvalidRequest, UnknownName
from maya_un.process.spec.job import Grid, Job
from maya_un.process.spec.poses import TaughtPallet, TaughtPlaces
from maya_un.process.spec.stored import as_written, expanded, write_command, write_job
from maya_un.process.spec.tasks import Action
from maya_un.robot.primitives import Home, Pick
from maya_un.schema.jobs import TaughtPose
from maya_un.values import Joints, Point

HEIGHT = 0.4


def pose(name: str, x: float, y: float) -> TaughtPose:
    return TaughtPose(name, Joints(0.1, 1.5, 1.5), Point(x, y, 0.4), "2026-01-01")


BOOK = TaughtPlaces(
    {one.name: one for one in (pose("shelf", 0.5, 1.1), pose("corner", 0.3, 1.0), pose("edge", 0.6, 1.0))},
    {"box": TaughtPallet("box", Grid(corners=("corner", "edge", (0.3, 1.2)), rows=2, columns=2), "2026-01-01")},
)

JOB = {
    "name": "night",
    "steps": [
        {"move": "shelf"},
        {"pick": "shelf"},
        {"for_each": "box", "do": [{"approach": "box[each]"}]},
        {"place": [0.5, 1.1]},
    ],
}


def primitives(body: dict[str, object]) -> list[Action]:
    """Return what a body comes to after it has been in a file."""
    return [task.action for task in expanded(json.loads(json.dumps(body)), HEIGHT).tasks]


def test_names_are_stored_with_the_job() -> None:
    written = write_job(Job.parse(JOB), HEIGHT, lambda: BOOK)
    assert set(written.body["taught"]["poses"]) == {"shelf", "corner", "edge"}
    assert set(written.body["taught"]["pallets"]) == {"box"}
    assert primitives(written.body) == [task.action for task in written.expansion.tasks]
    assert len(written.expansion.tasks) == 7


def test_job_without_taught_names_is_stored_as_is_without_the_pose_store() -> None:
    def broken() -> TaughtPlaces:
        raise AssertionError("nobody asked for it")

    plain = {"steps": ["home", {"pick": [0.5, 1.1]}], "repeat": 2}
    written = write_job(Job.parse(plain), HEIGHT, broken)
    assert written.body == {"steps": [{"home": True}, {"pick": [0.5, 1.1]}], "repeat": 2}
    assert primitives(written.body) == [Home(), Pick(Point(0.5, 1.1, 0.4))] * 2


def test_shown_job_is_the_written_one() -> None:
    written = write_job(Job.parse(JOB), HEIGHT, lambda: BOOK)
    assert Job.parse(as_written(written.body)) == Job.parse(JOB)


@pytest.mark.parametrize(
    "command", [{"command": "home"}, {"command": "pick", "target": [0.5, 1.1]}, {"command": "gripper", "open": True}]
)
def test_command_is_stored_with_its_numbers(command: dict[str, object]) -> None:
    written = write_command(command, HEIGHT, TaughtPlaces)
    assert primitives(written.body) == [task.action for task in written.expansion.tasks]
    assert written.name == command["command"]


def test_command_for_a_taught_place_is_stored_with_the_place() -> None:
    written = write_command({"command": "pick", "target": "shelf"}, HEIGHT, lambda: BOOK)
    assert as_written(written.body) == {"wish": {"command": "pick", "target": "shelf"}}
    assert primitives(written.body) == [Pick(Point(0.5, 1.1, 0.4))]


def test_invalid_command_is_refused() -> None:
    with pytest.raises(InvalidRequest):
        write_command({"command": "pick"}, HEIGHT, TaughtPlaces)
    with pytest.raises(UnknownName):
        write_command({"command": "pick", "target": "moon"}, HEIGHT, TaughtPlaces)
