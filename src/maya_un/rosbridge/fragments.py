"""Messages in pieces: cut for who wants them small, put together from who sends them so."""

from __future__ import annotations

import itertools
import json
from dataclasses import dataclass, field

from maya_un.errors import InvalidRequest
from maya_un.rosbridge.fields import Fields
from maya_un.rosbridge.limits import FRAGMENT_PATIENCE, GATHERED, LONGEST_MESSAGE, MOST_FRAGMENTS

_numbers = itertools.count(1)


def cut(text: str, size: int, name: str | float | None = None) -> list[str]:
    """Return `text`, or where it has more than `size` characters fragments of it, as texts to send.

    `name` is the id under which they belong together; without one they get a new one.
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
        """Add a piece that came at `now` [s] and return the whole text where it was the last one missing.

        `form` is the op of all pieces of a message. Raises `InvalidRequest`; then the whole message is forgotten.
        """
        name = fields.id
        if name is None:
            raise InvalidRequest(key="id", reason="fragments need one, to belong together")
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
            raise InvalidRequest(key="total", reason=f"a message comes in at most {MOST_FRAGMENTS} fragments")
        gathered = self._open.get(name)
        if gathered is None:
            if len(self._open) >= GATHERED:
                raise InvalidRequest(key="id", reason=f"at most {GATHERED} messages may be incomplete")
            gathered = self._open[name] = _Gathered(total, form)
        if total != gathered.total or form != gathered.form or not 0 <= number < total:
            raise InvalidRequest(key="num", reason="it does not fit the other fragments")
        gathered.size += len(data) - len(gathered.pieces.get(number, ""))
        gathered.pieces[number] = data
        gathered.latest = now
        if gathered.size > LONGEST_MESSAGE:
            raise InvalidRequest(key="data", reason=f"the message has more than {LONGEST_MESSAGE} bytes")
        if len(gathered.pieces) < total:
            return None
        del self._open[name]
        return "".join(gathered.pieces[index] for index in range(total))

    def _forget_old(self, now: float) -> None:
        for name in [name for name, one in self._open.items() if now - one.latest > FRAGMENT_PATIENCE]:
            del self._open[name]
