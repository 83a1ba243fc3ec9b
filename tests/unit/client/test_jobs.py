"""Jobs as a client takes them."""

from __future__ import annotations

from pathlib import Path
from typing import Any, cast

import pytest

from maya_un import JobBuilder
from maya_un.client.jobs import body_of
from maya_un.errors import FileUnreadable, InvalidJob
from maya_un.process.spec.job import Job
from maya_un.process.spec.tasks import expand

BUILT = JobBuilder("two cubes").part("left", 0.5, 1.1).spot("tray", 1.1, 0.5, 0.4).home().pick("left").place("tray")


def test_built_job_equals_the_one_of_a_file() -> None:
    assert BUILT.body() == {
        "name": "two cubes",
        "parts": {"left": [0.5, 1.1]},
        "places": {"tray": [1.1, 0.5, 0.4]},
        "steps": ["home", {"pick": "left"}, {"place": "tray"}],
        "repeat": 1,
    }
    assert [task.label for task in expand(Job.parse(BUILT.body()), 0.4).tasks] == ["home", "pick left", "place tray"]


def test_first_steps_can_be_used_twice() -> None:
    assert BUILT.gripper("open").steps[:3] == BUILT.steps
    assert len(BUILT.steps) == 3


def test_every_step_and_a_loop_over_a_pallet() -> None:
    corners = [[0.3, 1.0], [0.5, 1.0], [0.3, 1.2]]
    job = (
        JobBuilder("all")
        .pallet("box", corners, 2, 2, full=True)
        .for_each("box", JobBuilder().pick("box[each]").gripper("open"))
        .approach((0.5, 1.1))
        .line([0.5, 1.1, 0.6])
        .move((0.5, 1.7, 1.7))
        .repeat(2)
    )
    tasks = expand(Job.parse(job.body()), 0.4).tasks
    assert len(tasks) == 2 * (4 * 2 + 3)


def test_file_mapping_and_parsed_job_are_equivalent(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text("steps: [home, {pick: [0.5, 1.1]}]\n", encoding="utf-8")
    body = body_of(file)
    assert body["name"] == "mine"
    assert Job.parse(body_of(str(file))) == Job.parse(body) == Job.parse(body_of(Job.parse(body)))
    assert body_of({"steps": ["home"]}) == {"steps": ["home"]}


def test_missing_file_is_reported_at_once(tmp_path: Path) -> None:
    with pytest.raises(FileUnreadable, match="No such file"):
        body_of(tmp_path / "nothing.yaml")


def test_object_that_is_no_job_is_refused_by_its_type() -> None:
    with pytest.raises(InvalidJob) as refused:
        body_of(cast("Any", object()))
    assert "object is no job" in str(refused.value)
