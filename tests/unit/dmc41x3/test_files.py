"""Writing files: regular ones only, no link out of the folder, whole or not at all."""

from __future__ import annotations

import os
import stat
from collections.abc import Callable
from pathlib import Path

import pytest

from dmc41x3 import files
from dmc41x3.errors import FileUnreadable, FileUnwritable
from maya_un.config.files import replace
from maya_un.config.state_folder import own_state_folder

Write = Callable[[Path], object]


def _open(path: Path) -> None:
    os.close(files.open_own(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND))


WRITERS: dict[str, Write] = {
    "write": lambda path: files.write(path, "new"),
    "open_own": _open,
    "config edit": lambda path: replace(path, "new"),
}


def pipe(place: Path) -> None:
    os.mkfifo(place)


def folder(place: Path) -> None:
    place.mkdir()


def link_out(place: Path) -> None:
    victim = place.parent.parent / "victim"
    victim.write_text("kept")
    place.symlink_to(victim)


def link_to_nothing_elsewhere(place: Path) -> None:
    place.symlink_to(place.parent.parent / "made by nobody")


def link_in_a_circle(place: Path) -> None:
    place.symlink_to(place.name)


def device(place: Path) -> None:
    try:
        os.mknod(place, stat.S_IFCHR | 0o600, os.makedev(1, 3))
    except PermissionError:
        pytest.skip("only root makes device nodes")


@pytest.mark.parametrize("writer", WRITERS)
@pytest.mark.parametrize("made", [pipe, folder, link_out, link_to_nothing_elsewhere, link_in_a_circle, device])
def test_writers_refuse_irregular_files(writer: str, made: Callable[[Path], None], tmp_path: Path) -> None:
    inner = tmp_path / "inner"
    inner.mkdir()
    place = inner / "file"
    made(place)
    before = place.lstat()
    with pytest.raises(FileUnwritable):
        WRITERS[writer](place)
    assert (place.lstat().st_ino, place.lstat().st_mode) == (before.st_ino, before.st_mode)
    assert [path.name for path in inner.iterdir()] == ["file"]
    assert not (tmp_path / "made by nobody").exists()
    if made is link_out:
        assert (tmp_path / "victim").read_text() == "kept"


@pytest.mark.parametrize("name", ["", ".", ".."])
def test_a_name_of_no_file_is_refused(name: str) -> None:
    with pytest.raises(FileUnwritable, match="not the name of a file"):
        files.write(Path(name), "")


def test_write_keeps_the_permissions_of_the_old_file(tmp_path: Path) -> None:
    place = tmp_path / "file"
    place.write_text("old")
    place.chmod(0o640)
    files.write(place, b"new")
    assert place.read_bytes() == b"new"
    assert stat.S_IMODE(place.stat().st_mode) == 0o640
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_private_file_is_private_whatever_it_replaces(tmp_path: Path) -> None:
    place = tmp_path / "token"
    place.write_text("old")
    place.chmod(0o644)
    files.write(place, "new", files.PRIVATE)
    assert stat.S_IMODE(place.stat().st_mode) == 0o600


def test_write_follows_a_link_within_its_folder(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to("real")
    files.write(tmp_path / "link", "new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_text() == "new"


def test_replacing_that_fails_keeps_the_old_file(tmp_path: Path) -> None:
    place = tmp_path / "file"
    place.write_text("old")
    with pytest.raises(KeyError), files.replacing(place) as out:
        out.write("half")
        raise KeyError
    assert place.read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_private_file_is_closed_to_others(tmp_path: Path) -> None:
    place = tmp_path / "log"
    place.write_text("old")
    place.chmod(0o644)
    os.close(files.private_opener(str(place), os.O_WRONLY | os.O_APPEND))
    assert stat.S_IMODE(place.stat().st_mode) == 0o600


def test_state_folder_is_for_its_owner_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MAYA_STATE_DIR", str(tmp_path / "state"))
    assert stat.S_IMODE(own_state_folder().stat().st_mode) == 0o700
    (tmp_path / "state").chmod(0o755)
    assert stat.S_IMODE(own_state_folder().stat().st_mode) == 0o700


def test_state_folder_writable_by_all_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MAYA_STATE_DIR", str(tmp_path))
    tmp_path.chmod(0o777)
    with pytest.raises(FileUnwritable, match="everybody may write"):
        own_state_folder()


def test_a_lone_hyphen_is_refused_and_no_file_is_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(FileUnwritable, match="standard output"):
        files.write(Path("-"), "new")
    assert not list(tmp_path.iterdir())


def test_a_file_is_read_whole_up_to_a_limit(tmp_path: Path) -> None:
    path = tmp_path / "words"
    path.write_bytes(b"word")
    assert files.read_bytes(path) == files.read_bytes(path, 4) == b"word"
    with pytest.raises(FileUnreadable, match="larger than 3 bytes"):
        files.read_bytes(path, 3)
    with pytest.raises(FileUnreadable, match="Is a directory"):
        files.read_bytes(tmp_path)
