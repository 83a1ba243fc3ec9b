"""Finds the files below a path, reads them within bounds, and hands each to its reader.

Nothing is changed or executed. Links to folders below the path are not followed, so a circle of links has an end.
"""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from itertools import chain, islice
from pathlib import Path

from dmc41x3.i18n import phrase
from maya_ros.migration import commands, markup, python
from maya_ros.migration.finding import ScriptFinding
from maya_ros.migration.original import Severity
from maya_un.errors import FileUnreadable

LARGEST = 256_000
"""Largest file that is read [bytes]. The parser takes 2 s to 10 s for it."""

MOST_FILES = 20_000
"""Largest number of files that a folder may hold."""

MOST_BYTES = 4_000_000
"""Largest sum of the files that are read [bytes]."""

DEEPEST = 100
"""Most nested brackets; the parser's time grows with their square."""

_LEFT_OUT = frozenset(
    {"venv", "node_modules", "site-packages", "dist-packages", "__pycache__", "build", "devel", "install", "logs"}
)
"""Folders whose files nobody writes, beside those with a dot before their name."""

_OURS = b"The maintainers of Maya-UN"
"""A package.xml of this project holds it."""

_PAGES = frozenset({".md", ".rst", ".txt"})
_NAMED = re.compile(
    rb"maya|gclib|galil|ros-coms|ros-kinetic|/opt/ros/kinetic|/hardware_sensor|/step_|send_task|start_queue|stop_queue"
    rb"|rospy|actionlib|roslaunch|rosrun|rostopic|rosservice",
    re.IGNORECASE,
)
"""The names of which a Python file, a shell script or a page must hold one, or else it has nothing of the original."""

_SHELLS = re.compile(rb"#!.*\b(?:ba|da|z)?sh\b")
_PYTHONS = re.compile(rb"#!.*\bpython")

Reader = Callable[[str], Iterator[ScriptFinding]]


@dataclass(frozen=True, slots=True)
class Unread:
    """A file that was not read, and the reason."""

    file: str
    reason: str


@dataclass(slots=True)
class MigrationReport:
    """The findings by their files, the files that were not read, and the number of files that were."""

    findings: list[tuple[str, ScriptFinding]] = field(default_factory=list[tuple[str, ScriptFinding]])
    unread: list[Unread] = field(default_factory=list[Unread])
    files: int = 0

    @property
    def clean(self) -> bool:
        """Whether every file was read and nothing has to be changed or checked."""
        return not self.unread and all(one.kind is Severity.SAME for _, one in self.findings)


def check(path: str) -> MigrationReport:
    """Return what to change in a file or in all files below a folder; raises `FileUnreadable` for the path itself."""
    root, report = Path(path), MigrationReport()
    try:
        is_folder = stat.S_ISDIR(root.stat().st_mode)
        names = sorted(islice(_below(root, report), MOST_FILES + 1)) if is_folder else [root]
    except (OSError, ValueError) as error:
        raise FileUnreadable(path=path, reason=_reason(error)) from error
    if len(names) > MOST_FILES:
        raise FileUnreadable(path=path, reason=phrase("it holds more than {most} files", most=MOST_FILES))
    left, reading = MOST_BYTES, _Reading(report, alone=not is_folder)
    for take in chain((partial(reading.check, name) for name in names), reading.beside()):
        name = take.args[0]
        left -= take()
        if left < 0:
            reason = phrase(
                "it and the files before it have {most} MB; give a smaller folder", most=MOST_BYTES // 1_000_000
            )
            report.unread.append(Unread(str(name), reason))
            break
    report.findings.sort(key=lambda one: (one[0], one[1].line))
    if not is_folder and report.unread:
        raise FileUnreadable(path=path, reason=report.unread[0].reason)
    return report


class _Reading:
    """Reads files into a report, first those that name something of the original.

    A Python file that names nothing of it is read too where another one does, in its folder or above: it is imported
    there, and so must have the syntax of Python 3.
    """

    def __init__(self, report: MigrationReport, *, alone: bool) -> None:
        self._report = report
        self._alone = alone
        self._folders: set[Path] = set()
        self._others: list[Path] = []

    def check(self, path: Path) -> int:
        """Add the findings of a file, and return the number of bytes that its reader took."""
        reader, size = _check(path, self._report, alone=self._alone)
        if reader is _python:
            self._folders.add(path.parent)
        elif reader is _nothing and path.suffix.lower() == ".py":
            self._others.append(path)
        return size

    def beside(self) -> Iterator[partial[int]]:
        """Yield a function that reads each Python file beside or below a file that uses names of the original."""
        for path in self._others:
            if not self._folders.isdisjoint(path.parents):
                yield partial(self._syntax, path)

    def _syntax(self, path: Path) -> int:
        reader, size = _check(path, self._report, alone=False, reader=_python)
        self._report.files -= reader is not None  # it has been counted before
        return size


def _below(root: Path, report: MigrationReport) -> Iterator[Path]:
    """Yield the files below a folder, and note the folders that cannot be read."""

    def note(error: OSError) -> None:
        report.unread.append(Unread(str(error.filename), _reason(error)))

    for folder, folders, files in os.walk(root, onerror=note):
        if "package.xml" in files and _is_ours(Path(folder, "package.xml")):
            folders.clear()
            continue
        folders[:] = sorted(one for one in folders if one not in _LEFT_OUT and not one.startswith("."))
        yield from (Path(folder, name) for name in files)


def _is_ours(manifest: Path) -> bool:
    """Return whether a package.xml is one of this project, whose files are up to date."""
    with suppress(OSError, _Unfit):
        return _OURS in _content(manifest)
    return False


def _check(
    path: Path, report: MigrationReport, *, alone: bool, reader: Reader | None = None
) -> tuple[Reader | None, int]:
    """Add the findings of a file to a report; return its reader, None without one, and the bytes that it took.

    Without `reader` the name and the content of the file decide.
    """
    if not (alone or _has_reader(path) or _may_have_one(path)):
        return None, 0
    try:
        data = _content(path)
        reader = reader or _reader_of(path, data)
        found = list(dict.fromkeys(_Comparable(one) for one in reader(_text(data))))
    except (OSError, _Unfit) as error:
        if alone or _has_reader(path):
            report.unread.append(Unread(str(path), _reason(error)))
        return None, 0
    report.files += 1
    report.findings += [(str(path), one.finding) for one in found]
    return reader, len(data) if reader is not _nothing else 0


class _Unfit(Exception):
    """A file that cannot be read as a text."""


@dataclass(frozen=True)
class _Comparable:
    """A finding that equals another of the same line, rule and text."""

    finding: ScriptFinding = field(compare=False)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Comparable) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def _key(self) -> tuple[object, ...]:
        one = self.finding
        return one.line, one.key, one.found, *sorted(one.details.items())


def _has_reader(path: Path) -> bool:
    """Return whether the name of a file says that it has to be read."""
    return path.name in _BY_NAME or path.suffix.lower() in _BY_SUFFIX


def _may_have_one(path: Path) -> bool:
    """Return whether a file can hold commands: a page, or a file without an ending."""
    return path.suffix.lower() in {*_PAGES, ""}


def _content(path: Path) -> bytes:
    """Return the content of a file; raises `OSError` and `_Unfit`."""
    with os.fdopen(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as file:
        status = os.fstat(file.fileno())
        if not stat.S_ISREG(status.st_mode):
            raise _Unfit(phrase("it is no regular file"))
        data = file.read(LARGEST + 1)
    if b"\0" in data:
        raise _Unfit(phrase("it is no text, but binary data"))
    if len(data) > LARGEST:
        size, most = status.st_size / 1e6, LARGEST // 1000
        raise _Unfit(phrase("it has {size:.1f} MB; at most {most} kB are read", size=size, most=most))
    return data


def _text(data: bytes) -> str:
    """Return a text in UTF-8, or else in Latin-1, with line feeds."""
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n").replace("\f", " ")


def _reason(error: BaseException) -> str:
    return (error.strerror if isinstance(error, OSError) else None) or str(error)


def _reader_of(path: Path, data: bytes) -> Reader:
    """Return the reader for a file by its name, its ending or its first line; raises `_Unfit`."""
    suffix = path.suffix.lower()
    if path.name in _BY_NAME:
        return _BY_NAME[path.name]
    if suffix in {".msg", ".srv", ".action"}:
        return partial(commands.read_definition, name=path.stem)
    is_python = suffix == ".py" or (not suffix and _PYTHONS.match(data))
    is_shell = suffix in {".sh", ".bash", ".zsh"} or (not suffix and _SHELLS.match(data))
    if is_python or is_shell or suffix in _PAGES:
        reader = _python if is_python else commands.read_shell if is_shell else commands.read_page
        return reader if _NAMED.search(data) else _nothing
    if suffix not in _BY_SUFFIX:
        raise _Unfit(phrase("it is no script, launch file, definition or DMC program"))
    return _BY_SUFFIX[suffix]


def _nothing(text: str) -> Iterator[ScriptFinding]:
    del text
    yield from ()


def _python(text: str) -> Iterator[ScriptFinding]:
    depth = deepest = 0
    for bracket in re.finditer(r"[(\[{]|[)\]}]", text):
        depth = depth + 1 if bracket[0] in "([{" else max(depth - 1, 0)
        deepest = max(deepest, depth)
    if deepest > DEEPEST:
        raise _Unfit(phrase("it has more than {most} nested brackets", most=DEEPEST))
    yield from python.read(text)


_BY_NAME: dict[str, Reader] = {
    "package.xml": markup.read_package,
    "stack.xml": markup.read_rosbuild,
    "manifest.xml": markup.read_rosbuild,
    "CMakeLists.txt": commands.read_cmake,
}
_BY_SUFFIX: dict[str, Reader] = {
    ".py": _python,
    ".launch": markup.read_launch,
    ".test": markup.read_launch,
    ".msg": _nothing,
    ".srv": _nothing,
    ".action": _nothing,
    ".dmc": commands.read_dmc,
    ".sh": commands.read_shell,
    ".bash": commands.read_shell,
    ".zsh": commands.read_shell,
}
