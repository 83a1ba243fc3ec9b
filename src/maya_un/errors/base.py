"""The trunk of the tree of errors: what every error has, and the two branches."""

from __future__ import annotations

from typing import ClassVar

from maya_un import messages


class MayaError(Exception):
    """Base of all errors.

    Parameters are the details that the sentence of this code names; they are kept in `details`
    and stay machine-readable at every edge.
    """

    code: ClassVar[int] = 0

    def __init__(self, **details: object) -> None:
        if type(self).code == 0:
            raise TypeError(f"{type(self).__name__} is a branch of the tree, raise one of its leaves")
        self.details = details
        self.said = False
        super().__init__(messages.sentence(type(self).code, details))

    def __reduce__(self) -> tuple[object, ...]:
        """Cross into another process with code, details and words."""
        return _again, (type(self), self.details, str(self) if self.said else None)

    def text(self, language: str = "en") -> str:
        """Return the sentence (what, why, what next) in `language` ("en" or "es").

        Of an error that came in words only (`as_said`) they are those words.
        """
        return str(self) if self.said else messages.sentence(type(self).code, self.details, language)


def _again(leaf: type[MayaError], details: dict[str, object], said: str | None) -> MayaError:
    """Return the error that crossed."""
    if said is None:
        return leaf(**details)
    error = leaf.__new__(leaf)
    Exception.__init__(error, said)
    error.details, error.said = details, True
    return error


class RequestError(MayaError):
    """Somebody asked for something impossible. The robot is not disturbed."""


class MachineError(MayaError):
    """The machine or the link did something unexpected. Motion ends; a person recovers."""
