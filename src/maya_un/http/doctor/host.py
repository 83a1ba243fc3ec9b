"""Checks of this computer, without a robot: configuration, storage, ports and the programs that listen on them."""

from __future__ import annotations

import os
import shutil
import socket
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from importlib.machinery import EXTENSION_SUFFIXES
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple
from urllib.parse import urlsplit

from dmc41x3.i18n import phrase
from maya_un import __version__, runtime
from maya_un.config import Config, default_path, load
from maya_un.config.state_folder import queue_file, state_folder
from maya_un.errors import MayaError, SessionTakenOver, StorageDamaged, translated
from maya_un.http.doctor.certificate import certificates
from maya_un.http.doctor.finding import Finding, Look, fail, ok, skipped, warn
from maya_un.process.journal import file, history

_LISTENS = "0A"
"""The state of a listening socket in /proc/net/tcp."""


class ListeningProcess(NamedTuple):
    """A process that listens; `pid` is 0 and `name` empty for a process of another user."""

    port: int
    pid: int
    name: str

    @property
    def who(self) -> str:
        """The process as text."""
        if not self.pid:
            return phrase("a process of another user")
        return phrase("{name} (process {number})", name=self.name, number=self.pid)


def listeners(proc: Path = Path("/proc")) -> list[ListeningProcess]:
    """Return the processes that listen on TCP, by port; none if the system does not list them."""
    ports = _ports(proc)
    owners = _owners(proc, set(ports.values()))
    return [ListeningProcess(port, *owners.get(inode, (0, ""))) for port, inode in sorted(ports.items())]


def _ports(proc: Path) -> dict[int, str]:
    """Return the inode of the listening socket of each port."""
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
    """Return the open files of a process; none for a process of another user."""
    found: list[str] = []
    with suppress(OSError):
        for link in os.listdir(process / "fd"):  # noqa: PTH208 - for every process
            with suppress(OSError):  # closed meanwhile
                found.append(os.readlink(process / "fd" / link))  # noqa: PTH115 - not a path: socket:[123]
    return found


def _name(process: Path) -> str:
    try:
        words = (process / "cmdline").read_bytes().split(b"\0")
        names = [Path(word.decode(errors="replace")).name for word in words[:2] if word]
    except OSError:
        return ""
    interpreted = len(names) > 1 and names[0].startswith("python")
    return names[1] if interpreted else names[0] if names else ""


_LITTLE, _SHORT = 0.2, 2.0
"""Free disk space [GB] below which a check fails, because the disk is almost full, or warns."""

_LAG = 60.0
"""A clock that is this much behind the newest stored event was set back [s]."""


class KnownPort(NamedTuple):
    """A port that programs around Maya use, and the names of programs that normally use it."""

    number: int
    use: str
    usual: tuple[str, ...]


PORTS = (
    KnownPort(4133, "maya up", ("maya",)),
    KnownPort(5023, "maya dmc serve", ("maya",)),
    KnownPort(3000, "maya coms", ("maya",)),
    KnownPort(9090, "rosbridge", ("rosbridge", "maya")),
    KnownPort(11311, "ROS master", ("rosmaster", "roscore", "roslaunch")),
)
"""The checked ports."""


def config_file(named: Path | None) -> Path | None:
    """Return the current configuration file, None if the manual's values apply; `named` is one that a user names."""
    place = default_path() if named is None else named
    return place if named is not None or os.environ.get("MAYA_CONFIG") or place.exists() else None


def config(named: Path | None, language: str) -> Iterator[Finding]:
    """Check whether the current configuration, or the one that a user names, is valid."""
    place = config_file(named)
    try:
        load(named)
    except MayaError as error:
        yield fail("configuration", "config_bad", error=error.text(language))
        return
    yield ok("configuration", "config_none") if place is None else ok("configuration", "config_good", path=str(place))


def served_config(path: str, language: str) -> Iterator[Finding]:
    """Check whether the configuration file of the running service is valid, "" for the manual's values."""
    if not path:
        yield ok("configuration", "config_served_none")
        return
    try:
        load(Path(path))
    except MayaError as error:
        yield fail("configuration", "config_bad", error=error.text(language))
        return
    yield ok("configuration", "config_served", path=path)


def storage(language: str, *, served_by: int) -> Iterator[Finding]:
    """Check the file of the queue, completely unless the process `served_by` uses it (0: no process)."""
    folder = state_folder()
    path = queue_file()
    if not _writable(folder):
        yield fail("storage", "storage_unwritable", path=str(folder))
    elif not path.exists():
        yield ok("storage", "storage_none", path=str(folder))
    elif served_by:
        yield ok("storage", "storage_in_use", path=str(path), pid=served_by)
    else:
        yield _kept(path, language)


def _kept(path: Path, language: str) -> Finding:
    try:
        with history.reading(path) as connection:
            file.check(connection, path)
            runs = connection.execute("SELECT value FROM meta WHERE name = 'run'").fetchone()[0]
    except sqlite3.Error as error:
        damage = StorageDamaged(path=path, reason=file.sqlite_reason(error))
        return fail("storage", "storage_bad", error=damage.text(language))
    except MayaError as error:
        return fail("storage", "storage_bad", error=error.text(language))
    return ok("storage", "storage_good", path=str(path), runs=runs, size=path.stat().st_size / 1e6)


def _writable(folder: Path) -> bool:
    """Return whether permissions allow creating a file in a folder, or the folder itself."""
    there = next(place for place in (folder, *folder.parents) if place.exists())
    return there.is_dir() and os.access(there, os.W_OK | os.X_OK)


_COMPILED = "dmc41x3.twin.timeline"
"""One of the modules that a compiled wheel contains as machine code (hatch_build.py)."""


def software(module: str = _COMPILED) -> Iterator[Finding]:
    """Say which version is installed, and whether the twin and the planner are compiled, judged by one `module`."""
    spec = find_spec(module)
    compiled = spec is not None and str(spec.origin).endswith(tuple(EXTENSION_SUFFIXES))
    yield ok("software", "software_compiled" if compiled else "software_plain", version=__version__)


def disk() -> Iterator[Finding]:
    """Check the free space on the disk of the queue."""
    folder = state_folder()
    there = next(place for place in (folder, *folder.parents) if place.exists())
    free = shutil.disk_usage(there).free / 1e9
    if free >= _SHORT:
        yield ok("disk", "disk_room", free=free)
    else:
        found = fail if free < _LITTLE else warn
        yield found("disk", "disk_short", free=free, path=str(folder / "recordings"))


def ports(there: Sequence[ListeningProcess]) -> Iterator[Finding]:
    """Check which programs use the ports of programs around Maya."""
    running = runtime.find()
    for port in PORTS:
        held = next((one for one in there if one.port == port.number), None)
        if held is None:
            yield ok("ports", "port_free", port=port.number, use=port.use)
            continue
        ours = (running is not None and held.pid == running.pid) or held.name.startswith(port.usual)
        key = "port_ours" if ours else "port_taken"
        yield (ok if ours else warn)("ports", key, port=port.number, use=port.use, who=held.who)


def clock(now: datetime | None = None, root: Path = Path("/")) -> Iterator[Finding]:
    """Check which service synchronises the clock, and whether the clock was set back."""
    behind = _newest() - (datetime.now(UTC) if now is None else now).timestamp()
    if behind > _LAG:
        yield fail("clock", "clock_back", seconds=behind)
        return
    keepers = {
        "systemd-timesyncd": "run/systemd/timesync/synchronized",
        "chrony": "run/chrony/chronyd.pid",
        "ntpd": "run/ntpd.pid",
    }
    keeper = next((name for name, mark in keepers.items() if (root / mark).exists()), None)
    yield warn("clock", "clock_alone") if keeper is None else ok("clock", "clock_good", keeper=keeper)


def _newest() -> float:
    """Return the date of the newest stored event [s since 1970], 0 without events."""
    with suppress(MayaError, ValueError):
        for _, row in history.newest_events(queue_file(), 1):
            return datetime.fromisoformat(row.date).timestamp()
    return 0.0


def coms(config: Config, language: str = "en") -> Iterator[Finding]:
    """Check whether `maya coms` is connected to the robot and the supervisors."""
    import httpx  # noqa: PLC0415 - it takes 0.1 s of the start of `maya up`

    url = config.coms.server_address
    try:
        status = httpx.get(f"{url}/status", timeout=1.0).json()
        state, found = str(status["state"]), status.get("name", config.coms.name)
    except (httpx.HTTPError, ValueError, KeyError, TypeError):
        yield skipped("supervisors", "coms_none", url=url)
        return
    if found != config.coms.name:
        yield warn("supervisors", "coms_other", url=url, found=found, name=config.coms.name)
        return
    if status.get("password_in_clear"):
        yield warn("supervisors", "coms_clear", where=status["supervisors"]["url"])
    if state == "connected":
        yield ok("supervisors", "coms_connected", where=status["supervisors"]["url"])
    elif state == "idle":
        yield ok("supervisors", "coms_idle", url=url)
    else:
        sides = [status.get(side, {}) for side in ("robot", "supervisors")]
        waits = "; ".join(
            translated(side.get("code", 0), str(side["waits_for"]), language) for side in sides if side.get("waits_for")
        )
        taken = any(side.get("code") == SessionTakenOver.code for side in sides)
        yield (
            fail("supervisors", "coms_taken", reason=waits)
            if taken
            else warn("supervisors", "coms_waits", reason=waits)
        )


LOCAL_MASTER = "http://localhost:11311"
"""Address of the master that ROS assumes."""


def ros() -> Iterator[Finding]:
    """Check whether ROS is installed, and whether its master answers; warn about a missing one if somebody named it."""
    installed = shutil.which("roscore") or Path("/opt/ros").is_dir()
    if not installed:
        yield skipped("ROS", "ros_none")
        return
    uri = os.environ.get("ROS_MASTER_URI", LOCAL_MASTER)
    try:
        place = urlsplit(uri)
        with socket.create_connection((place.hostname or "localhost", place.port or 11311), timeout=1.0):
            yield ok("ROS", "ros_master", uri=uri)
    except (OSError, ValueError):
        unused = uri == LOCAL_MASTER  # that of ROS itself: nobody has named a master, and none runs
        yield (skipped if unused else warn)("ROS", "ros_no_master", uri=uri)


def looks(named: Path | None, config_of: Config, language: str, pid: int) -> list[Look]:
    """Return the checks of this computer.

    `named` is the configuration file that a user names, `config_of` the one that applies; `pid` is the process of the
    running service, 0 without one.
    """
    there = listeners()
    return [
        ("configuration", lambda: config(named, language)),
        ("software", software),
        ("storage", lambda: storage(language, served_by=pid)),
        ("disk", disk),
        ("ports", lambda: ports(there)),
        ("certificate", lambda: certificates([one.port for one in there if one.pid == pid]) if pid else ()),
        ("clock", clock),
        ("ROS", ros),
        ("supervisors", lambda: coms(config_of, language)),
    ]
