"""The runtime file: how commands and clients find the running `maya up`, and the controller it drives.

It imports nothing heavy, because `maya stop` needs it.
"""

from __future__ import annotations

import fcntl
import json
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

from dmc41x3.address import ControllerAddress, parse
from dmc41x3.files import open_own, unwritable
from maya_un.errors import AlreadyRunning, FileUnwritable
from maya_un.namespace import own

_MOST_BYTES = 4096
"""Size of the largest runtime file that is accepted."""

_ATTEMPTS = 10_000
"""Maximum number of attempts to lock the runtime file. Other commands hold the lock for microseconds."""


class Running(NamedTuple):
    """A `maya up` as its file describes it; `controller` is its address, None for a twin in the process.

    `config` is the path of its configuration file, "" for the manual's values, None if it does not say.
    """

    url: str
    pid: int
    controller: ControllerAddress | None
    config: str | None = None


def folder() -> Path:
    """Return the folder of runtime files: $MAYA_RUNTIME_DIR, else $XDG_RUNTIME_DIR/maya, else /tmp/maya-<uid>.

    In a ROS namespace it is the subfolder of that namespace.
    """
    named = os.environ.get("MAYA_RUNTIME_DIR")
    if named:
        return own(Path(named))
    session = os.environ.get("XDG_RUNTIME_DIR")
    return own(Path(session) / "maya" if session else Path(f"/tmp/maya-{os.getuid()}"))


def find() -> Running | None:
    """Return the content of the runtime file, None if it is missing, unreadable or not trusted.

    A `maya up` that was killed leaves its file; `serving` tells whether it runs.
    """
    try:
        return _parse(read(folder() / "service.json"))
    except (ValueError, KeyError, TypeError):
        return None  # a half-written or foreign file is ignored


def serving() -> Running | None:
    """Return the running `maya up`, None without one, also if it was killed and left its file.

    Commands send their token to its address, where another program may listen after that.
    """
    running = find()
    return running if running is not None and claimant() == running.pid else None


def read(place: Path) -> Any:
    """Return the content of a file of the folder, None if it is missing, unreadable or not trusted."""
    try:
        found = place.lstat()
        if found.st_uid != os.getuid() or not stat.S_ISREG(found.st_mode) or found.st_size > _MOST_BYTES:
            return None
        return json.loads(place.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None


def _parse(found: dict[str, Any]) -> Running:
    controller = found["controller"]
    address = None if controller is None else parse(controller)
    config = found.get("config")
    return Running(str(found["url"]), int(found["pid"]), address, None if config is None else str(config))


@contextmanager
def claimed() -> Iterator[None]:
    """Claim to be the only `maya up` of this user while the block runs; remove the runtime file at its end.

    Raises `AlreadyRunning` and `FileUnwritable`. The claim is a lock that the kernel releases with the process, so a
    killed process blocks no later one.
    """
    place = _own_folder()
    lock = _own_file(place / "service.lock", os.O_RDWR)
    try:
        _take(lock)
        os.truncate(lock, 0)
        os.write(lock, f"{os.getpid()}\n".encode())
        try:
            yield
        finally:
            with suppress(OSError):
                (place / "service.json").unlink()
    finally:
        os.close(lock)


def claimant() -> int | None:
    """Return the process id of this user's running `maya up`, None without one."""
    try:
        lock = os.open(folder() / "service.lock", os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC)
    except OSError:
        return None
    try:
        if _locked(lock, fcntl.LOCK_SH):
            return None
        said = os.read(lock, 32).strip()
        return int(said) if said.isdigit() else None
    finally:
        os.close(lock)


def _take(lock: int) -> None:
    """Lock the file; wait for commands that ask for the owner: they share the lock for an instant (`claimant`)."""
    for _ in range(_ATTEMPTS):
        if _locked(lock, fcntl.LOCK_EX):
            return
        if not _locked(lock, fcntl.LOCK_SH):
            break
        os.sched_yield()
    running = find()
    raise AlreadyRunning(pid="unknown" if running is None else running.pid)


def _locked(lock: int, kind: int) -> bool:
    """Try to lock a file, without waiting."""
    try:
        fcntl.flock(lock, kind | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def publish(running: Running) -> None:
    """Write the runtime file, whole or not at all; raises `FileUnwritable`."""
    controller = None if running.controller is None else str(running.controller)
    said = {"url": running.url, "pid": running.pid, "controller": controller, "config": running.config}
    write("service.json", said)


def write(name: str, value: object) -> None:
    """Write a file of the folder, whole or not at all; raises `FileUnwritable`."""
    text = json.dumps(value)
    place = _own_folder()
    draft = place / f"{name}.new"
    try:
        with open(_own_file(draft, os.O_WRONLY | os.O_TRUNC), "w", encoding="utf-8") as file:
            file.write(text + "\n")
        draft.replace(place / name)
    except OSError as error:
        raise unwritable(draft, error) from error


def _own_file(path: Path, flags: int) -> int:
    """Open a file of this user, created if missing; raises `FileUnwritable` for a link or anything but a file."""
    return open_own(path, flags | os.O_CREAT)


def _own_folder() -> Path:
    place = folder()
    try:
        place.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = place.lstat()
    except OSError as error:
        raise unwritable(place, error) from error
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid():
        raise FileUnwritable(path=place, reason="it is not a folder of this user")
    if found.st_mode & stat.S_IWOTH:
        raise FileUnwritable(path=place, reason="all users can write to it, and so command the robot")
    return place
