from __future__ import annotations

import os
from pathlib import Path

import pytest

from maya_un.config import Config, load, template
from maya_un.config.files import edited, replace, text_of, written
from maya_un.errors import FileUnreadable, FileUnwritable

MINE = """\
# The machine in the hall.
[geometry]
height = 2.34  # measured twice
# length: ask the workshop

[axes.b]
speed_counts = 30_000  # it rattles above
"""


def test_a_key_is_changed_and_the_rest_stays_as_people_wrote_it() -> None:
    assert edited(MINE, {"geometry.height": 2.351}) == MINE.replace("2.34 ", "2.351 ")


def test_keys_and_tables_that_are_missing_are_added(tmp_path: Path) -> None:
    file = tmp_path / "config.toml"
    file.write_text(edited(MINE, {"geometry.delta": 0.302, "axes.b.minimum": 0.58, "scale.pulses_per_degree": 371.5}))
    for line in MINE.splitlines():
        assert line in file.read_text().splitlines()
    config = load(file)
    assert (config.geometry.height, config.geometry.delta) == (2.34, 0.302)
    assert (config.axes.b.minimum, config.axes.b.speed_counts) == (0.58, 30_000)
    assert config.scale.pulses_per_degree == 371.5


def test_an_empty_file_gets_its_tables(tmp_path: Path) -> None:
    file = tmp_path / "config.toml"
    file.write_text(edited("", {"axes.a.minimum": -0.01, "axes.b.minimum": 0.58, "geometry.height": 2.4}))
    config = load(file)
    assert (config.axes.a.minimum, config.axes.b.minimum, config.geometry.height) == (-0.01, 0.58, 2.4)


def test_the_template_can_be_changed_too(tmp_path: Path) -> None:
    file = tmp_path / "config.toml"
    file.write_text(edited(template(), {"axes.c.maximum": 2.31, "geometry.length": 2.31}))
    assert load(file).axes.c.maximum == load(file).geometry.length == 2.31
    assert "# letter = " in file.read_text()


def test_removing_an_edit_restores_the_values(tmp_path: Path) -> None:
    more = edited(MINE, {"geometry.delta": 0.302, "axes.c.minimum": 0.57})
    file = tmp_path / "config.toml"
    file.write_text(edited(more, {"geometry.delta": None, "axes.c.minimum": None, "axes.a.minimum": None}))
    assert load(file).geometry.delta == Config().geometry.delta
    assert load(file).axes.c == Config().axes.c
    for line in MINE.splitlines():
        assert line in file.read_text().splitlines()


@pytest.mark.parametrize("text", ["geometry = 3\n", "not toml", "[geometry\n"])
def test_invalid_table_or_toml_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"table|line|Unexpected|Empty|key"):
        edited(text, {"geometry.height": 2.4})


def test_inline_tables_and_dotted_keys_are_understood(tmp_path: Path) -> None:
    file = tmp_path / "config.toml"
    text = "geometry = {height = 2.3}\naxes.b = {minimum = 0.5}\nscale.pulses_per_degree = 370.0\n"
    file.write_text(edited(text, {"geometry.height": 2.4, "axes.b.minimum": 0.6, "scale.pulses_per_degree": 372.0}))
    config = load(file)
    assert (config.geometry.height, config.axes.b.minimum, config.scale.pulses_per_degree) == (2.4, 0.6, 372.0)


def test_a_table_is_added_within_an_inline_one(tmp_path: Path) -> None:
    file = tmp_path / "config.toml"
    file.write_text(edited("axes = {a = {minimum = 0.1}}  # mine\n", {"axes.b.minimum": 0.6}))
    assert file.read_text().rstrip().endswith("# mine")
    assert (load(file).axes.a.minimum, load(file).axes.b.minimum) == (0.1, 0.6)


def test_a_file_that_is_not_there_says_nothing(tmp_path: Path) -> None:
    assert text_of(tmp_path / "none.toml") == ""
    assert written(tmp_path / "none.toml") == {}


def test_file_shows_its_own_values_and_no_more(tmp_path: Path) -> None:
    file = tmp_path / "config.toml"
    file.write_text(MINE)
    assert written(file) == {"geometry": {"height": 2.34}, "axes": {"b": {"speed_counts": 30_000}}}


@pytest.mark.parametrize("content", [b"\xff\xfe", b"[geometry"])
def test_unreadable_file_is_reported(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "config.toml"
    file.write_bytes(content)
    with pytest.raises(FileUnreadable):
        written(file)


def test_a_file_is_replaced_whole_and_keeps_its_permissions(tmp_path: Path) -> None:
    file = tmp_path / "config.toml"
    file.write_text("old")
    file.chmod(0o640)
    replace(file, "new")
    assert file.read_text() == "new"
    assert file.stat().st_mode & 0o777 == 0o640
    assert [path.name for path in tmp_path.iterdir()] == ["config.toml"]


def test_a_link_is_followed(tmp_path: Path) -> None:
    (tmp_path / "real.toml").write_text("old")
    (tmp_path / "config.toml").symlink_to("real.toml")
    replace(tmp_path / "config.toml", "new")
    assert (tmp_path / "config.toml").is_symlink()
    assert (tmp_path / "real.toml").read_text() == "new"


def test_a_new_file_gets_its_folder(tmp_path: Path) -> None:
    replace(tmp_path / "maya" / "config.toml", "new")
    assert (tmp_path / "maya" / "config.toml").read_text() == "new"


def test_unwritable_place_is_reported(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(FileUnwritable):
        replace(tmp_path / "file" / "config.toml", "new")


def test_failed_write_keeps_the_old_content(tmp_path: Path) -> None:
    file = tmp_path / "config.toml"
    file.write_text("old")
    if os.getuid() == 0:  # root may write anywhere: a folder in the file's place stops it all the same
        file.unlink()
        file.mkdir()
        with pytest.raises(FileUnwritable):
            replace(file, "new")
        assert list(tmp_path.iterdir()) == [file]
        return
    tmp_path.chmod(0o500)
    with pytest.raises(FileUnwritable):
        replace(file, "new")
    tmp_path.chmod(0o700)
    assert file.read_text() == "old"
