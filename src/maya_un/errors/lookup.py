"""Errors by their code: the tree as a table, and an error made again of what an edge received."""

from __future__ import annotations

from maya_un import messages
from maya_un.errors.base import MayaError


def _walk(branch: type[MayaError]) -> dict[int, type[MayaError]]:
    found: dict[int, type[MayaError]] = {}
    for child in branch.__subclasses__():
        if child.code:
            found[child.code] = child
        found.update(_walk(child))
    return found


def by_code() -> dict[int, type[MayaError]]:
    """Return every leaf of the tree by its code."""
    return dict(sorted(_walk(MayaError).items()))


def from_notice(code: int, details: dict[str, object], sentence: str = "") -> MayaError:
    """Rebuild an error from its code and details, as an edge received them, or from its `sentence` where none came.

    Raises `KeyError` for a code that is not in the tree.
    """
    if sentence and not details and "{" in messages.table()[code]:
        return as_said(code, sentence)
    return by_code()[code](**details)


def as_said(code: int, sentence: str) -> MayaError:
    """Return the error of `code` with the sentence that an edge received, where its details did not come along.

    Raises `KeyError` for a code that is not in the tree.
    """
    leaf = by_code()[code]
    error = leaf.__new__(leaf)
    Exception.__init__(error, sentence)
    error.details, error.said = {}, True
    return error
