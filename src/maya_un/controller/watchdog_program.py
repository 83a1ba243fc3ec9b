"""The program in the controller that stops the axes when the host falls silent, merged with a user's program.

It runs on thread 7. The host writes TIME into `mayabeat` periodically. The guard sleeps until that is too old. Then it
stops the sequence on its path and the axes, leaves motors and outputs unchanged, sets `mayaout`, and does nothing more
until the host clears `mayaout`. The automatic subroutines for limits and following errors send a message to the host,
so that a wait for a motion reacts at once.
"""

from __future__ import annotations

import re

from dmc41x3.i18n import phrase
from maya_un.errors import GuardBlocked

THREAD = 7
"""The thread of the guard; a user's program may use the others."""

START = "MAYAGRD"
"""Label where the guard begins."""

BEAT, OUT = "mayabeat", "mayaout"
"""Variables: TIME of the host's last beat, and whether the guard has stopped the axes (1) since it was armed."""

REPORT = "MAYA"
"""First word of the messages that the guard's subroutines send."""

SAMPLES = 1024.0
"""Samples in a second at TM 1000."""

_HEAD = "'Maya guard"
_HEAD_LINE = re.compile(rf"{_HEAD} (\d+) samples: stops ([A-H]+) ")
_CALLS = {"LIMSWI": "JS#MAYALIM", "POSERR": "JS#MAYAERR"}
_LABEL = re.compile(r"#([A-Za-z0-9_]{1,7})")
_THREAD_TAKEN = re.compile(r"XQ\s*#?\w+\s*,\s*7\b")


def text(seconds: float, letters: str = "ABC", *, reports: frozenset[str] = frozenset(_CALLS)) -> list[str]:
    """Return the guard's lines: it acts when the beat is `seconds` old and stops the axes `letters`.

    `reports` names the automatic subroutines that it includes; a user's program that has one of them calls the guard's.
    """
    samples = round(seconds * SAMPLES)
    lines = [
        f"{_HEAD} {samples} samples: stops {letters} when the host is silent for so long",
        f"#{START}",
        f"mayaleft={BEAT}-TIME+{samples}",
        # A beat in the future (TIME has wrapped, or another program wrote it) does not count as a beat.
        f"JP#MAYAOUT,(mayaleft<2)|(mayaleft>{samples})",
        "WTmayaleft,1",
        f"JP#{START}",
        "#MAYAOUT",
        "IF(_BGS=1)",
        "STS",
        "ENDIF",
        f"{OUT}=1",
        "AMS",
        f"ST{letters}",
        "#MAYAHLD",
        "WT20,1",
        f"JP#MAYAHLD,{OUT}=1",
        f"JP#{START}",
        "#MAYALIM",
        f'MG"{REPORT} limit"',
        "EN",
        "#MAYAERR",
        f'MG"{REPORT} error"',
        "EN",
    ]
    for label in sorted(reports):
        # RE 1 continues a wait that the subroutine interrupted, also a wait of a user's program.
        lines += [f"#{label}", _CALLS[label], "RE1"]
    return lines


def without(program: str) -> str:
    """Return a program without its guard, if it has one; a user's lines after the guard stay.

    Raises `GuardBlocked` for a guard that differs from the one written here: its end is unknown.
    """
    lines = program.splitlines()
    guard = _place(lines)
    return _joined(lines if guard is None else [*lines[: guard.start], *lines[guard.stop :]])


def merged(program: str, seconds: float, letters: str = "ABC") -> str:
    """Return a user's program followed by the guard, lines ended by CR LF; replaces an older guard.

    Raises `GuardBlocked` if the program has an automatic subroutine that does not call the guard's, a label of the
    guard, or a start of thread 7.
    """
    users = without(program)
    lines = users.splitlines()
    labels = {found[1] for line in lines if (found := _LABEL.match(line))}
    for label in labels:
        if label.startswith("MAYA"):
            raise GuardBlocked(
                reason=phrase("its label #{label} belongs to the guard: give it another name", label=label)
            )
    if _THREAD_TAKEN.search(users):
        raise GuardBlocked(
            reason=phrase("it starts thread {thread}, which is the guard's: take another thread", thread=THREAD)
        )
    for label in sorted(labels & _CALLS.keys()):
        if not _calls(lines, label):
            call = _CALLS[label]
            raise GuardBlocked(
                reason=phrase(
                    "its #{label} hides faults from the host: add the line {call} below #{label}",
                    label=label,
                    call=call,
                )
            )
    return _joined([*lines, *text(seconds, letters, reports=frozenset(_CALLS) - labels)])


def span(program: str) -> range | None:
    """Return the line numbers of the guard in a program (from its label on), None without a guard.

    Raises `GuardBlocked` as `without`.
    """
    guard = _place(program.splitlines())
    return None if guard is None else guard[1:]


def _place(lines: list[str]) -> range | None:
    """Return the lines of the guard, whole or cut off by an interrupted download; None without a guard."""
    first = next((index for index, line in enumerate(lines) if line.startswith(_HEAD)), None)
    if first is None:
        return None
    found = lines[first:]
    head = _HEAD_LINE.match(found[0])
    if head is None and len(found) == 1:
        return range(first, len(lines))
    for guard in [] if head is None else _forms(int(head[1]) / SAMPLES, head[2]):
        if found[: len(guard)] == guard:
            return range(first, first + len(guard))
        if "\n".join(guard).startswith("\n".join(found)):
            return range(first, len(lines))
    raise GuardBlocked(reason=phrase("its guard was changed: take its lines out, the first is {line}", line=found[0]))


def _forms(seconds: float, letters: str) -> list[list[str]]:
    """Return all guards that `text` can make, those with more reports first."""
    reports = (frozenset(_CALLS), *(frozenset({label}) for label in _CALLS), frozenset[str]())
    return [text(seconds, letters, reports=brought) for brought in reports]


def _calls(lines: list[str], label: str) -> bool:
    """Return whether a subroutine calls the guard's before the next label."""
    inside = False
    for line in lines:
        if (found := _LABEL.match(line)) is not None:
            inside = found[1] == label
        if inside and _CALLS[label] in line.partition("'")[0].replace(" ", ""):
            return True
    return False


def _joined(lines: list[str]) -> str:
    return "".join(f"{line}\r\n" for line in lines)
