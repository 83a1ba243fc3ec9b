"""Points of a calibration, and their file.

A file of measured points is a comma-separated table with one row per point. The columns `a`, `b`, `c` (or `a_counts`,
...) are encoder counts; `a_rad`, `b_m`, `c_m` are joints by the current configuration; `x`, `y`, `z` are the gripper
point in metres, and `sigma` is the standard error of each of them [m]. A line `# datum A B C` contains the counts of
the short-end switches after homing when the points were measured; if a calibration has moved them since, the counts are
corrected.
"""

from __future__ import annotations

import csv
import hashlib
import os
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from math import dist, isfinite
from pathlib import Path

import numpy as np

from dmc41x3.files import open_own, read_bytes, unwritable, writable_place
from dmc41x3.i18n import phrase
from maya_un.axes import AXES
from maya_un.config import Config, Units
from maya_un.config.model import HALF_TURN
from maya_un.errors import FileUnreadable, InvalidValue
from maya_un.kinematics.calibration import Observations
from maya_un.values import Point

Counts = tuple[int, int, int]
"""Encoder counts of a, b, c."""

Datum = tuple[float, float, float]
"""Counts of the short-end switches of a, b, c by the configuration; homing rounds them to integers."""

MOST_BYTES = 4_000_000
"""Maximum size of a file [bytes]: some fifty thousand points."""

HEAD = ("a_counts", "b_counts", "c_counts", "x", "y", "z")
"""The columns of a file written by `maya calibrate collect`."""

LONGEST = 10.0
"""Maximum length of a line and of a coordinate [m]; larger values are probably in millimetres."""

_JOINTS = {"a": "a_rad", "b": "b_m", "c": "c_m"}
_PLACE = ("x", "y", "z")
_NUMBER = r"\s+(-?\d+(?:\.\d+)?)"
_DATUM = re.compile(rf"#\s*datum{_NUMBER * 3}")


@dataclass(frozen=True, slots=True)
class PointFile:
    """A file of points: its observations, its `datum` if it has one, its header, and the SHA-256 of its text."""

    observations: Observations
    datum: Datum | None
    head: tuple[str, ...]
    digest: str

    def moved(self, way: Sequence[float]) -> PointFile:
        """Return the same points with `way` added to their counts, after the switches have moved to other counts."""
        seen = self.observations
        counts = seen.counts + np.array(way)
        return replace(self, observations=Observations(counts, seen.points, seen.sigma, seen.rows))


def datum_of(config: Config) -> Datum:
    """Return the counts that a configuration gives the short-end switches of a, b, c."""
    per_unit = Units.of(config).per_unit
    a, b, c = (config.axes[axis].minimum * per_unit[axis] for axis in range(3))
    return a, b, c


def between(then: Datum, now: Datum) -> Datum:
    """Return the change of the counts of the switches."""
    return now[0] - then[0], now[1] - then[1], now[2] - then[2]


def read(path: Path, config: Config) -> PointFile:
    """Return the points of a file, with the counts of `config`.

    Raises `FileUnreadable`, and `InvalidValue` with the row (line of the file) and column of the error.
    """
    return parsed(content(path), path, config)


def parsed(data: bytes, path: Path, config: Config) -> PointFile:
    """Return the points in the content `data` of a file, as `read` does."""
    try:
        lines = data.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise FileUnreadable(path=path, reason="it is not UTF-8 text") from error
    datum = next((_three(found) for line in lines if (found := _DATUM.fullmatch(line.strip()))), None)
    rows = [(number, _cells(line)) for number, line in enumerate(lines, 1) if line.strip() and line.strip()[0] != "#"]
    if not rows:
        raise FileUnreadable(path=path, reason="it is empty")
    table = _PointTable(path, config, datum, *rows[0])
    measured = PointFile(table.observations(rows[1:]), datum, table.head, hashlib.sha256(data).hexdigest())
    return measured if datum is None else measured.moved(between(datum, datum_of(config)))


def content(path: Path) -> bytes:
    """Return the content of a file of points; raises `FileUnreadable`."""
    return read_bytes(path, MOST_BYTES)


def _cells(line: str) -> list[str]:
    try:
        return [cell.strip() for cell in next(csv.reader([line], strict=True))]
    except (csv.Error, StopIteration):
        return [line]


def _three(found: re.Match[str]) -> Datum:
    a, b, c = (float(word) for word in found.groups())
    return a, b, c


class _PointTable:
    """Rows below a header, with an error message for each invalid row."""

    def __init__(self, path: Path, config: Config, datum: Datum | None, line: int, head: Sequence[str]) -> None:
        self._path = path
        self._config = config
        self._per_unit = Units.of(config).per_unit
        self.head = self._head = tuple(name.lower() for name in head)
        self._columns = self._understood(line)
        self._sigma = "sigma" in self._head
        if datum is not None and self._columns["a"] == "a_rad":
            raise self._wrong(line, "a_rad", "", phrase("a file with a datum holds counts"))

    def observations(self, rows: Sequence[tuple[int, list[str]]]) -> Observations:
        """Return the points of all rows; raises `FileUnreadable` without rows."""
        if not rows:
            raise FileUnreadable(path=self._path, reason="it holds no points below its head")
        read = [self._row(number, cells) for number, cells in rows]
        counts = np.array([row[:3] for row in read])
        self._require_counts(rows[0][0], counts.max(axis=0).tolist())
        for (number, _), row in zip(rows, read, strict=True):
            self._require_possible(number, row)
        sigma = np.array([row[6] for row in read]) if self._sigma else None
        points = np.array([row[3:6] for row in read])
        return Observations(counts, points, sigma, tuple(number for number, _ in rows))

    def _wrong(self, line: int, column: str, value: object, reason: str) -> InvalidValue:
        return InvalidValue(
            key=phrase("{file}, row {line}, column {column}", file=self._path.name, line=line, column=column),
            value=repr(value),
            reason=reason,
        )

    def _understood(self, line: int) -> Mapping[str, str]:
        """Return the column of each axis; raises `InvalidValue` for an invalid header."""
        known = {"a", "b", "c", *(f"{axis}_counts" for axis in AXES), *_JOINTS.values(), *_PLACE, "sigma"}
        for name in self._head:
            if name not in known or self._head.count(name) > 1:
                reason = (
                    phrase("it appears twice")
                    if name in known
                    else phrase("the columns are {columns}, separated by commas", columns=_HEAD)
                )
                raise self._wrong(line, name, name, reason)
        columns = self._axes()
        if columns is None:
            raise self._wrong(line, "a", ",".join(self._head), phrase("the columns are {columns}", columns=_HEAD))
        missing = [name for name in _PLACE if name not in self._head]
        extra = [name for name in self._head if name not in {*columns.values(), *_PLACE, "sigma"}]
        if missing or extra:
            reason = phrase("it is missing") if missing else phrase("counts or joints, not both")
            raise self._wrong(line, (missing or extra)[0], ",".join(self._head), reason)
        return columns

    def _axes(self) -> dict[str, str] | None:
        for names in ((*AXES,), tuple(f"{axis}_counts" for axis in AXES), tuple(_JOINTS.values())):
            if set(names) <= set(self._head):
                return dict[str, str](zip(AXES, names, strict=True))
        return None

    def _row(self, line: int, cells: Sequence[str]) -> list[float]:
        """Return counts, place and sigma of a row; raises `InvalidValue`."""
        if len(cells) != len(self._head):
            reason = phrase(
                "the head names {columns} columns, here are {given}", columns=len(self._head), given=len(cells)
            )
            raise self._wrong(line, self._head[min(len(cells), len(self._head) - 1)], ",".join(cells), reason)
        said = dict(zip(self._head, cells, strict=True))
        row = [self._number(line, column, said[column]) for column in (*self._columns.values(), *_PLACE)]
        for index, name in enumerate(self._columns.values()):
            if name in _JOINTS.values():
                row[index] *= self._per_unit[index]
        if self._sigma:
            sigma = self._number(line, "sigma", said["sigma"])
            if not 0.0 < sigma < 1.0:
                raise self._wrong(line, "sigma", said["sigma"], phrase("it is above 0 and below 1 m"))
            row.append(sigma)
        return row

    def _number(self, line: int, column: str, text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            raise self._wrong(line, column, text, phrase("it is a number with a point, without a unit")) from None
        if not isfinite(value):
            raise self._wrong(line, column, text, phrase("it is not finite"))
        return value

    def _require_counts(self, line: int, largest: Sequence[float]) -> None:
        """Refuse lengths in columns of counts: a line is thousands of counts long."""
        column = self._columns["b"]
        if column not in _JOINTS.values() and largest[1] < 100.0 and largest[2] < 100.0:
            reason = phrase("these look like lengths; call the columns a_rad, b_m, c_m")
            raise self._wrong(line, column, largest[1], reason)

    def _require_possible(self, line: int, row: Sequence[float]) -> None:
        joints = [row[axis] / self._per_unit[axis] for axis in range(3)]
        if abs(joints[0]) > 2.0 * HALF_TURN:
            raise self._wrong(
                line, self._columns["a"], row[0], phrase("that is {angle:.4g} rad, more than a turn", angle=joints[0])
            )
        for axis in (1, 2):
            if not 0.0 < joints[axis] < LONGEST:
                reason = phrase("that is a line of {length:.4g} m", length=joints[axis])
                raise self._wrong(line, self._columns[AXES[axis]], row[axis], reason)
        for column, value in zip(_PLACE, row[3:6], strict=True):
            if abs(value) > LONGEST:
                raise self._wrong(line, column, value, phrase("it is a length in m; this looks like millimetres"))


_HEAD = phrase("a,b,c,x,y,z and perhaps sigma (a_rad,b_m,c_m where they are joints)")


class PointNotebook:
    """A file of points, to which rows are appended; when `add` returns, the row is on the disk."""

    def __init__(self, path: Path, config: Config) -> None:
        """Open a file to continue, or create it; raises `FileUnwritable`."""
        self._path = path
        datum = " ".join(f"{counts:.3f}" for counts in datum_of(config))
        if not is_there(path):
            self._append(
                f"# Measured for `maya calibrate`; homing put the switches at these counts.\n# datum {datum}\n"
            )
            self._append(",".join(HEAD) + "\n")
        elif not _ends_a_line(path):
            self._append("\n")

    def add(self, counts: Counts, place: Point) -> None:
        """Append a point; raises `FileUnwritable`."""
        self._append(",".join([*(str(count) for count in counts), *(f"{value:.6f}" for value in place)]) + "\n")

    def _append(self, text: str) -> None:
        """Append text, completely or not at all: half a row would be read as another number."""
        before = self._path.stat().st_size if is_there(self._path) else 0
        try:
            descriptor = open_own(writable_place(self._path), os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o666)
            with os.fdopen(descriptor, "a", encoding="utf-8") as file:
                file.write(text)
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            with suppress(OSError):
                os.truncate(self._path, before)
            raise unwritable(self._path, error) from error


_WHOLE = 1.0
"""Data of switches that differ by less than this are equal [counts]."""


def require_same_origin(measured: PointFile, path: Path, config: Config) -> None:
    """Raise `InvalidValue` unless rows of `PointNotebook` with this configuration can be appended to a file."""
    datum = measured.datum
    if measured.head != HEAD or datum is None or dist(datum, datum_of(config)) > _WHOLE:
        reason = phrase("another command or configuration created it; give another file")
        raise InvalidValue(key="FILE", value=str(path), reason=reason)


def holds_rows(text: str) -> bool:
    """Return whether the content of a file has more than the header that `PointNotebook` writes."""
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    return lines != [",".join(HEAD)]


MOST_OFF = 0.5
"""Largest plausible deviation from the configuration [m]; a larger one means mixed-up coordinates or units."""


def deviation(measured: Point, expected: Point) -> float:
    """Return the distance of a measured point from the one by the configuration [m].

    Raises `InvalidValue` for one that is not plausible.
    """
    for axis, value in zip("xyz", measured, strict=True):
        if abs(value) > LONGEST:
            raise InvalidValue(key=axis, value=value, reason="that is in m; write mm behind millimetres")
    off = dist(expected, measured)
    if off > MOST_OFF:
        reason = phrase(
            "that is {off:.1f} m from where the configuration has it; mind the order and the signs", off=off
        )
        raise InvalidValue(key="x y z", value=repr(tuple(measured)), reason=reason)
    return off


def is_there(path: Path) -> bool:
    """Return whether a path exists; False also for an impossible path."""
    with suppress(OSError):  # a name that is too long, or a folder without read access
        return path.exists()
    return False


def _ends_a_line(path: Path) -> bool:
    """Return whether a file ends with a complete line; after a power cut it may not."""
    return content(path).endswith(b"\n")
