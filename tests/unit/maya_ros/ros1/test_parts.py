from __future__ import annotations

from pathlib import Path

import pytest

from maya_ros.ros1.twin import parts_on_table
from maya_un.config import Config
from maya_un.errors import FileUnreadable, InvalidValue
from maya_un.values import Point


def test_parts_are_at_the_positions_of_parameters_and_job_file(tmp_path: Path) -> None:
    job = tmp_path / "job.yaml"
    job.write_text("parts:\n  red: [0.5, 1.2]\nsteps:\n  - pick: red\n")
    table = parts_on_table(Config(), str(job), {"blue": [0.9, 0.9, 0.4]})
    assert table == {"red": Point(0.5, 1.2, Config().cell.grasp_height), "blue": Point(0.9, 0.9, 0.4)}


def test_without_either_the_table_is_empty() -> None:
    assert parts_on_table(Config(), "", {}) == {}


@pytest.mark.parametrize("parts", [["part"], {"part": [0.5, 1.2]}, {"part": "here"}, {"part": [0.5, "y", 0.4]}, 5])
def test_invalid_place_is_refused(parts: object) -> None:
    with pytest.raises(InvalidValue):
        parts_on_table(Config(), "", parts)


def test_a_job_file_that_is_not_there_is_named() -> None:
    with pytest.raises(FileUnreadable, match="nowhere"):
        parts_on_table(Config(), "/nowhere.yaml", {})
