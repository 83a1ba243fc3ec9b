"""Errors: each is declared once, with its code, its English sentence and its details.

The branch of an error decides whether the axes stop: a `RequestError` rejects a request, a `MachineError` ends motion.
docs/reference/errors.md lists all errors. A package that is built on this one declares more below the two branches,
as `maya_un.errors` does.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import ClassVar, Self, dataclass_transform

from dmc41x3.i18n import Phrase, add_sentence, details_in, translate, translate_phrase, unformatted

_by_code: dict[int, type[CodedError]] = {}


class _Missing(dict[str, object]):
    """Leaves a placeholder readable instead of failing while an error is being reported."""

    def __missing__(self, key: str) -> str:
        return f"<{key}>"


@dataclass_transform(kw_only_default=True)
class CodedError(Exception):
    """Base of all errors with a code, of this package and of those built on it.

    A subclass with a `code` declares an error. Its annotations are the details of the error; a detail with a value is
    optional. `en` is a sentence or two over the details: what happened, why, what to do next. The details are keyword
    arguments of the constructor, attributes, and the items of `details` for JSON. `verbatim`: the error came from
    another program with its sentence only (`from_sentence`).
    """

    code: ClassVar[int] = 0
    en: ClassVar[str] = ""
    declared: ClassVar[Mapping[str, bool]] = {}
    """The details by name, and whether each is required."""

    def __init_subclass__(cls, *, code: int = 0, en: str = "") -> None:
        """Declare an error, or a branch if there is no code."""
        if code and _by_code.setdefault(code, cls) is not cls:
            raise TypeError(f"{cls.__name__} has the code {code} of {_by_code[code].__name__}")
        own = {name: name not in vars(cls) for name in cls.__annotations__}
        cls.code, cls.en, cls.declared = code, en, {**cls.declared, **own}
        if code:
            add_sentence(en, cls.__name__)

    def __init__(self, **details: object) -> None:
        kind = type(self)
        if not kind.code:
            raise TypeError(f"{kind.__name__} is a branch of the tree, raise one of its leaves")
        if lacking := [name for name, required in kind.declared.items() if required and name not in details]:
            raise TypeError(f"{kind.__name__} lacks the detail {', '.join(lacking)}")
        if unknown := details.keys() - kind.declared.keys():
            raise TypeError(f"{kind.__name__} has no detail {', '.join(sorted(unknown))}")
        self._fill(details, None)

    def _fill(self, details: dict[str, object], sentence: str | None) -> None:
        """Set the details and the text: `sentence` if it is given, else the sentence made from the details."""
        self.details = details
        self.verbatim = sentence is not None
        vars(self).update((name, value) for name, value in details.items() if name in type(self).declared)
        super().__init__(self._sentence("en") if sentence is None else sentence)

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle the error with its details and its sentence."""
        return type(self).rebuilt, (self.details, str(self) if self.verbatim else None)

    @classmethod
    def rebuilt(cls, details: dict[str, object], sentence: str | None = None) -> Self:
        """Return an error without checking its details: they were checked before, or are those of another version.

        `sentence` is for an error that came with its sentence only.
        """
        error = cls.__new__(cls)
        error._fill(details, sentence)
        return error

    @classmethod
    def template(cls, language: str = "en") -> str:
        """Return the sentence in `language` ("en" or "es") with placeholders for the details."""
        return translate(cls.en, language)

    def text(self, language: str = "en") -> str:
        """Return the sentence (what, why, what next) in `language` ("en" or "es").

        An error that came with its sentence only is translated if that is the English one of its code.
        """
        return self.translated(str(self), language) if self.verbatim else self._sentence(language)

    @classmethod
    def translated(cls, sentence: str, language: str) -> str:
        """Return the English sentence of this error in `language`; any other sentence unchanged."""
        details = None if language == "en" else details_in(sentence, cls.en)
        if details is None:
            return sentence
        return unformatted(cls.template(language)).format_map(cls._shown(details, language))

    def _sentence(self, language: str) -> str:
        """Return the sentence with the details; details that are words or phrases of the catalogue are translated."""
        return self.template(language).format_map(_Missing(self._shown(self.details, language)))

    @classmethod
    def _shown(cls, details: Mapping[str, object], language: str) -> Mapping[str, object]:
        """Return details as they stand in the sentence in `language`."""
        if language == "en":
            return details
        phrases = phrase_details(cls)
        return {
            name: _translated(value, language, f"{cls.__name__}.{name}", phrase=name in phrases)
            for name, value in details.items()
        }

    def copy(self, **changes: object) -> Self:
        """Return a copy with changed details; one instance raised in several tasks would collect their tracebacks."""
        return self.rebuilt({**self.details, **changes}, str(self) if self.verbatim else None)


@cache
def phrase_details(kind: type[CodedError]) -> frozenset[str]:
    """Return the names of the details that may be phrases; they are translated in a sentence."""
    from typing import get_args, get_type_hints  # noqa: PLC0415  # English needs none

    hints = get_type_hints(kind, include_extras=True)
    return frozenset(name for name in kind.declared if Phrase in (hints[name], *get_args(hints[name])))


def _translated(value: object, language: str, context: str, *, phrase: bool) -> object:
    """Return a detail as it is, or translated: a word in the catalogue, or a phrase or the sentence of an error."""
    text = str(value)
    found = translate(text, language, context)
    if phrase and found == text:
        found = translate_phrase(text, language)
    return value if found == text else found


class RequestError(CodedError):
    """The request is impossible. The robot is not affected."""


class MachineError(CodedError):
    """The machine or the link did something unexpected. Motion ends; a person recovers."""


class LinkLost(
    MachineError,
    code=1001,
    en="The connection to the controller at {address} was lost ({reason}). The axes finish what was already sent. "
    "Check cable and power, then connect again.",
):
    """The connection to the controller ended by itself."""

    address: str
    reason: Phrase


class ConnectFailed(
    MachineError,
    code=1002,
    en="No controller answers at {address} ({reason}). Check power, cable and address.",
):
    """No controller answers at the address."""

    address: str
    reason: Phrase


class SerialPortUnavailable(ConnectFailed, code=1012, en="The serial port {address} cannot be opened: {reason}."):
    """A serial port is missing, forbidden to this user, or used by another program."""


class EndedUnanswered(
    ConnectFailed,
    code=1017,
    en="The device at {address} ended the connection before it answered ({reason}). It may be no Galil controller, or"
    " have no free handle (TH). Find the controllers with `dmc find`, or end a program that is connected to this one.",
):
    """A device ended the connection without an answer, so that no axis moves because of this connection."""


def ended(address: str, reason: str, *, heard: bool) -> MachineError:
    """Return the error of a connection that ended by itself; `heard` tells whether the device ever sent anything."""
    return LinkLost(address=address, reason=reason) if heard else EndedUnanswered(address=address, reason=reason)


class LinkTimeout(
    MachineError,
    code=1003,
    en="The controller at {address} did not answer {command!r} within {seconds} s. Check the network, or reset the"
    " controller.",
):
    """The controller accepted the connection but does not answer in time."""

    address: str
    command: str
    seconds: float | str


class CommandRejected(
    MachineError,
    code=1004,
    en="The controller refused {command!r} with code {tc} ({reason}). If you did not send this command "
    "yourself, check which other program uses this controller.",
):
    """The controller answered a command of this program with `?`; carries the TC code."""

    command: str
    tc: int
    reason: Phrase


class WrongController(
    MachineError,
    code=1005,
    en="The device at {address} is {found}; a DMC-41x3 with three axes is needed. Check the address.",
):
    """The device at the address is not a DMC-41x3 with three axes."""

    address: str
    found: str | Phrase


class UnexpectedReply(
    MachineError,
    code=1006,
    en="The controller answered {command!r} with {reply!r}, which is not valid. Check that the address is that of "
    "a Galil controller.",
):
    """A reply could not be understood."""

    command: str
    reply: str


class ProgramDiffers(
    MachineError,
    code=1008,
    en="Line {line} of the program in the controller is wrong: {sent} was sent, but it contains {found}. "
    "Download the program again. If that does not help, find the other program that writes to this "
    "controller.",
):
    """The controller holds another program than the one just downloaded."""

    line: int
    sent: str
    found: str


class AddressNotReached(
    MachineError,
    code=1013,
    en="The controller was told to use the address {address}, but does not answer there ({reason}). Nothing was burned:"
    " switch the controller off and on, and it returns to its former address. Choose an address in the network of this"
    " computer.",
):
    """A controller does not answer at its new address."""

    address: str
    reason: Phrase


class NoAddressRequest(
    MachineError,
    code=1014,
    en="{mac} did not ask for an address within {seconds} s. Switch the controller off and on while the command waits."
    " A controller that has a burned address, or one from another server, does not ask.",
):
    """A controller did not ask for an address."""

    mac: str | Phrase
    seconds: float | str


class OtherDhcpServer(
    MachineError,
    code=1015,
    en="{mac} takes its address from the DHCP server {server}. Reserve an address there, or connect the controller to"
    " this computer by a cable of its own.",
):
    """Another DHCP server gives the controller its address."""

    mac: str
    server: str


class AddressTaken(
    MachineError,
    code=1016,
    en="The controller at {address} has the hardware address {found}, not {mac}. Two devices use the same address."
    " Nothing was burned. Switch {mac} off and on, and give it another address.",
):
    """Another controller answers at the address that a controller was given."""

    address: str
    found: str
    mac: str


class NotConnected(
    RequestError,
    code=1010,
    en="There is no connection to the controller. Wait for it, or check power and cable.",
):
    """A command came without a connection to the controller."""


class ProgramLost(
    RequestError,
    code=1040,
    en="The download failed ({reason}), and the former program could not be restored. Download a program again "
    "before you run one.",
):
    """A download failed, and the former program could not be restored."""

    reason: Phrase


class ProgramRuns(
    RequestError,
    code=2110,
    en="A program runs in the controller, so no other can be downloaded. Halt it with HX, and download again.",
):
    """A download was requested while the controller runs a program."""


class InvalidValue(RequestError, code=4001, en="{key} = {value} is not valid: {reason}."):
    """A value is of the wrong kind or out of range."""

    key: str | Phrase
    value: object | Phrase
    reason: Phrase


class UnknownName(RequestError, code=4003, en="There is no {name!r}. Known: {known}."):
    """A name is not known; lists the names that are."""

    name: str
    known: Phrase
    key: str | None = None


class InvalidRequest(RequestError, code=4005, en="The request has an error at {key}: {reason}."):
    """A request body could not be understood."""

    key: str
    reason: Phrase


class FileUnreadable(
    RequestError, code=4007, en="Reading {path} failed: {reason}. Correct the file, or give another one."
):
    """A file cannot be read or parsed."""

    path: object
    reason: Phrase


class InvalidCommandLine(RequestError, code=4008, en="{reason}. See `{command} --help`."):
    """The command line could not be understood."""

    reason: Phrase
    command: str


class FileUnwritable(
    RequestError, code=5002, en="Writing {path} failed: {reason}. Give another path, or correct its permissions."
):
    """A file cannot be written."""

    path: object
    reason: Phrase | None


class AddressInUse(
    RequestError,
    code=5003,
    en="{address} is in use already. Choose another port, or stop the program that listens there.",
):
    """A port to listen on is taken."""

    address: str


class PortForbidden(RequestError, code=5015, en="Only root may listen on port {port}. Run the command with sudo."):
    """A port below 1024 was requested without the privilege for it."""

    port: int


class FileNotOurs(RequestError, code=5005, en="This program does not use {path}: {remedy}."):
    """The file to be overwritten belongs to another program."""

    path: object
    remedy: Phrase


class TooFewDescriptors(
    RequestError,
    code=5013,
    en="This process may open {limit} files and connections at once. It has {used} open already, and needs {least}"
    " more. Raise the limit with `ulimit -n 1024`, or with LimitNOFILE=1024 in a systemd unit.",
):
    """The limit on open files leaves too few for connections, the robot's link and the journal."""

    limit: object
    used: int
    least: int


class InternalError(
    MachineError,
    code=5999,
    en="An internal error happened ({reason}). This is a defect of this program: please report it with the traceback.",
):
    """A defect of this program: reported as one sentence, with the place of the log."""

    reason: Phrase


def by_code() -> dict[int, type[CodedError]]:
    """Return every declared error by its code."""
    return dict(sorted(_by_code.items()))


def reword(kind: type[CodedError], en: str) -> None:
    """Replace the English sentence of an error of this package by `en`, for a package that is built on it."""
    kind.en = en
    add_sentence(en, kind.__name__)


def from_notice(code: int, details: dict[str, object], sentence: str = "") -> CodedError:
    """Return an error from the code and details that another program sent, or from `sentence` if it sent no details.

    Unknown details are retained. Raises `KeyError` for a code that is not declared.
    """
    kind = by_code()[code]
    if sentence and not details and any(kind.declared.values()):
        return from_sentence(code, sentence)
    return kind.rebuilt(details)


def from_sentence(code: int, sentence: str) -> CodedError:
    """Return the error of `code` with the sentence that another program sent without details.

    Raises `KeyError` for a code that is not declared.
    """
    return by_code()[code].rebuilt({}, sentence)


def translated(code: int, sentence: str, language: str) -> str:
    """Return the English sentence of an error in `language`; an unknown sentence unchanged."""
    kind = by_code().get(code)
    return sentence if kind is None else kind.translated(sentence, language)
