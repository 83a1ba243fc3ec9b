"""Every error of the package, its stable code, and the branch that decides whether the axes stop.

CodedError
├── RequestError            the request is impossible: it is rejected, the controller is not disturbed
│   ├── NotConnected 1010 · ProgramLost 1040 · ProgramRuns 2110
│   ├── InvalidValue 4001 · UnknownName 4003 · InvalidRequest 4005
│   │   FileUnreadable 4007 · InvalidCommandLine 4008
│   └── FileUnwritable 5002 · AddressInUse 5003 · FileNotOurs 5005 · TooFewDescriptors 5013
└── MachineError            the controller did something unexpected
    ├── LinkLost 1001 · ConnectFailed 1002 · LinkTimeout 1003 · CommandRejected 1004
    │   WrongController 1005 · UnexpectedReply 1006 · ProgramDiffers 1008 · MemoryDamaged 1009
    └── InternalError 5999

The sentence of a code stands in `dmc41x3.messages`, one module for each language. A package that is built on this one
adds leaves to the two branches and sentences to the messages, as `maya_un.errors` does.
"""

from __future__ import annotations

from typing import ClassVar

from dmc41x3 import messages


class CodedError(Exception):
    """Base of all errors with a code, of this package and of those built on it.

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


def _again(leaf: type[CodedError], details: dict[str, object], said: str | None) -> CodedError:
    """Return the error that crossed."""
    if said is None:
        return leaf(**details)
    error = leaf.__new__(leaf)
    Exception.__init__(error, said)
    error.details, error.said = details, True
    return error


class RequestError(CodedError):
    """Somebody asked for something impossible. The robot is not disturbed."""


class MachineError(CodedError):
    """The machine or the link did something unexpected. Motion ends; a person recovers."""


class LinkLost(MachineError):
    """The connection to the controller ended by itself."""

    code = 1001


class ConnectFailed(MachineError):
    """Nobody answers at the controller's address."""

    code = 1002


class LinkTimeout(MachineError):
    """The controller accepted the connection but does not answer in time."""

    code = 1003


class CommandRejected(MachineError):
    """The controller answered `?` to a command of ours; carries the TC code."""

    code = 1004


class WrongController(MachineError):
    """The device at the address is not a DMC-41x3 with three axes."""

    code = 1005


class UnexpectedReply(MachineError):
    """A reply could not be understood."""

    code = 1006


class ProgramDiffers(MachineError):
    """The controller holds another program than the one just downloaded."""

    code = 1008


class MemoryDamaged(MachineError):
    """The controller's EEPROM failed a checksum when it last powered up."""

    code = 1009


class NotConnected(RequestError):
    """A command came without a connection to the controller."""

    code = 1010


class ProgramLost(RequestError):
    """A download failed, and the former program could not be restored."""

    code = 1040


class ProgramRuns(RequestError):
    """A download was asked for while the controller runs a program."""

    code = 2110


class InvalidValue(RequestError):
    """A value is of the wrong kind or out of range."""

    code = 4001


class UnknownName(RequestError):
    """A name is not known; lists the names that are."""

    code = 4003


class InvalidRequest(RequestError):
    """A request body could not be understood."""

    code = 4005


class FileUnreadable(RequestError):
    """A file cannot be read or parsed."""

    code = 4007


class InvalidCommandLine(RequestError):
    """The command line could not be understood."""

    code = 4008


class FileUnwritable(RequestError):
    """A file cannot be written."""

    code = 5002


class AddressInUse(RequestError):
    """A port to listen on is taken."""

    code = 5003


class FileNotOurs(RequestError):
    """A file that we would write over is somebody else's."""

    code = 5005


class TooFewDescriptors(RequestError):
    """The limit on open files leaves too few for connections, the robot's link and the journal."""

    code = 5013


class InternalError(MachineError):
    """A defect of ours: reported as one sentence, with the log's place."""

    code = 5999


def _walk(branch: type[CodedError]) -> dict[int, type[CodedError]]:
    found: dict[int, type[CodedError]] = {}
    for child in branch.__subclasses__():
        if child.code:
            found[child.code] = child
        found.update(_walk(child))
    return found


def by_code() -> dict[int, type[CodedError]]:
    """Return every leaf of the tree by its code."""
    return dict(sorted(_walk(CodedError).items()))


def from_notice(code: int, details: dict[str, object], sentence: str = "") -> CodedError:
    """Rebuild an error from its code and details, as an edge received them, or from its `sentence` where none came.

    Raises `KeyError` for a code that is not in the tree.
    """
    if sentence and not details and "{" in messages.table()[code]:
        return as_said(code, sentence)
    return by_code()[code](**details)


def as_said(code: int, sentence: str) -> CodedError:
    """Return the error of `code` with the sentence that an edge received, where its details did not come along.

    Raises `KeyError` for a code that is not in the tree.
    """
    leaf = by_code()[code]
    error = leaf.__new__(leaf)
    Exception.__init__(error, sentence)
    error.details, error.said = {}, True
    return error
