from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from maya_un.errors import FileUnreadable, InvalidJob
from maya_un.process.spec.documents import MOST_BYTES
from maya_un.process.spec.job import Job, load_job

YAML = """
name: one cube
parts: {cube: [0.50, 1.10]}
places: {tray: [1.10, 0.50, 0.42]}
steps:
  - home
  - pick: cube
  - place: tray
  - approach: {x: 1.0, y: 0.6}
  - gripper: close
  - move: {a: 0.4, b: 1.6, c: 1.3}
repeat: 3
"""

GRID = {"corners": [[0.3, 1.0], [0.5, 1.0]], "rows": 1, "columns": 3}


def job(**changes: Any) -> dict[str, Any]:
    return {"parts": {"cube": [0.5, 1.1]}, "places": {"tray": [1.1, 0.5]}, "steps": ["home"], **changes}


def written(tmp_path: Path, text: str, name: str = "job.yaml") -> Path:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


def test_a_yaml_file_is_read(tmp_path: Path) -> None:
    read = load_job(written(tmp_path, YAML))
    assert (read.name, read.repeat) == ("one cube", 3)
    assert [str(step) for step in read.steps] == [
        "home",
        "pick cube",
        "place tray",
        "approach 1 0.6",
        "gripper close",
        "move 0.4 1.6 1.3",
    ]


def test_a_json_file_is_the_same(tmp_path: Path) -> None:
    path = written(tmp_path, json.dumps(job()), "job.json")
    assert load_job(path) == Job.parse(job(name="job"))


@pytest.mark.parametrize(
    ("file", "name"), [("two cubes.yaml", "two cubes"), ("x.json", "x"), ("y" * 80 + ".yaml", "y" * 64)]
)
def test_a_job_without_a_name_is_called_as_its_file(file: str, name: str, tmp_path: Path) -> None:
    assert load_job(written(tmp_path, json.dumps(job()), file)).name == name


def test_parsed_job_is_written_and_read_again() -> None:
    loop = {"for_each": "box[1,*]", "do": [{"pick": "box[each]"}, {"move": "shelf"}, "home"]}
    read = Job.parse(job(pallets={"box": {**GRID, "full": True}}, steps=[loop, {"pick": "cube"}, "home"]))
    written = json.loads(json.dumps(read.model_dump(exclude_none=True, warnings=False)))
    assert Job.parse(written) == read


def test_unknown_key_is_refused_with_the_known_ones() -> None:
    with pytest.raises(InvalidJob, match=r"steps\.0\.pik: .* known are home, pick, place"):
        Job.parse(job(steps=[{"pik": "cube"}]))
    with pytest.raises(InvalidJob, match=r"steps\.0\.as: .* known are for_each, do\."):
        Job.parse(job(steps=[{"for_each": "box", "do": ["home"], "as": 1}]))
    with pytest.raises(InvalidJob, match=r"steps\.0\.do\.0\.pik: .* known are home, pick"):
        Job.parse(job(steps=[{"for_each": "box", "do": [{"pik": 1}]}]))
    with pytest.raises(InvalidJob, match=r"known are corners, rows, columns, full"):
        Job.parse(job(pallets={"box": {**GRID, "colour": 1}}))


def test_height_left_out_is_the_grasp_height() -> None:
    read = Job.parse(job(places={"low": [1.1, 0.5], "high": [1.1, 0.5, 0.6]}))
    assert [place.z for place in read.place_points(0.4).values()] == [0.4, 0.6]
    assert read.part_points(0.4)["cube"] == (0.5, 1.1, 0.4)


@pytest.mark.parametrize(
    ("data", "key"),
    [
        (None, "job"),
        ([], "job"),
        ("home", "job"),
        ({}, "steps"),
        (job(steps=[]), "steps"),
        (job(steps="home"), "steps"),
        (job(steps={"home": 1}), "steps"),
        (job(steps=[5]), "steps.0"),
        (job(steps=["home", "fly"]), "steps.1"),
        (job(steps=["home", {"pik": "cube"}]), "steps.1.pik"),
        (job(steps=[{"pick": "cube", "place": "tray"}]), "steps.0"),
        (job(steps=[{}]), "steps.0"),
        (job(steps=[{"pick": None}]), "steps.0"),
        (job(steps=[{"pick": 3}]), "steps.0.pick"),
        (job(steps=[{"pick": [1]}]), "steps.0.pick"),
        (job(steps=[{"pick": [1, float("nan")]}]), "steps.0.pick"),
        (job(steps=[{"pick": [1, float("-inf")]}]), "steps.0.pick"),
        (job(steps=[{"pick": [1, "2"]}]), "steps.0.pick"),
        (job(steps=[{"gripper": "ajar"}]), "steps.0.gripper"),
        (job(steps=[{"gripper": True}]), "steps.0.gripper"),
        (job(steps=[{"move": [1, 2]}]), "steps.0.move"),
        (job(steps=[{"move": {"a": 1, "b": 2, "d": 3}}]), "steps.0.move"),
        (job(steps=[{"home": "now"}]), "steps.0.home"),
        (job(steps=["home"] * 1001), "steps"),
        (job(repeat=0), "repeat"),
        (job(repeat=10_001), "repeat"),
        (job(repeat=1.5), "repeat"),
        (job(repeat=True), "repeat"),
        (job(repeat="3"), "repeat"),
        (job(steps=["home"] * 3, repeat=10_000), "job"),
        (job(parts=["cube"]), "parts"),
        (job(parts={"cube": "here"}), "parts.cube"),
        (job(parts={"cube": [1, 2, 3, 4]}), "parts.cube"),
        (job(parts={3: [1, 2]}), "parts.3"),
        (job(parts={"x" * 65: [1, 2]}), "parts." + "x" * 65),
        (job(places={"cube": [1, 2]}), "job"),
        (job(pallets={"cube": GRID}), "job"),
        (job(pallets={"box": [1, 2]}), "pallets.box"),
        (job(pallets={"box": {"corners": [[1, 2]], "rows": 1}}), "pallets.box.columns"),
        (job(pallets={"box": {**GRID, "corners": []}}), "pallets.box.corners"),
        (job(pallets={"box": {**GRID, "corners": [[1]]}}), "pallets.box.corners.0"),
        (job(pallets={"box": {**GRID, "rows": 0}}), "pallets.box"),
        (job(pallets={"box": {**GRID, "rows": 2.0}}), "pallets.box.rows"),
        (job(pallets={"box": {**GRID, "full": 1}}), "pallets.box.full"),
        (job(pallets={"box": {**GRID, "colour": 1}}), "pallets.box.colour"),
        (job(pallets={name: {**GRID, "columns": 501, "full": True} for name in ("box", "rack")}), "job"),
        (job(steps=[{"for_each": "box"}]), "steps.0.do"),
        (job(steps=[{"for_each": 3, "do": ["home"]}]), "steps.0.for_each"),
        (job(steps=[{"for_each": "box", "do": []}]), "steps.0.do"),
        (job(steps=[{"for_each": "box", "do": ["home", "fly"]}]), "steps.0.do.1"),
        (job(steps=[{"for_each": "box", "do": ["home"], "as": "x"}]), "steps.0.as"),
        (job(steps=[{"for_each": "box", "do": [{"for_each": "box", "do": ["home"]}]}]), "steps.0.do.0"),
        (job(steps=[{"for_each": "box", "do": ["home"] * 31}], repeat=100), "job"),
        (job(name=""), "name"),
        (job(name=7), "name"),
        (job(speed=2), "speed"),
        ({**job(), 3: 4}, "3"),
    ],
)
def test_a_wrong_job_is_refused_at_its_key(data: object, key: str) -> None:
    with pytest.raises(InvalidJob) as caught:
        Job.parse(data)
    assert caught.value.details["key"] == key
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "where"),
    [
        ("name: x\nsteps:\n  - home\n  - plce: [1, 1]\n", "step 2, plce (job.yaml, line 4, column 5)"),
        ("steps:\n  - home\n  - repeat: 3\n", "step 2, repeat (job.yaml, line 3, column 5)"),
        ("parts:\n  cube: [1, 2, 3, 4]\nsteps: [home]\n", "parts.cube (job.yaml, line 2, column 3)"),
        ('{"steps": ["home"],\n "speed": 3}', "speed (job.yaml, line 2, column 2)"),
        ("steps:\n  - for_each: box\n    do: [home, {plce: x}]\n", "step 1, do.2.plce (job.yaml, line 3, column 17)"),
        ("steps: [home]\nrepeat: 0\n", "repeat (job.yaml, line 2, column 1)"),
        ("- home\n", "job"),
    ],
)
def test_error_in_a_file_has_its_place_and_counts_steps_from_one(tmp_path: Path, text: str, where: str) -> None:
    with pytest.raises(InvalidJob) as caught:
        load_job(written(tmp_path, text))
    assert f" at {where}" in str(caught.value)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("steps: [home", "line"),
        ("steps: [home]\nsteps: [home]", "twice"),
        ("steps: &s [home]\nparts: *s", "aliases"),
        ("steps: !!python/object/apply:os.getcwd []", "constructor"),
        ("{? [1, 2] : 3}", "key must be a text"),
        ("[" * 50_000, "deeply"),
        ("steps:\n  - wait: !!bool x\n", r"'x' is no value of the type !!bool \(line 2\)"),
        ("steps:\n  - wait: !!timestamp x\n", r"!!timestamp \(line 2\)"),
        ("steps:\n  - home\n  - wait: !!int ''\n", r"!!int \(line 3\)"),
        ("!!float ''", r"!!float \(line 1\)"),
        ("steps: [home]\nname: 2026-13-45\n", r"!!timestamp \(line 2\)"),
    ],
)
def test_broken_yaml_is_unreadable(tmp_path: Path, text: str, reason: str) -> None:
    with pytest.raises(FileUnreadable, match=reason):
        load_job(written(tmp_path, text))


@pytest.mark.parametrize(
    ("text", "reason"), [("{", "line 1"), ('{"steps": [], "steps": []}', "twice"), ("[" * 200_000, "deeply")]
)
def test_broken_json_is_unreadable(tmp_path: Path, text: str, reason: str) -> None:
    with pytest.raises(FileUnreadable, match=reason):
        load_job(written(tmp_path, text, "job.json"))


@pytest.mark.parametrize("time", ["12:30", "1:30:00", "12:30.5", "-1:10"])
def test_a_time_with_colons_is_no_duration(tmp_path: Path, time: str) -> None:
    with pytest.raises(InvalidJob, match=rf"a duration is a number in s, .*, not '{time}'"):
        load_job(written(tmp_path, f"steps:\n  - wait: {time}\n"))


@pytest.mark.parametrize(
    ("ask", "where", "reason"),
    [
        ("x" * 201, "steps.0.ask", "it is longer than 200 letters"),
        ({"question": "?", "choices": ["x" * 53]}, "steps.0.ask.choices.0", "it is longer than 30 letters"),
        ({"question": "?", "choices": list("1234567")}, "steps.0.ask.choices", "it has more than 6 entries"),
    ],
)
def test_a_text_or_list_that_is_too_long_is_refused_with_its_own_limit(ask: object, where: str, reason: str) -> None:
    with pytest.raises(InvalidJob) as caught:
        Job.parse({"steps": [{"ask": ask}]})
    assert (caught.value.details["key"], caught.value.details["reason"]) == (where, reason)


def test_too_many_steps_and_too_long_names_are_refused_with_their_limits() -> None:
    with pytest.raises(InvalidJob, match="steps: it has more than 1000 steps"):
        Job.parse({"steps": ["home"] * 1001})
    with pytest.raises(InvalidJob, match="name: it is longer than 64 letters"):
        Job.parse({"name": "x" * 65, "steps": ["home"]})


@pytest.mark.parametrize(("key", "meant"), [("aproach", "approach"), ("foreach", "for_each"), ("iff", "if")])
def test_a_misspelt_step_is_refused_with_the_one_that_was_meant_and_with_all(key: str, meant: str) -> None:
    with pytest.raises(InvalidJob) as caught:
        Job.parse({"steps": [{key: "cube"}]})
    reason = str(caught.value.details["reason"])
    assert f"; perhaps {meant}; " in reason
    assert {"home", "ask", "if", "for_each", "speed"} <= set(reason.partition("known are ")[2].split(", "))


def test_invalid_text_file_is_unreadable(tmp_path: Path) -> None:
    binary = tmp_path / "binary.yaml"
    binary.write_bytes(b"\xff\xfe\x00")
    large = written(tmp_path, "#" * (MOST_BYTES + 1), "large.yaml")
    for path in (tmp_path, tmp_path / "absent.yaml", binary, large, Path("/dev/zero")):
        with pytest.raises(FileUnreadable):
            load_job(path)


def test_a_name_that_cannot_be_printed_is_refused() -> None:
    with pytest.raises(InvalidJob, match="can be printed"):
        Job.parse({"name": "cube\x1b[2J", "steps": ["home"]})
