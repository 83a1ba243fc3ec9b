"""Disks that are full, and files that may only be read, for processes under test."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Protocol

UNPRIVILEGED = (
    sys.executable,
    "-c",
    "import ctypes, os, sys\n"
    "libc = ctypes.CDLL(None, use_errno=True)\n"
    "for capability in (0, 1, 2, 3): libc.prctl(24, capability, 0, 0, 0)\n"
    "os.execv(sys.argv[1], sys.argv[1:])",
)
"""Before a command: it runs without the rights by which root writes what it may not (PR_CAPBSET_DROP)."""


class Disk(Protocol):
    """The state folder of a process; the test can fill it, and free space on it."""

    folder: Path

    def fill(self, process: int) -> None:
        """Leave no room."""
        ...

    def make_room(self, process: int) -> None:
        """Take back what `fill` did."""
        ...


class TinyDisk:
    """A file system of its own, of some megabytes."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._filler = folder / "filler"

    def fill(self, process: int) -> None:
        """Write until nothing more goes in."""
        file = os.open(self._filler, os.O_WRONLY | os.O_CREAT)
        for size in (65536, 512, 1):
            try:
                while True:
                    os.write(file, b"x" * size)
                    os.lseek(file, 0, os.SEEK_END)
            except OSError:
                continue
        os.close(file)

    def remount(self, how: str) -> None:
        """Remount it for reading only ("ro"), or for writing ("rw"); no file may be open for writing."""
        anew = f"remount,{how}"
        subprocess.run(["mount", "-o", anew, str(self.folder)], capture_output=True, check=True)

    def make_room(self, process: int) -> None:
        """Remove what fills it."""
        self._filler.unlink()


class Quota:
    """An ordinary folder, and a process whose files may not grow any more (RLIMIT_FSIZE)."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def fill(self, process: int) -> None:
        """Allow not one byte more, anywhere."""
        resource.prlimit(process, resource.RLIMIT_FSIZE, (0, resource.RLIM_INFINITY))

    def make_room(self, process: int) -> None:
        """Allow everything."""
        resource.prlimit(process, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))


def kinds() -> list[str]:
    """Return the kinds of disk that there are here: a "tiny disk" only where we may mount one."""
    with tempfile.TemporaryDirectory() as folder:
        may = _mounted(Path(folder))
        if may:
            _unmount(Path(folder))
    return ["quota", "tiny disk"] if may else ["quota"]


@contextmanager
def disk(kind: str, folder: Path) -> Iterator[Disk]:
    """Provide a disk of one of the `kinds` at `folder`."""
    folder.mkdir()
    if kind == "quota":
        yield Quota(folder)
        return
    assert _mounted(folder)
    try:
        yield TinyDisk(folder)
    finally:
        _unmount(folder)


def _mounted(folder: Path) -> bool:
    command = ["mount", "-t", "tmpfs", "-o", "size=3m,mode=700", "tmpfs", str(folder)]
    return os.geteuid() == 0 and subprocess.run(command, capture_output=True, check=False).returncode == 0


def _unmount(folder: Path) -> None:
    subprocess.run(["umount", "--lazy", str(folder)], check=True)
