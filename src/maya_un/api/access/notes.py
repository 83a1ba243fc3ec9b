"""Notes of people on a lease or a token."""

from __future__ import annotations

from maya_un.errors import InvalidValue

_LONGEST = 200


def require_note(note: str) -> None:
    """Raise `InvalidValue` for what is not one line of at most 200 characters."""
    if len(note) > _LONGEST or not note.isprintable():
        raise InvalidValue(key="note", value=repr(note), reason=f"it is one line of at most {_LONGEST} characters")
