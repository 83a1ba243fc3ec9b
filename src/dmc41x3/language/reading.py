"""Commands that only read: they move nothing, change no register, memory or output, and answer at once.

A command that is not known to read counts as one that changes something. So a command that Galil adds later is refused
until it is listed here. Every other register can be read by its operand: `MG _ACA`.
"""

from __future__ import annotations

import re

from dmc41x3.language.commands import ASSIGN, LINE_LIMIT, QUERY, SKIPPED, InvalidCommand, parse


def _names(text: str) -> frozenset[str]:
    return frozenset(text.split())


REPORTS = _names("ID LA LL LV QH QZ RL RP SC TA TB TD TE TH TI TP TS TT TV TZ WH")
"""Commands that report, with or without letters of axes or a number. TC is missing, because it clears the code."""

QUERIES = _names(
    "AU BD BL CA CE CW DE DP EM ER FL GA IA IL IT KD KI KP KS LD ME MT MU MW NF OF PA PL PR SM TL TN VA VF VS VV YB YC "
    "YS"
)
"""Commands that set a register, and with `?` in the place of every value report it, by Galil's command reference."""

_MESSAGE = re.compile(r'[^"{}]+(?:\{[FZ$][0-9]{1,2}(?:\.[0-9])?\})?')
"""A value, and perhaps its format. A text or another `{...}` could send to another port, or leave out the line end."""


def only_reads(text: str) -> bool:
    """Return whether a text is one command that only reads; False for a text that is no command."""
    if len(text) > LINE_LIMIT or not text.isascii() or not text.isprintable() or ";" in text or "'" in text:
        return False
    try:
        command = parse(text)
    except InvalidCommand:
        return False
    name, args = command.mnemonic, command.args
    if name == "MG":
        return all(_MESSAGE.fullmatch(part.strip()) for part in command.text.split(","))
    if command.speed is not None or command.end_speed is not None:
        return False
    if name in REPORTS:
        return not args or (not command.axes and all(isinstance(arg, int) for arg in args))
    asked = bool(args) and set(args) <= {QUERY, SKIPPED} and QUERY in args
    return asked and (name in QUERIES or name == ASSIGN)
