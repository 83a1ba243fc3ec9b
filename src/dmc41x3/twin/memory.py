"""Arrays of the controller (DM, DA), their recorder (RA, RD, RC), and the burned memory (BN, BP, BV).

The burned memory holds parameters, program, variables and arrays, in the process or in a file.

The file is JSON with a version and a checksum for each part, written whole or not at all. A part with a wrong
checksum is empty after power-up and sets its bit in `errors`; no content of a file raises.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from enum import IntFlag
from math import floor, inf
from pathlib import Path
from typing import Any, TypeAlias

from dmc41x3.files import write
from dmc41x3.language.codes import ErrorCode
from dmc41x3.twin.expressions import Rejection

MOST_ELEMENTS = 24_000
"""Elements of all arrays together (DM, from firmware 1.2a on)."""

MOST_ARRAYS = 30

LENGTH = -1
"""Index that returns the length of an array."""


class Arrays:
    """The arrays by name; elements are raw fixed point."""

    def __init__(self) -> None:
        self._rows: dict[str, list[int]] = {}

    def __contains__(self, name: str) -> bool:
        return name in self._rows

    def __iter__(self) -> Iterator[str]:
        return iter(sorted(self._rows))

    def __len__(self) -> int:
        return len(self._rows)

    @property
    def free(self) -> int:
        """Number of elements that can still be dimensioned (`_DM`)."""
        return MOST_ELEMENTS - sum(map(len, self._rows.values()))

    def dimension(self, name: str, size: int) -> None:
        """Create an array of zeros.

        Raises `Rejection`: 6 for a size below 1 or above the memory, 66 if too little memory is left, 67 if there are
        too many arrays, 9 if the array exists with another size. If it exists with this size, nothing changes, so that
        a program can be started twice; the behaviour of a real controller is not documented.
        """
        if not 1 <= size <= MOST_ELEMENTS:
            raise Rejection(ErrorCode.OUT_OF_RANGE)
        present = self._rows.get(name)
        if present is not None:
            if len(present) != size:
                raise Rejection(ErrorCode.VARIABLE_ERROR)
            return
        if len(self._rows) >= MOST_ARRAYS:
            raise Rejection(ErrorCode.TOO_MANY_VARIABLES)
        if size > self.free:
            raise Rejection(ErrorCode.ARRAY_SPACE_FULL)
        self._rows[name] = [0] * size

    def row(self, name: str) -> list[int]:
        """Return the elements of an array, to be used in place; raises `Rejection` (82) for an unknown one."""
        try:
            return self._rows[name]
        except KeyError:
            raise Rejection(ErrorCode.UNDEFINED_ARRAY) from None

    def element(self, name: str, index: int) -> int:
        """Return an element; raises `Rejection` (57, 56) for an unknown array or an index outside it."""
        row = self._rows.get(name)
        if row is None:
            raise Rejection(ErrorCode.BAD_FUNCTION)
        if 0 <= index < len(row):
            return row[index]
        if index == LENGTH:
            return len(row) << 16
        raise Rejection(ErrorCode.INDEX_OUT_OF_RANGE)

    def assign(self, name: str, index: int, value: int) -> None:
        """Set an element; raises `Rejection` (82, 56) for an unknown array or an index outside it."""
        row = self.row(name)
        if not 0 <= index < len(row):
            raise Rejection(ErrorCode.INDEX_OUT_OF_RANGE)
        row[index] = value

    def release(self, name: str) -> None:
        """Delete an array (DA); raises `Rejection` (82) for an unknown one."""
        self.row(name)
        del self._rows[name]

    def clear(self) -> None:
        """Delete all arrays."""
        self._rows.clear()

    def contents(self) -> dict[str, list[int]]:
        """Return a copy of all arrays."""
        return {name: list(row) for name, row in self._rows.items()}

    def restore(self, contents: dict[str, list[int]]) -> None:
        """Replace all arrays by `contents`."""
        self._rows = {name: list(row) for name, row in contents.items()}


_SAME = 1e-6
"""A time up to this fraction of a sample before a sample counts as that sample."""

MOST = 8
"""Arrays, and sources, that can be recorded at once."""

Source: TypeAlias = Callable[[], int]
"""Returns the value to record: raw fixed point, at the present time."""


class ArrayRecorder:
    """An activity that reads its sources at the samples of the servo.

    `recording` is `_RC`, `next_index` is `_RD`: the element that is written next.
    """

    watching = False

    def __init__(self, arrays: Arrays) -> None:
        self._arrays = arrays
        self.reset()

    @property
    def active(self) -> bool:
        """Whether it records."""
        return self.recording

    def reset(self) -> None:
        """Clear arrays and sources, as a power-up does."""
        self._names: tuple[str, ...] = ()
        self._sources: tuple[Source, ...] = ()
        self.recording = False
        self.next_index = 0

    def choose_arrays(self, names: Sequence[str]) -> None:
        """Set the arrays to record to (RA); raises `Rejection`: 80 while recording, 82 for an unknown array."""
        self._stopped()
        for name in names:
            self._arrays.row(name)
        self._names = tuple(names)

    def choose_sources(self, sources: Sequence[Source]) -> None:
        """Set the sources to record (RD), in the order of the arrays; raises `Rejection` (80) while recording."""
        self._stopped()
        self._sources = tuple(sources)

    def begin(self, now: float, started: float, period: float, every: int, count: int) -> None:
        """Record once in `every` samples (RC), from the next sample after `now` [s].

        Samples are a `period` apart [s] and count from `started` [s]. The recording ends after `count` records, or when
        the shortest array is full for 0; with a negative `count` it repeats from the first element. Raises `Rejection`:
        80 while recording, 81 without an array for each source and a source for each array, 84 for more records than an
        array has elements.
        """
        self._stopped()
        if not self._names or len(self._names) != len(self._sources):
            raise Rejection(ErrorCode.NO_RECORDING_SOURCE)
        room = min(len(self._arrays.row(name)) for name in self._names)
        if abs(count) > room:
            raise Rejection(ErrorCode.TOO_MANY_ELEMENTS)
        self._count, self._circular = abs(count) or room, count < 0
        self._started, self._period, self._every = started, period, every
        self._tick = floor((now - started) / period + _SAME) + 1
        self.next_index = 0
        self.recording = True

    def stop(self) -> None:
        """End the recording (RC 0); idempotent."""
        self.recording = False

    def uses(self, name: str) -> bool:
        """Return whether an array is being recorded to."""
        return self.recording and name in self._names

    def next_event(self) -> float:
        """Return the time of the next record [s], infinity if nothing is recorded."""
        return self._started + self._tick * self._period if self.recording else inf

    def look(self, now: float) -> None:
        """Take the records that are due."""
        while self.recording and self.next_event() <= now:
            for name, source in zip(self._names, self._sources, strict=True):
                self._arrays.assign(name, self.next_index, source())
            self._tick += self._every
            self.next_index += 1
            if self.next_index == self._count:
                self.recording = self._circular
                self.next_index = 0 if self._circular else self.next_index

    def _stopped(self) -> None:
        if self.recording:
            raise Rejection(ErrorCode.RECORDING)


VERSION = 1
"""Version of the file format; a file of another version counts as damaged."""

_LARGEST = 64 * 1024 * 1024
_LARGEST_NUMBER = 1 << 47

Parameters: TypeAlias = dict[str, dict[str, float | str]]
"""Values by name, in groups: `unit`, `A` to `H`, `S`, `T`."""


class ChecksumError(IntFlag):
    """Bits of `_RS`: the parts that were damaged at power-up."""

    VARIABLES = 1
    PARAMETERS = 2
    PROGRAM = 4


_EVERYTHING = ChecksumError.VARIABLES | ChecksumError.PARAMETERS | ChecksumError.PROGRAM


@dataclass(slots=True)
class BurnedContents:
    """The burned memory; None if parameters were never burned. Variables and elements are raw fixed point."""

    parameters: Parameters | None = None
    program: str = ""
    variables: dict[str, int] = field(default_factory=dict[str, int])
    arrays: dict[str, list[int]] = field(default_factory=dict[str, list[int]])


class Memory:
    """Burned contents. With a `path` they are read from that file, and written to it whenever they change."""

    def __init__(self, path: Path | None = None) -> None:
        self.path = path
        self.contents = BurnedContents()
        self.errors = ChecksumError(0)
        self.load()

    def load(self) -> None:
        """Read the file again, as every power-up does; without a file the contents stay as they are."""
        if self.path is None or not self.path.exists():
            return
        self.contents, self.errors = _read(self.path)

    def store(self) -> None:
        """Write the file; raises `FileUnwritable`."""
        self.errors = ChecksumError(0)
        if self.path is None:
            return
        write(self.path, json.dumps(_written(self.contents), indent=1))

    def erase(self) -> None:
        """Erase everything (master reset) and remove the file."""
        self.contents, self.errors = BurnedContents(), ChecksumError(0)
        if self.path is not None:
            with suppress(OSError):
                self.path.unlink(missing_ok=True)


def _written(contents: BurnedContents) -> dict[str, Any]:
    parts: dict[str, Any] = {
        "parameters": contents.parameters,
        "program": contents.program,
        "variables": {"variables": contents.variables, "arrays": contents.arrays},
    }
    return {"version": VERSION} | {name: {"checksum": _checksum(data), "data": data} for name, data in parts.items()}


def _checksum(data: Any) -> int:
    return zlib.crc32(json.dumps(data, sort_keys=True).encode("utf-8"))


def _read(path: Path) -> tuple[BurnedContents, ChecksumError]:
    try:
        if path.stat().st_size > _LARGEST:
            return BurnedContents(), _EVERYTHING
        found = json.loads(path.read_text(encoding="utf-8"))
        if found["version"] != VERSION:
            return BurnedContents(), _EVERYTHING
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return BurnedContents(), _EVERYTHING
    contents, errors = BurnedContents(), ChecksumError(0)
    for name, bit in _PARTS.items():
        if not _take(contents, name, found.get(name)):
            errors |= bit
    return contents, errors


_PARTS = {
    "parameters": ChecksumError.PARAMETERS,
    "program": ChecksumError.PROGRAM,
    "variables": ChecksumError.VARIABLES,
}


def _take(contents: BurnedContents, name: str, part: Any) -> bool:
    """Restore one part of a file; return whether the part is intact."""
    if not isinstance(part, dict) or part.get("checksum") != _checksum(part.get("data")):
        return False
    data = part["data"]
    if name == "program":
        contents.program = data if isinstance(data, str) and data.isascii() else ""
        return contents.program == data
    if name == "parameters":
        if data is not None and not _is_parameters(data):
            return False
        contents.parameters = data
        return True
    if not isinstance(data, dict) or not _is_variables(data.get("variables")) or not _is_arrays(data.get("arrays")):
        return False
    contents.variables, contents.arrays = data["variables"], data["arrays"]
    return True


def _is_parameters(data: Any) -> bool:
    return isinstance(data, dict) and all(
        isinstance(group, dict) and all(isinstance(value, str) or _is_number(value) for value in group.values())
        for group in data.values()
    )


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and -_LARGEST_NUMBER <= value <= _LARGEST_NUMBER


def _is_raw(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and -(1 << 47) <= value < 1 << 47


def _is_variables(data: Any) -> bool:
    return isinstance(data, dict) and all(_is_raw(value) for value in data.values())


def _is_arrays(data: Any) -> bool:
    return isinstance(data, dict) and all(
        isinstance(elements, list) and all(_is_raw(element) for element in elements) for elements in data.values()
    )
