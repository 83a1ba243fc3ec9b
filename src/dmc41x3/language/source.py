"""A program as it is written on a host, made ready for a controller as Galil's own tools do before a download.

| on the host | in the controller | known from |
|---|---|---|
| a line that begins with REM | nothing | Galil's command reference (REM) and gclib's preprocessor |
| a `##` line and a `//` remark, where the first two lines begin with `##` | nothing | gclib's preprocessor |
| a tab | a blank | M2FS's programmer does the same; Galil's tools leave it open |
| blanks at the end of a line | nothing | gclib's compression |
| a remark (`'`) that makes a line longer than 80 characters, or is not ASCII | nothing | gclib's compression |
| an empty line | `'`, an empty remark | Galil's terminal does so (PyGalil); code 10 is an empty line |

Other lines stay as they are.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from dmc41x3.language.commands import LINE_LIMIT
from dmc41x3.language.program import split

_REM = re.compile(r"\s*REM(?!\w+\s*=)")
_HASHES = re.compile(r"\s*##")
_TOKEN = re.compile(r"""[^"'/]+|"[^"]*"?|'|//|/""")


@dataclass(frozen=True, slots=True)
class ProgramSource:
    """Lines ready for a download, and how many lines of the source were changed in which way."""

    lines: tuple[str, ...]
    remarks: int = 0
    tabs: int = 0
    comments: int = 0
    empty: int = 0

    @property
    def text(self) -> str:
        """The program, each line ended by a line feed."""
        return "".join(f"{line}\n" for line in self.lines)

    @property
    def changes(self) -> tuple[str, ...]:
        """Texts about the changes; empty without any."""
        found = (
            (self.remarks, "left out {} of REM or host remarks"),
            (self.tabs, "replaced tabs by blanks in {}"),
            (self.comments, "cut off the comment of {}"),
            (self.empty, "turned {} without text into comments"),
        )
        return tuple(text.format(f"{count} line{'s' * (count != 1)}") for count, text in found if count)


def prepared(text: str) -> ProgramSource:
    """Return a program as it goes to a controller; what no controller takes stays in it, for the download to refuse."""
    lines = split(text)
    marked = len(lines) > 1 and all(_HASHES.match(line) for line in lines[:2])
    kept: list[str] = []
    remarks = tabs = comments = empty = 0
    for line in lines:
        if _REM.match(line) or (marked and _HASHES.match(line)):
            remarks += 1
            continue
        tabs += "\t" in line
        plain = (_code(line, "//") if marked else line).replace("\t", " ").rstrip()
        fits = len(plain) <= LINE_LIMIT and plain.isascii()
        short = plain if fits else _code(plain, "'").rstrip(" ;") or "'"
        comments += short != plain
        empty += not short
        kept.append(short or "'")
    return ProgramSource(tuple(kept), remarks, tabs, comments, empty)


def _code(line: str, mark: str) -> str:
    """Return a line up to a mark that stands outside of quotes; a `'` ends the search, what follows is a comment."""
    return "".join(_until(line, mark))


def _until(line: str, mark: str) -> Iterator[str]:
    for found in _TOKEN.finditer(line):
        token = found[0]
        if token == mark:
            return
        if token == "'":
            yield line[found.start() :]
            return
        yield token
