"""Tables of arrays as gclib keeps them in files: CSV, a column for each array, its name on top."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import zip_longest
from pathlib import Path

from dmc41x3.errors import CodedError
from dmc41x3.files import write
from dmc41x3.gclib.errors import Code, GclibError


def read_text(path: str) -> str:
    """Return what stands in a file; raises `GclibError` (-10005)."""
    try:
        return Path(path).read_text(encoding="ascii")
    except (OSError, UnicodeError) as error:
        raise GclibError(Code.FILE, str(error)) from error


def write_text(path: str, text: str) -> None:
    """Write a file; raises `GclibError` (-10005)."""
    try:
        write(Path(path), text, encoding="ascii")
    except (CodedError, UnicodeError) as error:
        raise GclibError(Code.FILE, str(error)) from error


def table_of(text: str) -> dict[str, list[float]]:
    """Return the arrays that a CSV table holds; an empty cell ends a column. Raises `GclibError` (-10005)."""
    heads, *rows = [line.split(",") for line in text.splitlines() if line.strip()] or [[""]]
    names = [head.strip().removesuffix("[]") for head in heads]
    try:
        columns = [
            [float(cell) for cell in column if cell.strip()] for column in list(zip_longest(*rows, fillvalue=""))
        ]
    except ValueError as error:
        raise GclibError(Code.FILE, str(error)) from error
    if len(columns) != len(names) or not all(columns):
        raise GclibError(Code.FILE, "a column without name or numbers")
    return dict(zip(names, columns, strict=True))


def text_of(table: Mapping[str, list[float]]) -> str:
    """Return arrays as a CSV table; shorter ones end in empty cells."""
    rows = zip_longest(*([f"{value:.4f}" for value in values] for values in table.values()), fillvalue="")
    return "".join(f"{','.join(cells)}\n" for cells in (tuple(table), *rows))
