"""Transfer of programs (DL, UL) and arrays (QD, QU) to a controller and back.

The array must already exist (DM); its name is written without brackets.

A controller sends nothing while it receives a program. If it refuses DL, it executes the lines that follow as
commands. So a download begins with a probe, which checks that the controller accepts downloads before the first line
is sent.

A program of a host is prepared before a download as Galil's own tools do it:

| on the host | in the controller | known from |
|---|---|---|
| a line that begins with REM | nothing | Galil's command reference (REM) and gclib's preprocessor |
| a `##` line and a `//` remark, where the first two lines begin with `##` | nothing | gclib's preprocessor |
| a tab | a blank | M2FS's programmer does the same; Galil's tools leave it open |
| blanks at the end of a line | nothing | gclib's compression |
| a remark (`'`) that makes a line longer than 80 characters, or is not ASCII | nothing | gclib's compression |
| an empty line | `'`, an empty remark | Galil's terminal does so (PyGalil); error code 10 means an empty line |

Other lines stay as they are.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from dmc41x3.errors import InvalidValue, ProgramDiffers, UnexpectedReply
from dmc41x3.i18n import phrase
from dmc41x3.language.commands import LINE_LIMIT
from dmc41x3.language.numbers import SCALE, fits, fixed, parse_number

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,7}")
_SEPARATOR = re.compile(r"[,\r\n]+")
_LINE = 60
"""Longest line of array data [characters]; a line of the controller holds 80."""

_PLACES = 10**5


def require_array_name(name: str) -> None:
    """Raise `InvalidValue` for a text that cannot be the name of an array."""
    if not _NAME.fullmatch(name):
        raise InvalidValue(key="array", value=repr(name), reason="a name is a letter and up to 7 letters or digits")


def require_array_fit(name: str, first: int, count: int, length: float) -> None:
    """Raise `InvalidValue` if `count` elements from `first` on do not fit into an array of `length`."""
    if first < 0 or first + count > length:
        reason = phrase("the array has the elements 0 to {last:g}", last=length - 1)
        raise InvalidValue(
            key=name, value=phrase("elements {first} to {last}", first=first, last=first + count - 1), reason=reason
        )


def array_length(name: str) -> str:
    """Return the operand for the number of elements of an array."""
    require_array_name(name)
    return f"{name}[-1]"


def array_download(name: str, values: Sequence[float], first: int = 0) -> bytes:
    """Return the bytes that write `values` into an array. Send them in one piece; their reply is a transfer.

    Raises `InvalidValue` for a number that the controller's type cannot hold.
    """
    require_array_name(name)
    lines: list[str] = [""]
    for value in values:
        text = _literal(name, value)
        if len(lines[-1]) + len(text) >= _LINE:
            lines.append("")
        lines[-1] += f",{text}" if lines[-1] else text
    body = "\r".join(lines)
    return f"QD {name}[],{first},{first + len(values) - 1}\r{body}\r\\TC1\r".encode("ascii")


def array_upload(name: str, first: int | None = None, last: int | None = None) -> str:
    """Return the command that prints an array, or its elements `first` to `last`."""
    require_array_name(name)
    return f"QU {name}[]" if first is None or last is None else f"QU {name}[],{first},{last}"


def parse_array(command: str, text: str) -> list[float]:
    """Return the numbers that QU printed, with any separators; raises `UnexpectedReply` for any other text."""
    try:
        return [parse_number(word) for word in _SEPARATOR.split(text.strip()) if word.strip()]
    except ValueError as error:
        raise UnexpectedReply(command=command, reply=text[:40]) from error


def _literal(name: str, value: float) -> str:
    """Return the shortest decimal that the controller, which truncates, reads as this number.

    Five decimals, rounded away from zero, differ from it by less than the step of 1/65536; four, as the controller
    prints, may differ by more.
    """
    if not fits(value):
        raise InvalidValue(key=name, value=f"{value:g}", reason="an element lies between -2^31 and 2^31")
    raw = fixed(value)
    whole, rest = divmod(-(-abs(raw) * _PLACES // SCALE), _PLACES)
    sign = "-" if raw < 0 else ""
    return f"{sign}{whole}.{rest:05d}" if rest else f"{sign}{whole}"


LINES_LIMIT = 4000
"""Lines that the program memory of a DMC-41x3 holds (firmware 1.2a and later)."""

PROBE = b"DL\r'\\\rTC1\r"
"""Downloads a program of one comment and requests the error code.

If DL is refused, for example because a program runs (17), the comment is a command without effect, and TC1 returns
the reason. Otherwise no program remains that could start to run.
"""

_LINE_END = re.compile(r"\r\n|\r|\n")
_FORBIDDEN = re.compile(r"[^ -~]|\\")


def program_lines(text: str) -> tuple[str, ...]:
    """Return the lines of a program, with any line ends; text after the last line end is a line if it is not empty."""
    lines = _LINE_END.split(text)
    return tuple(lines[:-1] if not lines[-1] else lines)


def uploaded_lines(text: str) -> tuple[str, ...]:
    """Return the lines that UL printed; none for an empty program, which looks like a program of one empty line."""
    lines = program_lines(text)
    return () if lines == ("",) else lines


def require_loadable(lines: Sequence[str]) -> None:
    """Raise `InvalidValue` for lines that no controller accepts: too many, too long, or with forbidden characters."""
    if len(lines) > LINES_LIMIT:
        raise InvalidValue(
            key="program",
            value=phrase("{count:d} lines", count=len(lines)),
            reason=phrase("there is room for {most}", most=LINES_LIMIT),
        )
    for number, line in enumerate(lines):
        if len(line) > LINE_LIMIT:
            raise InvalidValue(
                key=phrase("line {number:d}", number=number),
                value=repr(line),
                reason=phrase("a line holds {most} characters", most=LINE_LIMIT),
            )
        if (found := _FORBIDDEN.search(line)) is not None:
            raise InvalidValue(
                key=phrase("line {number:d}", number=number),
                value=repr(line),
                reason=phrase("{line!r} ends or breaks a download", line=found[0]),
            )


def download_probe(keep: int) -> bytes:
    """Return the bytes that check whether downloads are accepted; if lines are kept, the comment follows all lines."""
    return b"DL #" + PROBE[2:] if keep else PROBE


def program_download(lines: Sequence[str], keep: int = 0) -> bytes:
    """Return the bytes that download a program. Send them in one piece; their reply is a transfer.

    The controller already holds the first `keep` lines: only the lines after them are sent (Galil DL n).
    """
    body = "".join(f"{line}\r" for line in lines[keep:])
    return f"DL{f' {keep}' if keep else ''}\r{body}\\TC1\r".encode("ascii")


def require_same_lines(sent: Sequence[str], found: Sequence[str]) -> None:
    """Raise `ProgramDiffers` for the first line that differs between the controller's program and the one sent."""
    if not any(sent) and not any(found) and len(sent) <= 1:
        return
    for number in range(max(len(sent), len(found))):
        ours = sent[number] if number < len(sent) else None
        theirs = found[number] if number < len(found) else None
        if ours != theirs:
            raise ProgramDiffers(line=number, sent=repr(ours), found=repr(theirs))


_REM = re.compile(r"\s*REM(?!\w+\s*=)")
_HASHES = re.compile(r"\s*##")
_TOKEN = re.compile(r"""[^"'/]+|"[^"]*"?|'|//|/""")


@dataclass(frozen=True, slots=True)
class ProgramSource:
    """Lines ready for a download, and the number of source lines changed in each way."""

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
    """Return a program ready for download: without REM, host remarks, tabs, and comments that do not fit.

    Empty lines become comments. Lines that a controller would refuse stay unchanged; the download then reports them.
    """
    lines = program_lines(text)
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
    """Return a line up to a `mark` outside quotes; the search ends at a `'`, which begins a comment."""
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
