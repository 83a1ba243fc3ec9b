"""Programs on their way into a controller and back: DL and UL, their bytes and what they must agree in.

A controller says nothing while it takes a program in, and takes a download whose DL it refused for commands. So a
download begins with a probe that proves, before the first line of it is sent, that downloads are accepted now.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from dmc41x3.errors import InvalidValue, ProgramDiffers
from dmc41x3.language.commands import LINE_LIMIT

LINES_LIMIT = 4000
"""Lines that the program memory of a DMC-41x3 holds (firmware 1.2a and later)."""

PROBE = b"DL\r'\\\rTC1\r"
"""Downloads a program of one comment and asks for the code.

Where DL is refused, for one because a program runs (17), the comment is a command that does nothing, and TC1 says why.
Afterwards no program is left that could start to run.
"""

_LINE_END = re.compile(r"\r\n|\r|\n")
_FORBIDDEN = re.compile(r"[^ -~]|\\")


def split(text: str) -> tuple[str, ...]:
    """Return the lines of a program, whatever ends them; what is behind the last end is a line if it is not empty."""
    lines = _LINE_END.split(text)
    return tuple(lines[:-1] if not lines[-1] else lines)


def uploaded(text: str) -> tuple[str, ...]:
    """Return the lines that UL printed; an empty program and one of a single empty line look the same and are none."""
    lines = split(text)
    return () if lines == ("",) else lines


def require_loadable(lines: Sequence[str]) -> None:
    """Raise `InvalidValue` for lines that no controller takes: too many, too long, or with other than ASCII."""
    if len(lines) > LINES_LIMIT:
        raise InvalidValue(key="program", value=f"{len(lines)} lines", reason=f"there is room for {LINES_LIMIT}")
    for number, line in enumerate(lines):
        if len(line) > LINE_LIMIT:
            raise InvalidValue(key=f"line {number}", value=repr(line), reason=f"a line holds {LINE_LIMIT} characters")
        if (found := _FORBIDDEN.search(line)) is not None:
            raise InvalidValue(key=f"line {number}", value=repr(line), reason=f"{found[0]!r} ends or breaks a download")


def probe(keep: int) -> bytes:
    """Return the bytes that ask whether downloads are accepted; beside lines to keep, the comment goes behind all."""
    return b"DL #" + PROBE[2:] if keep else PROBE


def download(lines: Sequence[str], keep: int = 0) -> bytes:
    """Return the bytes that put a program into a controller, to be sent in one piece; a transfer answers them.

    The first `keep` lines are those that it holds already: only what is behind them is sent (Galil DL n).
    """
    body = "".join(f"{line}\r" for line in lines[keep:])
    return f"DL{f' {keep}' if keep else ''}\r{body}\\TC1\r".encode("ascii")


def require_same(sent: Sequence[str], found: Sequence[str]) -> None:
    """Raise `ProgramDiffers` for the first line in which the controller's program is not the one sent."""
    if not any(sent) and not any(found) and len(sent) <= 1:
        return
    for number in range(max(len(sent), len(found))):
        ours = sent[number] if number < len(sent) else None
        theirs = found[number] if number < len(found) else None
        if ours != theirs:
            raise ProgramDiffers(line=number, sent=repr(ours), found=repr(theirs))
