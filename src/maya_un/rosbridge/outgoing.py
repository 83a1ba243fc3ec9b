"""A message of a topic on its way to clients: whatever form they want is made once, however many want it."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable
from typing import NamedTuple

from maya_un.graph import types
from maya_un.graph.protocol import Message
from maya_un.graph.stamps import stamp
from maya_un.rosbridge import forms, fragments, png
from maya_un.server.frames import BINARY, framed

COMPRESSIONS = ("none", "png", "cbor", "cbor-raw")
"""What a message may be compressed by, the weakest first: the strongest that a client wants is taken."""


class MessageFormat(NamedTuple):
    """How a client wants the messages of a topic, which it calls `name`; `fragment` is the size of pieces, 0: whole."""

    name: str
    compression: str = "none"
    fragment: int = 0


class Outgoing:
    """One message of a type, heard at `now` [s since the epoch]."""

    def __init__(self, kind: str, message: Message, now: float) -> None:
        self.message = message
        self._kind = kind
        self._now = now
        self._text: str | None = None
        self._frames: dict[MessageFormat, bytes] = {}

    def frames(self, form: MessageFormat) -> bytes:
        """Return whole websocket frames."""
        made = self._frames.get(form)
        if made is None:
            made = self._frames[form] = self._made(form)
        return made

    def _made(self, form: MessageFormat) -> bytes:
        if form.compression == "cbor":
            return self._binary(form.name, forms.as_cbor(self._kind, self.message))
        if form.compression == "cbor-raw":
            return self._binary(form.name, {**stamp(self._now), "bytes": types.serialize(self._kind, self.message)})
        if self._text is None:
            self._text = forms.as_json(self._kind, self.message)
        text = f'{{"op":"publish","topic":{json.dumps(form.name)},"msg":{self._text}}}'
        return shaped(text, form.compression, form.fragment)

    @staticmethod
    def _binary(name: str, content: object) -> bytes:
        from cbor2 import dumps  # noqa: PLC0415 - few clients ask for it

        return framed(dumps({"op": "publish", "topic": name, "msg": content}), BINARY)


def shaped(text: str, compression: str, fragment: int, name: str | float | None = None) -> bytes:
    """Return a message in JSON as frames, as a picture and in pieces where that is wanted."""
    if compression == "png":
        text = json.dumps({"op": "png", "data": png.encoded(text)})
    if fragment and len(text) > fragment:
        return b"".join(framed(piece.encode()) for piece in fragments.cut(text, fragment, name))
    return framed(text.encode("utf-8", "replace"))


class MessageEncoder:
    """Makes what goes out of what is heard, the latest of every topic once for all clients that hear it."""

    def __init__(self, now: Callable[[], float]) -> None:
        self.now = now
        self._latest: dict[tuple[str, str], Outgoing] = {}
        self._readers = Counter[tuple[str, str]]()

    def join(self, topic: str, kind: str) -> None:
        """Have one more reader of a topic."""
        self._readers[topic, kind] += 1

    def leave(self, topic: str, kind: str) -> None:
        """Have one reader less; what nobody reads is not kept."""
        self._readers[topic, kind] -= 1
        if not self._readers[topic, kind]:
            del self._readers[topic, kind]
            self._latest.pop((topic, kind), None)

    def outgoing(self, topic: str, kind: str, message: Message) -> Outgoing:
        """Return a message that was heard on a topic, the same to everybody who hears it."""
        latest = self._latest.get((topic, kind))
        if latest is None or latest.message is not message:
            latest = self._latest[topic, kind] = Outgoing(kind, message, self.now())
        return latest
