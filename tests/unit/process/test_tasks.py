from __future__ import annotations

from typing import Any

import pytest

from maya_un.errors import InvalidJob, UnknownName
from maya_un.process.spec.job import Job
from maya_un.process.spec.tasks import Expansion, expand, single
from maya_un.robot.primitives import Approach, Gripper, Home, MoveJoints, Pick, Place
from maya_un.values import Joints, Point

CUBE, TRAY, BIN = Point(0.5, 1.1, 0.4), Point(1.1, 0.5, 0.4), Point(0.9, 0.9, 0.4)


def expanded(*steps: Any, repeat: int = 1) -> Expansion:
    places = {"tray": TRAY[:2], "bin": BIN[:2]}
    data = {"parts": {"cube": CUBE[:2]}, "places": places, "steps": list(steps), "repeat": repeat}
    return expand(Job.parse(data), 0.4)


def test_names_become_points() -> None:
    tasks = expanded("home", {"pick": "cube"}, {"place": "tray"}, {"approach": "bin"}).tasks
    assert [task.action for task in tasks] == [Home(), Pick(CUBE), Place(TRAY), Approach(BIN)]


def test_steps_without_names_are_unchanged() -> None:
    tasks = expanded({"gripper": "open"}, {"gripper": "close"}, {"move": [0.4, 1.6, 1.3]}).tasks
    assert [task.action for task in tasks] == [Gripper(True), Gripper(False), MoveJoints(Joints(0.4, 1.6, 1.3))]


def test_placed_part_is_at_its_place() -> None:
    done = expanded({"pick": "cube"}, {"place": "tray"}, {"pick": "cube"}, {"place": "bin"})
    assert [task.action for task in done.tasks] == [Pick(CUBE), Place(TRAY), Pick(TRAY), Place(BIN)]
    assert done.parts == {"cube": BIN}


def test_part_is_also_found_by_its_place() -> None:
    done = expanded({"pick": "cube"}, {"place": "tray"}, {"pick": "tray"}, {"place": "bin"})
    assert done.parts == {"cube": BIN}


def test_repeated_job_continues_with_the_parts_in_place() -> None:
    tasks = expanded({"pick": "cube"}, {"place": "tray"}, repeat=3).tasks
    assert [task.action for task in tasks] == [Pick(CUBE), Place(TRAY), *(Pick(TRAY), Place(TRAY)) * 2]
    assert [task.index for task in tasks] == [1, 2, 3, 4, 5, 6]
    assert tasks[-1].key == "steps.1"


def test_a_dropped_part_is_lost() -> None:
    assert expanded({"pick": "cube"}, {"gripper": "open"}).parts == {"cube": None}
    with pytest.raises(InvalidJob) as caught:
        expanded({"pick": "cube"}, {"gripper": "open"}, {"pick": "cube"})
    assert caught.value.details["key"] == "steps.2.pick"


def test_task_lists_its_effects_on_the_parts() -> None:
    steps = ({"pick": "cube"}, {"approach": "tray"}, {"place": "tray"}, {"pick": "tray"}, {"gripper": "open"}, "home")
    parts = [(task.part, task.put) for task in expanded(*steps).tasks]
    assert parts == [("cube", None), (None, None), ("cube", TRAY), ("cube", None), ("cube", None), (None, None)]


def test_an_unknown_name_lists_the_known_ones() -> None:
    with pytest.raises(UnknownName, match=r"'cub'.*cube, tray, bin"):
        expanded({"pick": "cub"})


def test_direct_command_is_one_task_named_after_itself() -> None:
    labels = [single(primitive).tasks[0].label for primitive in (Home(), Pick(CUBE), Gripper(True))]
    assert labels == ["home", "pick 0.5 1.1 0.4", "gripper open"]
