"""The folder holds whole files only, no more than it may, and the newest always."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import pytest

from maya_un.errors import FileUnwritable, NotFound
from maya_un.recorder import mcap_file
from maya_un.recorder.recording import Recording
from maya_un.recorder.store import RecordingStore
from tests.unit.recorder.recordings import RECORDING, UTC, header

SECOND = 1_000_000_000


def store_of(folder: Path, most_files: int, most_bytes: int) -> RecordingStore:
    return RecordingStore(folder, most_files, most_bytes, lambda: UTC)


def of(reason: str, second: int) -> Recording:
    return replace(RECORDING, header=header(reason, utc=UTC + second * SECOND))


def test_a_recording_is_named_by_its_date_and_its_reason(tmp_path: Path) -> None:
    store = store_of(tmp_path / "state" / "recordings", 10, 10_000_000)
    kept = store.save(RECORDING)
    assert kept.name == "2026-11-21T19-25-20Z-limit.mcap"
    assert (kept.date, kept.reason) == ("2026-11-21T19:25:20Z", "limit")
    assert kept.bytes == store.path(kept.name).stat().st_size
    assert mcap_file.read(store.path(kept.name)) == RECORDING
    assert [path.name for path in store.folder.iterdir()] == [kept.name]


def test_two_recordings_of_one_second_are_two_files(tmp_path: Path) -> None:
    store = store_of(tmp_path, 10, 10_000_000)
    names = [store.save(RECORDING).name for _ in range(3)]
    assert names == [f"2026-11-21T19-25-20Z-limit{number}.mcap" for number in ("", ".2", ".3")]
    assert [kept.name for kept in store.list()] == names[::-1]
    assert {kept.reason for kept in store.list()} == {"limit"}


def test_oldest_recordings_are_removed_for_the_newest(tmp_path: Path) -> None:
    store = store_of(tmp_path, 3, 10_000_000)
    for second in range(5):
        store.save(of("asked", second))
    assert [kept.date[-3:-1] for kept in store.list()] == ["24", "23", "22"]


def test_folder_stays_within_its_size_except_for_the_newest(tmp_path: Path) -> None:
    size = store_of(tmp_path / "other", 10, 10_000_000).save(RECORDING).bytes
    store = store_of(tmp_path, 100, 2 * size + size // 2)
    for second in range(4):
        store.save(of("limit", second))
    assert [kept.date[-3:-1] for kept in store.list()] == ["23", "22"]
    small = store_of(tmp_path, 100, 1)
    kept = small.save(of("limit", 9))
    assert small.list() == [kept]


def test_a_reason_makes_a_harmless_name(tmp_path: Path) -> None:
    store = store_of(tmp_path, 10, 10_000_000)
    kept = store.save(of("../../Etc/passwd ñ!", 0))
    assert kept.name == "2026-11-21T19-25-20Z-etc-passwd.mcap"
    assert kept.reason == "etc-passwd"
    assert store.save(of("¡", 1)).reason == "asked"


@pytest.mark.parametrize("name", ["../x.mcap", "notes.txt", "", ".", "2026-11-21T19-25-20Z-limit.mcap"])
def test_only_recordings_of_the_folder_have_a_path(name: str, tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(NotFound):
        store_of(tmp_path, 10, 10_000_000).path(name)


def test_foreign_files_are_neither_listed_nor_removed(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    store = store_of(tmp_path, 1, 1)
    store.save(of("asked", 0))
    store.save(of("asked", 1))
    store.clean()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["2026-11-21T19-25-21Z-asked.mcap", "notes.txt"]


def test_failed_write_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = store_of(tmp_path, 10, 10_000_000)

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(FileUnwritable, match="No space left"):
        store.save(RECORDING)
    assert list(tmp_path.iterdir()) == []


def test_folder_that_cannot_be_made_is_reported(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(FileUnwritable):
        store_of(tmp_path / "file" / "recordings", 10, 1).save(RECORDING)


def test_a_draft_that_was_left_is_never_listed_and_is_cleaned_away(tmp_path: Path) -> None:
    store = store_of(tmp_path, 10, 10_000_000)
    draft = tmp_path / "2026-11-21T19-25-20Z-limit.mcap.part"
    draft.write_bytes(b"\x89MCAP0\r\nhalf")
    assert store.list() == []
    store.clean()
    assert not draft.exists()


def test_a_folder_that_is_not_there_is_empty(tmp_path: Path) -> None:
    store = store_of(tmp_path / "none", 10, 1)
    store.clean()
    assert store.list() == []
