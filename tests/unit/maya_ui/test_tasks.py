from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from maya_ui.tasks import MOST_TASKS, BadJob, Task, TaskList, job_tasks, job_text

from maya_un.process.spec.job import load_job

HOME = Task("home")
PICK = Task("pick", (0.41, 1.13, 0.4))
PLACE = Task("place", (1.18, 0.21, 0.4))
OPEN = Task("gripper", open=True)
ALL = [HOME, PICK, PLACE, Task("approach", (0.5, 1.0, 0.6)), OPEN, Task("gripper")]


def test_a_task_is_moved_up_and_down_and_taken_away() -> None:
    tasks = TaskList([HOME, PICK, PLACE])
    assert tasks.move(2, -1) == 1
    assert list(tasks) == [HOME, PLACE, PICK]
    assert tasks.move(0, -1) == 0
    assert tasks.move(2, 1) == 2
    tasks.remove(1)
    tasks.remove(7)
    assert list(tasks) == [HOME, PICK]
    assert tasks.add(OPEN) == 2


def test_a_list_is_not_endless() -> None:
    tasks = TaskList([HOME] * MOST_TASKS)
    with pytest.raises(BadJob):
        tasks.add(HOME)
    assert len(tasks) == MOST_TASKS


def test_saved_list_is_loaded_again() -> None:
    assert job_tasks(job_text(ALL, "a list: with #signs")) == ALL


def test_saved_list_is_a_job_of_maya_run(tmp_path: Path) -> None:
    path = tmp_path / "list.yaml"
    path.write_text(job_text(ALL, "évery kind"), encoding="utf-8")
    job = load_job(path)
    assert job.name == "évery kind"
    assert [str(step) for step in job.steps][:3] == ["home", "pick 0.41 1.13 0.4", "place 1.18 0.21 0.4"]


def test_the_first_example_is_read_with_the_grasp_height_of_the_robot() -> None:
    text = (Path(__file__).parents[3] / "examples" / "01_pick_and_place.yaml").read_text(encoding="utf-8")
    assert job_tasks(text, 0.4) == [HOME, PICK, PLACE]
    with pytest.raises(BadJob) as bad:
        job_tasks(text)
    assert bad.value.key == "job_height_unknown"


def test_a_job_that_is_repeated_is_written_out() -> None:
    assert job_tasks("steps: [home, {gripper: open}]\nrepeat: 2") == [HOME, OPEN, HOME, OPEN]


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("{", "job_unreadable"),
        ("steps: []", "job_without_steps"),
        ("- home", "job_without_steps"),
        ("steps: [home]\nrepeat: 0", "job_too_long"),
        ("steps: [home]\nrepeat: 20000", "job_too_long"),
        ("steps: [{line: [1, 1, 1]}]", "job_step_unknown"),
        ("steps: [{pick: [1, 1, 1], place: [1, 1, 1]}]", "job_step_unknown"),
        ("steps: [3]", "job_step_unknown"),
        ("steps: [{gripper: wide}]", "job_step_unknown"),
        ("steps: [{pick: cube}]", "job_place_unknown"),
        ("steps: [{pick: [1, 2]}]", "job_height_unknown"),
        ("steps: [{pick: [1, 2, 3, 4]}]", "job_place_unreadable"),
        ("steps: [{pick: [1, 2, .nan]}]", "job_place_unreadable"),
        (f"steps: [{{pick: [1, 2, 1{400 * '0'}]}}]", "job_place_unreadable"),
        ("steps: [{pick: [1, 2, true]}]", "job_place_unreadable"),
        ("parts: [a]\nsteps: [home]", "job_unreadable"),
    ],
)
def test_a_file_that_no_list_can_be_made_of_says_why(text: str, key: str) -> None:
    with pytest.raises(BadJob) as bad:
        job_tasks(text)
    assert bad.value.key == key


@pytest.mark.parametrize("text", ["!!python/object/apply:os.system [id]", "steps: [!!python/name:os.system '']"])
def test_nothing_in_a_file_is_executed(text: str) -> None:
    with pytest.raises(BadJob):
        job_tasks(text)


def test_names_of_parts_and_places_are_looked_up() -> None:
    job: Any = (
        "parts: {cube: [0.41, 1.13, 0.4]}\nplaces: {tray: [1.18, 0.21, 0.4]}\nsteps: [{pick: cube}, {place: tray}]"
    )
    assert job_tasks(job) == [PICK, PLACE]
