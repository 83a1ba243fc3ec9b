"""Who listens on which port of this computer, as the system tells it (Linux, /proc)."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

_LISTENS = "0A"
"""The state of a listening socket in /proc/net/tcp."""


class ListeningProcess(NamedTuple):
    """A process that listens; `pid` is 0 and `name` empty where it is another user's."""

    port: int
    pid: int
    name: str

    @property
    def who(self) -> str:
        """The process as people know it."""
        return f"{self.name} (process {self.pid})" if self.pid else "a process of another user"


def listeners(proc: Path = Path("/proc")) -> list[ListeningProcess]:
    """Return who listens on TCP, by port; empty where the system does not tell."""
    ports = _ports(proc)
    owners = _owners(proc, set(ports.values()))
    return [ListeningProcess(port, *owners.get(inode, (0, ""))) for port, inode in sorted(ports.items())]


def _ports(proc: Path) -> dict[int, str]:
    """Return the inode of the socket that listens on each port."""
    found: dict[int, str] = {}
    for table in ("tcp", "tcp6"):
        try:
            lines = (proc / "net" / table).read_text(encoding="ascii").splitlines()[1:]
        except OSError:
            continue
        for line in lines:
            fields = line.split()
            if len(fields) > 9 and fields[3] == _LISTENS:
                found.setdefault(int(fields[1].rpartition(":")[2], 16), fields[9])
    return found


def _owners(proc: Path, inodes: set[str]) -> dict[str, tuple[int, str]]:
    wanted = {f"socket:[{inode}]": inode for inode in inodes}
    found: dict[str, tuple[int, str]] = {}
    for process in proc.glob("[0-9]*"):
        for target in _open_files(process):
            inode = wanted.get(target)
            if inode is not None:
                found.setdefault(inode, (int(process.name), _name(process)))
    return found


def _open_files(process: Path) -> list[str]:
    """Return what a process has open; nothing of another user's."""
    found: list[str] = []
    with suppress(OSError):
        for link in os.listdir(process / "fd"):  # noqa: PTH208 - of every process there is
            with suppress(OSError):  # closed meanwhile
                found.append(os.readlink(process / "fd" / link))  # noqa: PTH115 - no path: socket:[123]
    return found


def _name(process: Path) -> str:
    try:
        words = (process / "cmdline").read_bytes().split(b"\0")
        names = [Path(word.decode(errors="replace")).name for word in words[:2] if word]
    except OSError:
        return ""
    interpreted = len(names) > 1 and names[0].startswith("python")
    return names[1] if interpreted else names[0] if names else ""
