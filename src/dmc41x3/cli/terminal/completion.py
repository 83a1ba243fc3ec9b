"""Completion and help of the terminal: mnemonics, labels, variables, arrays, and its own commands."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

from dmc41x3.driver import Driver
from dmc41x3.errors import CommandRejected
from dmc41x3.language.catalogue import CATALOGUE, Arguments, CatalogueEntry, EntryContext, EntryKind
from dmc41x3.language.commands import FORMS

_LISTED_LABEL = re.compile(r"#\w+")
_VARIABLE = re.compile(r"^\s*([A-Za-z]\w*)\s*=", re.MULTILINE)
_ARRAY = re.compile(r"^\s*([A-Za-z]\w*)\s*\[", re.MULTILINE)
_ASSIGNED = re.compile(r"([A-Za-z]\w*)\s*=(?!\s*\??$)")


@dataclass(frozen=True, slots=True)
class CompletionNames:
    """Names for completion. Labels include their `#`; `axes` are the letters of the existing axes."""

    labels: tuple[str, ...] = ()
    variables: tuple[str, ...] = ()
    arrays: tuple[str, ...] = ()
    axes: str = "ABC"

    def with_variable(self, name: str) -> CompletionNames:
        """Return the names with one more variable."""
        return CompletionNames(self.labels, _sorted([*self.variables, name]), self.arrays, self.axes)


async def ask(driver: Driver, axes: str) -> CompletionNames:
    """Return the names that the controller lists (LL, LV, LA); a list it refuses is empty. Raises on a lost link."""
    return CompletionNames(
        labels=_sorted(_LISTED_LABEL.findall(await _list(driver, "LL"))),
        variables=_sorted(_VARIABLE.findall(await _list(driver, "LV"))),
        arrays=_sorted(_ARRAY.findall(await _list(driver, "LA"))),
        axes=axes,
    )


async def _list(driver: Driver, command: str) -> str:
    try:
        return await driver.send(command)
    except CommandRejected:
        return ""


def assigned(command: str) -> str | None:
    """Return the variable that a command creates or sets, None for any other command; `x=?` only reads."""
    found = _ASSIGNED.match(command)
    return found[1] if found is not None else None


def _sorted(names: Iterable[str]) -> tuple[str, ...]:
    return tuple(sorted(set(names)))


_COMMANDS_ONLY = (
    "AD AI AM AO AP AR AS AT BP CB CC CD CI CR DH DT EA ELSE EN ENDIF ES ET FE FI GA HS ID IF II IK JP LA LI LL LS LV "
    "MB MC ME MF MG MR OB PW QD QR QU RA RE RI SB SH SL ST TH TR TZ UI WT YR"
)
_NO_OPERAND = frozenset(_COMMANDS_ONLY.split())
_ARGUMENTS = {
    Arguments.AXES: "{0} ABC, {0} 1,2,3 or {0}A=1",
    Arguments.AXES_OR_PLANES: "{0} ABC or {0} S",
    Arguments.PLANES: "{0} 1,2 or {0}S=1",
    Arguments.PLAIN: "{0} or {0} 1,2",
    Arguments.OWN: "{0} ...",
}
_WHERE = {
    EntryContext.BOTH: "",
    EntryContext.HOST: "not in a program",
    EntryContext.PROGRAM: "in a program only",
    EntryContext.NEITHER: "of host software only",
}

OVERVIEW = """\
Type commands of the controller, several with ; between them. Tab completes.
`help TP` or `?TP` explains one. Answers are the controller's own; a refusal is
shown with its code and words, for which the terminal asks (TC1).

  :watch EXPR  :unwatch [EXPR]     show a value in the panel
  :upload [FILE]  :download FILE   the program, to a file or to the controller
  :scope _TPA,_TEA [--rate 50] [--for 5] [--trigger EXPR] --csv FILE --png FILE
  :messages                        have messages of programs come here
  :wait SECONDS                    let the next lines wait
  :stop  :panel  :reconnect  :help  :quit

F12 stops all motion: the sequences on their paths, then every other axis that
moves; programs go on. Ctrl-C clears the line and stops nothing. F2 shows or
hides the axes, F5 connects again, Ctrl-D ends."""
"""Help on the terminal itself."""


def entry(name: str) -> CatalogueEntry | None:
    """Return the catalogue entry of a mnemonic, None if it does not exist."""
    return CATALOGUE.get(name) if name in FORMS else None


def entries() -> tuple[CatalogueEntry, ...]:
    """Return all mnemonics in order."""
    return tuple(found for name in sorted(FORMS) if (found := entry(name)) is not None)


def operands() -> tuple[CatalogueEntry, ...]:
    """Return the mnemonics that are also operands of expressions, written `_XX`."""
    return tuple(found for found in entries() if found.name not in _NO_OPERAND)


def functions() -> tuple[CatalogueEntry, ...]:
    """Return the functions of expressions."""
    return tuple(found for found in CATALOGUE.values() if found.kind is EntryKind.FUNCTION)


def page(name: str) -> str:
    """Return the help on a name of the language (in any case), or the overview for an empty name."""
    if not name:
        return OVERVIEW
    found = CATALOGUE.get(name.upper()) or CATALOGUE.get(name)
    if found is None and name.startswith("_"):  # an operand, with its axis or without: _LFA, _TP
        mnemonic = name[1:3].upper()
        found = CATALOGUE.get(f"_{mnemonic}m") or CATALOGUE.get(mnemonic)
    if found is None:
        return f"{name} is no command of the DMC-41x3. `:help` describes the terminal."
    facts = [*_facts(found)]
    return f"{found.name}  {found.purpose}" + (f"\n    {'; '.join(facts)}" if facts else "")


def line(found: CatalogueEntry) -> str:
    """Return an entry in one line."""
    return "  ".join([found.name, found.purpose, *(f"({fact})" for fact in _facts(found))])


def _facts(found: CatalogueEntry) -> list[str]:
    """Return syntax, default value, permitted context and operand of a command."""
    if found.name not in FORMS:
        return []
    facts = [_ARGUMENTS[found.arguments].format(found.name)]
    if found.default:
        facts.append(f"default {found.default}")
    if _WHERE[found.where]:
        facts.append(_WHERE[found.where])
    if found.name not in _NO_OPERAND:
        facts.append(f"operand _{found.name}")
    return facts


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
"""The terminal's own commands and their help."""

_HELP = re.compile(r"(?:help\s+|\?\s*)(\w*)$")
_LABEL = re.compile(r"#\w*$")
_FUNCTION = re.compile(r"@[A-Z]*$")
_OPERAND = re.compile(r"_([A-Z]{0,2})([A-Z]?)$")
_WORD = re.compile(r"[A-Za-z]\w*$")
_TAKES_LABEL = re.compile(r"(?:XQ|JP|JS|LS|LL)\s*$")


class Candidate(NamedTuple):
    """One completion: it replaces the last `replaces` characters; `meaning` is shown beside it."""

    text: str
    replaces: int
    meaning: str = ""


def candidates(before: str, names: CompletionNames) -> list[Candidate]:
    """Return the completions of the text before the cursor, in order; none inside quotes and comments."""
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
    """Return the mnemonic in capitals that begins the command under the cursor, empty if there is none."""
    command = before.rpartition(";")[2].lstrip()
    found = re.match(r"ELSE|ENDIF|[A-Z]{2}", command)
    return found[0] if found is not None else ""


def _inside(command: str, names: CompletionNames) -> list[Candidate]:
    if found := _LABEL.search(command):
        return _offer(_labels(names), found[0])
    if _TAKES_LABEL.fullmatch(command):
        return _offer(_labels(names), "")
    if found := _FUNCTION.search(command):
        return _offer(((function.name, function.purpose) for function in functions()), found[0])
    if found := _OPERAND.search(command):
        return _operands(found[0], found[1], names)
    if found := _WORD.search(command):
        return _offer(_own(names), found[0])
    return []


def _operands(typed: str, name: str, names: CompletionNames) -> list[Candidate]:
    entries = operands()
    if len(name) < 2:
        return _offer(((f"_{entry.name}", entry.purpose) for entry in entries), typed)
    exists = any(entry.name == name for entry in entries)
    return _offer(((f"_{name}{axis}", f"axis {axis}") for axis in names.axes), typed) if exists else []


def _mnemonics() -> Iterable[tuple[str, str]]:
    return ((entry.name, entry.purpose) for entry in entries())


def _labels(names: CompletionNames) -> Iterable[tuple[str, str]]:
    return ((label, "label") for label in names.labels)


def _own(names: CompletionNames) -> Iterable[tuple[str, str]]:
    yield from ((name, "variable") for name in names.variables)
    yield from ((name, "array") for name in names.arrays)


def _offer(words: Iterable[tuple[str, str]], typed: str) -> list[Candidate]:
    """Return the words that begin with the typed text, whatever its case."""
    return [
        Candidate(word, len(typed), meaning)
        for word, meaning in words
        if word.lower().startswith(typed.lower()) and word != typed
    ]
