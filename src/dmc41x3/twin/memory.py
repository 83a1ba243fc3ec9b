"""What a controller keeps without power: burned parameters, program, variables and arrays, in memory or in a file.

The file is JSON with a version and a checksum for each part, written whole or not at all. A part whose checksum is
wrong comes up empty and sets its bit in `errors`; nothing that a file may hold raises.
"""

from __future__ import annotations

import json
import zlib
from contextlib import suppress
from dataclasses import dataclass, field
from enum import IntFlag
from pathlib import Path
from typing import Any, TypeAlias

from dmc41x3.files import write

VERSION = 1
"""Of the file's form; a file of another version counts as damaged."""

_LARGEST = 64 * 1024 * 1024
_LARGEST_NUMBER = 1 << 47

Parameters: TypeAlias = dict[str, dict[str, float | str]]
"""Values by name, in groups: `unit`, `A` to `H`, `S`, `T`."""


class ChecksumError(IntFlag):
    """Bits of `_RS`: which part was found damaged at power-up."""

    VARIABLES = 1
    PARAMETERS = 2
    PROGRAM = 4


_EVERYTHING = ChecksumError.VARIABLES | ChecksumError.PARAMETERS | ChecksumError.PROGRAM


@dataclass(slots=True)
class BurnedContents:
    """What is burned; None for parameters that never were. Variables and elements are raw fixed point."""

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
        """Forget everything (master reset) and remove the file."""
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
    """Take one part of a file over; tell whether it is sound."""
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
