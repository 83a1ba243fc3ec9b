from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Event

import pytest

from dmc41x3.address import ControllerAddress, NetworkAddress, SerialAddress
from maya_un import runtime
from maya_un.errors import AlreadyRunning, FileUnwritable
from maya_un.runtime import Running


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("MAYA_RUNTIME_DIR", str(tmp_path / "maya"))
    return tmp_path / "maya"


@pytest.mark.parametrize("controller", [None, NetworkAddress("10.0.0.1", 23), SerialAddress("/dev/ttyUSB0", 19200)])
def test_published_entry_is_found_and_removed_with_its_owner(place: Path, controller: ControllerAddress | None) -> None:
    running = Running("http://127.0.0.1:4133", os.getpid(), controller, "/etc/maya.toml")
    with runtime.claimed():
        runtime.publish(running)
        assert runtime.find() == running
    assert runtime.find() is None
    assert place.stat().st_mode & 0o777 == 0o700


@pytest.mark.usefixtures("place")
def test_there_is_one_at_a_time() -> None:
    with runtime.claimed():
        runtime.publish(Running("http://127.0.0.1:4133", 77, None))
        with pytest.raises(AlreadyRunning, match="77"), runtime.claimed():
            pass
        assert runtime.find() is not None
    with runtime.claimed():
        pass


@pytest.mark.usefixtures("place")
def test_owner_is_known_while_it_lives() -> None:
    assert runtime.claimant() is None
    with runtime.claimed():
        assert runtime.claimant() == os.getpid()
    assert runtime.claimant() is None


@pytest.mark.usefixtures("place")
def test_a_start_succeeds_while_commands_ask_for_the_owner() -> None:
    with runtime.claimed():
        pass
    over = Event()

    def ask() -> None:
        while not over.is_set():
            runtime.claimant()

    with ThreadPoolExecutor(2) as commands:
        asked = [commands.submit(ask) for _ in range(2)]
        try:
            for _ in range(200):
                with runtime.claimed():
                    pass
        finally:
            over.set()
        for one in asked:
            one.result()


@pytest.mark.parametrize(
    "text", ["", "{", "[]", "[" * 4000, "[" * 100_000, '{"url": "x"}', '{"url": "x", "pid": 1, "controller": 5}']
)
def test_foreign_file_is_no_service(place: Path, text: str) -> None:
    place.mkdir()
    (place / "service.json").write_text(text)
    assert runtime.find() is None


def test_device_or_link_is_no_service(place: Path) -> None:
    place.mkdir()
    (place / "service.json").symlink_to("/dev/zero")
    assert runtime.find() is None
    (place / "service.json").unlink()
    os.mkfifo(place / "service.json")
    assert runtime.find() is None


@pytest.mark.parametrize("name", ["service.lock", "service.json.new"])
def test_links_inside_the_folder_are_not_followed(place: Path, name: str) -> None:
    place.mkdir()
    victim = place.parent / "victim"
    victim.write_text("precious")
    (place / name).symlink_to(victim)
    with pytest.raises(FileUnwritable, match=name), runtime.claimed():
        runtime.publish(Running("http://127.0.0.1:4133", 77, None))
    assert victim.read_text() == "precious"


def test_folder_writable_by_all_is_refused(place: Path) -> None:
    place.mkdir()
    place.chmod(0o777)
    with pytest.raises(FileUnwritable, match="all users"), runtime.claimed():
        pass


def test_a_folder_that_cannot_be_made_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("MAYA_RUNTIME_DIR", str(tmp_path / "file" / "maya"))
    with pytest.raises(FileUnwritable, match="file"), runtime.claimed():
        pass


def test_a_link_in_the_folders_place_is_not_followed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "maya").symlink_to(tmp_path / "elsewhere")
    monkeypatch.setenv("MAYA_RUNTIME_DIR", str(tmp_path / "maya"))
    with pytest.raises(FileUnwritable, match="not a folder of this user"), runtime.claimed():
        pass


def test_session_has_its_own_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("MAYA_RUNTIME_DIR", raising=False)
    monkeypatch.setenv("XDG_RUNTIME_DIR", "/run/user/7")
    assert runtime.folder() == Path("/run/user/7/maya")
    monkeypatch.delenv("XDG_RUNTIME_DIR")
    assert runtime.folder() == Path(f"/tmp/maya-{os.getuid()}")
