"""What the terminal tells about the language, and about itself."""

from __future__ import annotations

from dmc41x3.language.catalogue import CATALOGUE, Arguments, CatalogueEntry, EntryContext, EntryKind
from dmc41x3.language.commands import FORMS

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
    """Return what is known of a mnemonic, None where there is none of that name."""
    return CATALOGUE.get(name) if name in FORMS else None


def entries() -> tuple[CatalogueEntry, ...]:
    """Return all mnemonics in order."""
    return tuple(found for name in sorted(FORMS) if (found := entry(name)) is not None)


def operands() -> tuple[CatalogueEntry, ...]:
    """Return the mnemonics that are operands of expressions too, written `_XX`."""
    return tuple(found for found in entries() if found.name not in _NO_OPERAND)


def functions() -> tuple[CatalogueEntry, ...]:
    """Return the functions of expressions."""
    return tuple(found for found in CATALOGUE.values() if found.kind is EntryKind.FUNCTION)


def page(name: str) -> str:
    """Return what is known of a name of the language (any case), the overview for an empty one."""
    if not name:
        return OVERVIEW
    found = CATALOGUE.get(name.upper()) or CATALOGUE.get(name)
    if found is None and name.startswith("_"):  # an operand, with its axis or without: _LFA, _TP
        mnemonic = name[1:3].upper()
        found = CATALOGUE.get(f"_{mnemonic}m") or CATALOGUE.get(mnemonic)
    if found is None:
        return f"{name} is no command of the DMC-41x3. `:help` tells about the terminal."
    facts = [*_facts(found)]
    return f"{found.name}  {found.purpose}" + (f"\n    {'; '.join(facts)}" if facts else "")


def line(found: CatalogueEntry) -> str:
    """Return an entry in one line."""
    return "  ".join([found.name, found.purpose, *(f"({fact})" for fact in _facts(found))])


def _facts(found: CatalogueEntry) -> list[str]:
    """Return how a command is written, what holds where nobody says it, where it may stand, its operand."""
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
