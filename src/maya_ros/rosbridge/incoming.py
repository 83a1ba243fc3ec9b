"""Messages from clients: split into objects, joined from fragments, decoded, and their fields checked."""

from __future__ import annotations

import itertools
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from dmc41x3.i18n import phrase
from maya_ros.graph.table import ABORT, STOP, asked_by_topic
from maya_ros.rosbridge.limits import FRAGMENT_PATIENCE, GATHERED, LONGEST_MESSAGE, LONGEST_SPLIT, MOST_FRAGMENTS
from maya_un.errors import InvalidRequest
from maya_un.process.spec.json_object import require_few
from maya_un.service.access.operations import Operation

LONGEST = 255

_GOOD = re.compile(r"/?[A-Za-z][A-Za-z0-9_]*(/[A-Za-z0-9_]+)*")
_TYPE = re.compile(r"[A-Za-z][A-Za-z0-9_]*/([A-Za-z]+/)?[A-Za-z][A-Za-z0-9_]*")


def resolved(name: str, key: str) -> str:
    """Return the full form of a name that a client gives under `key`; raises `InvalidRequest`."""
    if len(name) > LONGEST or not _GOOD.fullmatch(name):
        raise InvalidRequest(key=key, reason="it must be a name like /maya_event")
    return name if name.startswith("/") else f"/{name}"


def type_of(text: str, key: str) -> str:
    """Return a type as ROS 1 names it; raises `InvalidRequest`.

    Newer clients write "std_msgs/msg/String"; the part in the middle is left out.
    """
    if len(text) > LONGEST or not _TYPE.fullmatch(text):
        raise InvalidRequest(key=key, reason="it must be a type like std_msgs/String")
    package, *_, name = text.split("/")
    return f"{package}/{name}"


LONGEST_ID = 1_000


class Fields:
    """A message of a client. Every method raises `InvalidRequest` for a field that is not valid.

    A field that is null counts as missing, because clients in JavaScript send unset fields as null.
    """

    def __init__(self, message: Mapping[str, Any]) -> None:
        self._message = message

    @property
    def id(self) -> str | float | None:
        """The client's id of this message, None without one."""
        found = self._message.get("id")
        if found is None or (isinstance(found, str) and len(found) <= LONGEST_ID):
            return found
        if isinstance(found, int | float) and not isinstance(found, bool) and abs(found) < 2**63:
            return found
        raise InvalidRequest(key="id", reason=phrase("it must be a text of at most {most} characters", most=LONGEST_ID))

    def get(self, key: str) -> Any:
        """Return the value of a field, None if it is missing."""
        return self._message.get(key)

    def text(self, key: str, default: str | None = None) -> str:
        """Return a text; without a `default` it is required."""
        found = self._message.get(key)
        if found is None and default is not None:
            return default
        if not isinstance(found, str):
            raise InvalidRequest(key=key, reason="it must be a text")
        return found

    def one_of(self, key: str, known: tuple[str, ...], default: str) -> str:
        """Return one of some words."""
        found = self.text(key, default)
        if found not in known:
            raise InvalidRequest(key=key, reason=phrase("it must be one of {choices}", choices=", ".join(known)))
        return found

    def name(self, key: str) -> tuple[str, str]:
        """Return a name of the graph as the client writes it, and its full form."""
        said = self.text(key)
        return said, resolved(said, key)

    def kind(self, key: str = "type", *, needed: bool = True) -> str:
        """Return a type, "" if it is missing and not `needed`."""
        said = self.text(key, None if needed else "")
        return type_of(said, key) if said or needed else ""

    def whole(self, key: str, default: int, least: int, most: int) -> int:
        """Return a whole number of at least `least`; a greater number than `most` is reduced to `most`."""
        found = self._message.get(key)
        if found is None:
            return default
        if isinstance(found, float) and found.is_integer():
            found = int(found)
        if not isinstance(found, int) or isinstance(found, bool) or found < least:
            raise InvalidRequest(key=key, reason=phrase("it must be a whole number from {least}", least=least))
        return min(found, most)

    def flag(self, key: str, default: bool | None = None) -> bool:
        """Return true or false."""
        found = self._message.get(key)
        if found is None and default is not None:
            return default
        if not isinstance(found, bool):
            raise InvalidRequest(key=key, reason="it must be true or false")
        return found

    def record(self, key: str) -> dict[str, Any]:
        """Return an object; a missing one, and an empty list, is an empty object."""
        found = self._message.get(key)
        if found is None or found == []:
            return {}
        if not isinstance(found, dict):
            raise InvalidRequest(key=key, reason="it must be an object")
        return found


def decoded(text: str | bytes) -> dict[str, Any]:
    """Return the object that a client sent; raises `InvalidRequest` for anything else.

    A lone surrogate is refused here, because it could not be sent later. Bytes that are no text are refused, too:
    clients send JSON, although they may receive CBOR. NaN and Infinity, which Python and some JavaScript write, are
    accepted.
    """
    try:
        value = parsed(text)
    except ValueError as error:
        raise not_json(error) from error
    return as_object(value)


def parsed(text: str | bytes) -> Any:
    """Parse JSON; raises `ValueError`, and `InvalidRequest` if it nests too deeply."""
    require_few(text, "message")
    try:
        value = json.loads(text)
        if "\\u" in (text if isinstance(text, str) else text.decode()):
            json.dumps(value, ensure_ascii=False).encode()
    except RecursionError as error:
        raise InvalidRequest(key="message", reason="it is nested too deeply") from error
    return value


def not_json(error: ValueError) -> InvalidRequest:
    """Return the error for a text that is not JSON."""
    return InvalidRequest(key="message", reason=phrase("it is not JSON ({error})", error=error))


def as_object(value: Any) -> dict[str, Any]:
    """Return a value that is an object; raises `InvalidRequest` for other values."""
    if not isinstance(value, dict):
        raise InvalidRequest(key="message", reason="it is not a JSON object")
    return value


_MARK = re.compile(r'\\.|["{}\\]', re.DOTALL)


class Objects:
    """Finds objects by their braces. Skips text between objects, and stores an incomplete object."""

    def __init__(self) -> None:
        self._parts: list[str] = []
        self._kept = 0
        self._depth = 0
        self._quoted = False
        self._escaped = False

    @property
    def incomplete(self) -> bool:
        """Whether the text so far ends inside a JSON object."""
        return self._depth > 0

    def forget(self) -> None:
        """Drop an incomplete object."""
        self._parts.clear()
        self._kept = self._depth = 0
        self._quoted = self._escaped = False

    def add(self, text: str) -> list[str]:
        """Return the objects that end in the next text; raises `InvalidRequest` if it is too long.

        Every character is read once, even if an object spans many texts.
        """
        if len(text) > LONGEST_SPLIT or self._kept + len(text) > LONGEST_MESSAGE:
            self.forget()
            raise InvalidRequest(
                key="message", reason=phrase("it is no JSON within {most} characters", most=LONGEST_SPLIT)
            )
        found: list[str] = []
        begin = 0
        mark = ""
        for one in _MARK.finditer(text, 1 if self._escaped else 0):
            mark = one[0] if self._quoted else one[0][-1]
            before, self._depth = self._depth, self._after(mark)
            if self._depth > before == 0:
                begin = one.end() - 1
            elif before > self._depth == 0:
                found.append("".join((*self._parts, text[begin : one.end()])))
                self.forget()
        if self._depth:
            self._parts.append(text[begin:])
            self._kept += len(text) - begin
        self._escaped = self._quoted and mark == "\\"
        return found

    def _after(self, mark: str) -> int:
        """Return the number of open objects after a mark; marks within quotes or outside objects do not count."""
        if mark == '"':
            self._quoted = self._depth > 0 and not self._quoted
        elif not self._quoted and mark == "{":
            return self._depth + 1
        elif not self._quoted and mark == "}" and self._depth:
            return self._depth - 1
        return self._depth


_numbers = itertools.count(1)


def cut(text: str, size: int, name: str | float | None = None) -> list[str]:
    """Return `text`, or fragments of it if it is longer than `size` characters, as texts to send.

    `name` is the common id of the fragments; None gives them a new one.
    """
    if len(text) <= size:
        return [text]
    pieces = [text[begin : begin + size] for begin in range(0, len(text), size)]
    head = {"op": "fragment", "id": f"fragment:{next(_numbers)}" if name is None else name}
    return [
        json.dumps({**head, "data": piece, "num": number, "total": len(pieces)}) for number, piece in enumerate(pieces)
    ]


@dataclass(slots=True)
class _Gathered:
    total: int
    form: str
    pieces: dict[int, str] = field(default_factory=dict[int, str])
    size: int = 0
    latest: float = 0.0


class FragmentCollector:
    """The incomplete messages of one client."""

    def __init__(self) -> None:
        self._open: dict[str | float, _Gathered] = {}

    def add(self, fields: Fields, form: str, now: float) -> str | None:
        """Add a fragment that came at `now` [s], and return the whole text if no fragment is missing any more.

        `form` is the op of all fragments of a message. Raises `InvalidRequest`; then the whole message is dropped.
        """
        name = fields.id
        if name is None:
            raise InvalidRequest(key="id", reason="it is missing; fragments need it")
        self._forget_old(now)
        try:
            return self._added(name, fields, form, now)
        except InvalidRequest:
            self._open.pop(name, None)
            raise

    def _added(self, name: str | float, fields: Fields, form: str, now: float) -> str | None:
        data = fields.text("data")
        total = fields.whole("total", 0, 1, MOST_FRAGMENTS + 1)
        number = fields.whole("num", -1, 0, MOST_FRAGMENTS)
        if total > MOST_FRAGMENTS:
            raise InvalidRequest(
                key="total", reason=phrase("a message comes in at most {most} fragments", most=MOST_FRAGMENTS)
            )
        gathered = self._open.get(name)
        if gathered is None:
            if len(self._open) >= GATHERED:
                raise InvalidRequest(
                    key="id", reason=phrase("at most {most} messages may be incomplete", most=GATHERED)
                )
            gathered = self._open[name] = _Gathered(total, form)
        if total != gathered.total or form != gathered.form or not 0 <= number < total:
            raise InvalidRequest(key="num", reason="it does not fit the other fragments")
        gathered.size += len(data) - len(gathered.pieces.get(number, ""))
        gathered.pieces[number] = data
        gathered.latest = now
        if gathered.size > LONGEST_MESSAGE:
            raise InvalidRequest(
                key="data", reason=phrase("the message has more than {most} bytes", most=LONGEST_MESSAGE)
            )
        if len(gathered.pieces) < total:
            return None
        del self._open[name]
        return "".join(gathered.pieces[index] for index in range(total))

    def _forget_old(self, now: float) -> None:
        for name in [name for name, one in self._open.items() if now - one.latest > FRAGMENT_PATIENCE]:
            del self._open[name]


def stop_in(text: str | bytes) -> str | None:
    """Return the service of the stop that a message requests, None for other messages."""
    try:
        fields = Fields(decoded(text))
        match fields.get("op"):
            case "call_service":
                _, service = fields.name("service")
                return service if service in (STOP.name, ABORT.name) else None
            case "publish":
                _, topic = fields.name("topic")
                return STOP.name if asked_by_topic(topic) is Operation.STOP else None
            case _:
                return None
    except InvalidRequest:
        return None
