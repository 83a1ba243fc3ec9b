from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from maya_un.errors import FileUnreadable, InvalidProcess
from maya_un.supervisor.process import load_process

HOME = {"id": "a", "robot": "MAYA", "command": "home"}


def written(folder: Path, *steps: object, **more: Any) -> Path:
    path = folder / "process.json"
    path.write_text(json.dumps({"steps": list(steps), **more}))
    return path


def test_a_process_is_read_from_yaml(tmp_path: Path) -> None:
    path = tmp_path / "hand over.yaml"
    path.write_text(
        "deadline: 5\nsteps:\n"
        "  - {id: 1, robot: MAYA, command: pick, args: {x: 0.5, y: 1.1, z: 0.4}}\n"
        "  - {id: 2, robot: MAYA2, command: home, after: [1]}\n"
    )
    process = load_process(path)
    assert (process.name, process.deadline, list(process.steps)) == ("hand over", 5.0, ["1", "2"])
    assert process.steps["2"].after == ("1",)
    assert process.steps["1"].args == {"x": 0.5, "y": 1.1, "z": 0.4}


@pytest.mark.parametrize(
    ("steps", "words"),
    [
        ([], "a list of steps"),
        (["home"], "an object"),
        ([HOME | {"after": ["b"]}], "there is no step b"),
        ([HOME | {"after": ["b"]}, HOME | {"id": "b", "after": ["a"]}], "wait for each other: a -> b -> a"),
        ([HOME | {"after": ["a"]}], "wait for each other"),
        ([HOME, HOME], "two steps"),
        ([HOME | {"command": "dance"}], "dance"),
        ([HOME | {"command": "pick"}], r"args\.x"),
        ([HOME | {"command": "gripper", "args": {"open": "yes"}}], "true or false"),
        ([HOME | {"command": "pick", "args": {"x": 1e9, "y": 1, "z": 1}}], "10000"),
        ([HOME | {"args": {"speed": 2}}], "no arguments"),
        ([HOME | {"args": [1]}], "an object"),
        ([HOME | {"robot": "MAYA/2"}], "must not"),
        ([HOME | {"robot": ""}], "printable"),
        ([HOME | {"when": "now"}], "'when' is not known"),
        ([{"id": "a", "command": "home"}], "robot is missing"),
        ([HOME | {"after": "b"}], "a list of ids"),
    ],
)
def test_a_process_that_cannot_end_is_refused_whole(tmp_path: Path, steps: list[object], words: str) -> None:
    with pytest.raises(InvalidProcess, match=words):
        load_process(written(tmp_path, *steps))


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("{id: a, robot: R, command: pick, args: {x: NUMBER, y: 1, z: 1}}", r"args\.x = 0xfff"),
        ("{id: a, robot: R, command: gripper, args: {open: NUMBER}}", r"args\.open = 0xfff"),
        ("{id: NUMBER, robot: R, command: home}", "1 to 64"),
        ("{id: a, robot: R, command: home, after: [NUMBER]}", "1 to 64"),
        ("{? NUMBER : 1, id: a, robot: R, command: home}", "0xfff"),
        ("{id: a, robot: R, command: home, args: {? NUMBER : 1}}", "0xfff"),
    ],
)
def test_number_of_thousands_of_digits_is_refused(tmp_path: Path, line: str, words: str) -> None:
    path = tmp_path / "process.yaml"
    path.write_text("steps:\n- " + line.replace("NUMBER", "0x" + "f" * 5000))
    with pytest.raises(InvalidProcess, match=words):
        load_process(path)


@pytest.mark.parametrize("deadline", [0, -1, True, "soon", 1e9])
def test_a_deadline_is_some_time(tmp_path: Path, deadline: object) -> None:
    with pytest.raises(InvalidProcess, match="deadline"):
        load_process(written(tmp_path, HOME, deadline=deadline))


def test_invalid_process_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileUnreadable):
        load_process(tmp_path / "none.yaml")
    path = tmp_path / "list.yaml"
    path.write_text("[1]")
    with pytest.raises(InvalidProcess):
        load_process(path)


def test_processes_differ_only_by_their_steps(tmp_path: Path) -> None:
    first = load_process(written(tmp_path, HOME))
    assert load_process(written(tmp_path, HOME, name="other")).digest == first.digest
    assert load_process(written(tmp_path, HOME | {"robot": "MAYA2"})).digest != first.digest
