"""What may come next on the line: pure text in, candidates out."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import NamedTuple

from dmc41x3.cli.terminal import guide
from dmc41x3.cli.terminal.names import CompletionNames

WORDS = {
    ":watch": "EXPR: show an expression in the panel",
    ":unwatch": "[EXPR]: take it away, or all",
    ":upload": "FILE: keep the controller's program",
    ":download": "FILE: replace the controller's program",
    ":scope": "CHANNELS [--rate N] [--for S] [--trigger EXPR] [--csv FILE] [--png FILE]",
    ":wait": "SECONDS: let the next lines wait",
    ":stop": "stop what moves (F12)",
    ":messages": "have messages of programs come here",
    ":panel": "show or hide the axes (F2)",
    ":reconnect": "connect again (F5)",
    ":help": "this page (F1)",
    ":quit": "end (Ctrl-D)",
}
"""The terminal's own words."""

_HELP = re.compile(r"(?:help\s+|\?\s*)(\w*)$")
_LABEL = re.compile(r"#\w*$")
_FUNCTION = re.compile(r"@[A-Z]*$")
_OPERAND = re.compile(r"_([A-Z]{0,2})([A-Z]?)$")
_WORD = re.compile(r"[A-Za-z]\w*$")
_TAKES_LABEL = re.compile(r"(?:XQ|JP|JS|LS|LL)\s*$")


class Candidate(NamedTuple):
    """One way to go on: it replaces the last `replaces` characters; `meaning` is shown beside it."""

    text: str
    replaces: int
    meaning: str = ""


def candidates(before: str, names: CompletionNames) -> list[Candidate]:
    """Return how the text before the cursor may go on, in order; nothing inside quotes and comments."""
    if before.startswith(":"):
        return [] if " " in before else _offer(WORDS.items(), before)
    if found := _HELP.match(before):
        return _offer(_mnemonics(), found[1])
    if before.count('"') % 2 or "'" in before:
        return []
    command = before.rpartition(";")[2].lstrip()
    if found := _WORD.fullmatch(command):
        return [*_offer(_mnemonics(), command), *_offer(_own(names), command)]
    return _inside(command, names)


def current_mnemonic(before: str) -> str:
    """Return the two letters (or word) that the command under the cursor begins with, capitals as typed."""
    command = before.rpartition(";")[2].lstrip()
    found = re.match(r"ELSE|ENDIF|[A-Z]{2}", command)
    return found[0] if found is not None else ""


def _inside(command: str, names: CompletionNames) -> list[Candidate]:
    if found := _LABEL.search(command):
        return _offer(_labels(names), found[0])
    if _TAKES_LABEL.fullmatch(command):
        return _offer(_labels(names), "")
    if found := _FUNCTION.search(command):
        return _offer(((function.name, function.purpose) for function in guide.functions()), found[0])
    if found := _OPERAND.search(command):
        return _operands(found[0], found[1], names)
    if found := _WORD.search(command):
        return _offer(_own(names), found[0])
    return []


def _operands(typed: str, name: str, names: CompletionNames) -> list[Candidate]:
    entries = guide.operands()
    if len(name) < 2:
        return _offer(((f"_{entry.name}", entry.purpose) for entry in entries), typed)
    exists = any(entry.name == name for entry in entries)
    return _offer(((f"_{name}{axis}", f"axis {axis}") for axis in names.axes), typed) if exists else []


def _mnemonics() -> Iterable[tuple[str, str]]:
    return ((entry.name, entry.purpose) for entry in guide.entries())


def _labels(names: CompletionNames) -> Iterable[tuple[str, str]]:
    return ((label, "label") for label in names.labels)


def _own(names: CompletionNames) -> Iterable[tuple[str, str]]:
    yield from ((name, "variable") for name in names.variables)
    yield from ((name, "array") for name in names.arrays)


def _offer(words: Iterable[tuple[str, str]], typed: str) -> list[Candidate]:
    """Return the words that begin as typed; a mnemonic is found by small letters too."""
    return [
        Candidate(word, len(typed), meaning)
        for word, meaning in words
        if word.lower().startswith(typed.lower()) and word != typed
    ]
