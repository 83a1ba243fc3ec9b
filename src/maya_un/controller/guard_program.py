"""The program in the controller that stops the axes when the host falls silent, and how it lives beside a user's.

It runs on thread 7. The host writes TIME into `mayabeat` again and again; the guard sleeps until that is too old,
then stops the sequence on its path and the axes, keeps motors and outputs as they are, sets `mayaout`, and does
nothing more until the host takes that back. The automatic subroutines for limits and following errors report to the
host, so that a wait for a motion hears of them at once.
"""

from __future__ import annotations

import re

from maya_un.errors import GuardBlocked

THREAD = 7
"""The thread of the guard; a user's program has the others."""

START = "MAYAGRD"
"""Label where the guard begins."""

BEAT, OUT = "mayabeat", "mayaout"
"""Variables: TIME of the host's last beat, and whether the guard has stopped the axes (1) since it was armed."""

REPORT = "MAYA"
"""First word of the messages that the guard's subroutines send."""

SAMPLES = 1024.0
"""Samples in a second at TM 1000."""

_HEAD = "'Maya guard"
_CALLS = {"LIMSWI": "JS#MAYALIM", "POSERR": "JS#MAYAERR"}
_LABEL = re.compile(r"#([A-Za-z0-9_]{1,7})")
_THREAD_TAKEN = re.compile(r"XQ\s*#?\w+\s*,\s*7\b")


def text(seconds: float, letters: str = "ABC", *, reports: frozenset[str] = frozenset(_CALLS)) -> list[str]:
    """Return the guard's lines: it acts when the beat is `seconds` old and stops the axes `letters`.

    `reports` names the automatic subroutines it brings; a user's program that has one of them calls ours.
    """
    samples = round(seconds * SAMPLES)
    lines = [
        f"{_HEAD} {samples} samples: stops {letters} when the host is silent for so long",
        f"#{START}",
        f"mayaleft={BEAT}-TIME+{samples}",
        # A beat from the future (TIME has wrapped, or somebody wrote nonsense) is no beat.
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
        # RE 1 lets a wait that the subroutine interrupted go on, also that of a user's program.
        lines += [f"#{label}", _CALLS[label], "RE1"]
    return lines


def without(program: str) -> str:
    """Return a program without the guard that stands at its end, if one does."""
    lines = program.splitlines()
    for index, line in enumerate(lines):
        if line.startswith(_HEAD):
            return _joined(lines[:index])
    return _joined(lines)


def merged(program: str, seconds: float, letters: str = "ABC") -> str:
    """Return a user's program with the guard behind it, lines ended by CR LF; an older guard is replaced.

    Raises `GuardBlocked` where the program has an automatic subroutine of its own that does not call ours, a label
    of ours, or a start of thread 7.
    """
    users = without(program)
    lines = users.splitlines()
    labels = {found[1] for line in lines if (found := _LABEL.match(line))}
    for label in labels:
        if label.startswith("MAYA"):
            raise GuardBlocked(reason=f"its label #{label} belongs to the guard: give it another name")
    if _THREAD_TAKEN.search(users):
        raise GuardBlocked(reason=f"it starts thread {THREAD}, which is the guard's: take another thread")
    for label in sorted(labels & _CALLS.keys()):
        if not _calls(lines, label):
            call = _CALLS[label]
            raise GuardBlocked(reason=f"its #{label} hides faults from the host: add the line {call} below #{label}")
    return _joined([*lines, *text(seconds, letters, reports=frozenset(_CALLS) - labels)])


def span(program: str) -> range | None:
    """Return the lines of a program that are the guard's (from its label on), None where it has none."""
    lines = program.splitlines()
    if f"#{START}" not in lines:
        return None
    first = lines.index(f"#{START}")
    return range(first, len(lines))


def _calls(lines: list[str], label: str) -> bool:
    """Tell whether a subroutine calls ours before its first label or end."""
    begin = next(index for index, line in enumerate(lines) if line.startswith(f"#{label}"))
    for line in lines[begin:]:
        if _CALLS[label] in line.replace(" ", ""):
            return True
        if line.startswith("#") and not line.startswith(f"#{label}"):
            return False
    return False


def _joined(lines: list[str]) -> str:
    return "".join(f"{line}\r\n" for line in lines)
