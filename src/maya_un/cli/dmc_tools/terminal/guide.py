"""What the terminal tells about a command of the language, and about itself."""

from __future__ import annotations

from typing import NamedTuple

from maya_un.galil.commands import FORMS


class Entry(NamedTuple):
    """One command: what it is for, what it takes, what holds where nobody sets it; `operand` where `_XX` exists."""

    name: str
    purpose: str
    arguments: str
    default: str
    operand: bool = True


def entry(name: str) -> Entry | None:
    """Return what is known of a mnemonic, None where there is none of that name."""
    form = FORMS.get(name)
    return None if form is None else Entry(name, form.value, "", "")


def entries() -> tuple[Entry, ...]:
    """Return all mnemonics in order."""
    return tuple(found for name in sorted(FORMS) if (found := entry(name)) is not None)


OVERVIEW = """\
Type commands of the controller, several with ; between them. Tab completes. `help TP` or `?TP` explains one.
Answers are the controller's own; a refusal is shown with its code and words, for which the terminal asks (TC1).

  :watch EXPR   :unwatch [EXPR]      show a value in the panel
  :upload [FILE]   :download FILE    the program, to a file or to the controller
  :scope _TPA,_TEA --rate 50 --for 5 [--trigger EXPR] [--csv FILE] [--png FILE]
  :messages                          have messages of programs come here, where another handle has them
  :stop  :panel  :reconnect  :help  :quit

F12 stops all motion: the sequences on their paths, then every other axis that moves; programs go on.
Ctrl-C clears the line and stops nothing. F2 shows or hides the axes, F5 connects again, Ctrl-D ends."""
"""Help on the terminal itself."""


def page(name: str) -> str:
    """Return what is known of a mnemonic (any case), the overview for an empty name."""
    if not name:
        return OVERVIEW
    found = entry(name.upper())
    if found is None:
        return f"{name} is no command of the DMC-41x3. `:help` tells about the terminal."
    return line(found)


def line(found: Entry) -> str:
    """Return an entry in one line."""
    return f"{found.name}  {found.purpose}"
