"""The websocket protocol of Firebase's libraries, version 5, as far as they use it for data.

Requests are {"t": "d", "d": {"r": number, "a": action, "b": body}}. A message of more than 16384 characters is sent in
parts behind a frame that holds their number.
"""

from __future__ import annotations

import asyncio
import json
import secrets
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect

from tests.system.rtdb.store import BadTokenError, Caller, DeniedError, Listener, Store
from tests.system.rtdb.tree import BadDataError, Path, Query, at, changes_of, exported, parts, tree_hash

_PART = 16384

_Later = tuple[Path, Any, bool]
"""An action at the end of the connection: a path, data, and whether it is merged."""


class Wire:
    """One connection."""

    def __init__(self, store: Store, socket: WebSocket) -> None:
        self._store = store
        self._socket = socket
        self._out: asyncio.Queue[str] = asyncio.Queue()
        self._caller = Caller()
        self._listeners: dict[tuple[Path, str], Listener] = {}
        self._later: list[_Later] = []
        self.longest_in = 0
        self._actions: dict[str, Callable[[Mapping[str, Any]], Any]] = {
            "q": self._listen, "n": self._unlisten, "g": self._get, "p": self._put, "m": self._merge,
            "o": self._at_end, "om": self._merge_at_end, "oc": self._cancel_at_end,
            "auth": self._sign_in, "gauth": self._sign_in, "unauth": self._sign_out, "s": lambda _: "",
        }  # fmt: skip

    async def serve(self) -> None:
        """Serve until the connection ends, then do what its client has left for that."""
        await self._socket.accept()
        hello = {"ts": self._store.now(), "v": "5", "h": self._socket.headers["host"], "s": secrets.token_hex(8)}
        self._send({"t": "c", "d": {"t": "h", "d": hello}})
        sending = asyncio.create_task(self._send_all())
        try:
            while True:
                text = await self._message()
                if text != "0":
                    self._take(json.loads(text))
        except (WebSocketDisconnect, RuntimeError):
            pass
        finally:
            sending.cancel()
            await asyncio.gather(sending, return_exceptions=True)
            for listener in self._listeners.values():
                self._store.leave(listener)
            for path, data, merge in self._later:
                self._change(path, data, merge=merge)

    async def _message(self) -> str:
        text = await self._socket.receive_text()
        if len(text) <= 6 and text.isdigit() and text != "0":
            text = "".join([await self._socket.receive_text() for _ in range(int(text))])
        self.longest_in = max(self.longest_in, len(text))
        return text

    async def _send_all(self) -> None:
        while True:
            text = await self._out.get()
            cut = [text[place : place + _PART] for place in range(0, len(text), _PART)]
            for frame in [str(len(cut)), *cut] if len(cut) > 1 else cut:
                await self._socket.send_text(frame)

    def _send(self, message: object) -> None:
        self._out.put_nowait(json.dumps(message))

    def _push(self, action: str, body: object) -> None:
        self._send({"t": "d", "d": {"a": action, "b": body}})

    def _take(self, message: Mapping[str, Any]) -> None:
        """Answer a message."""
        if message["t"] == "c":
            if message["d"]["t"] == "p":
                self._send({"t": "c", "d": {"t": "o", "d": ""}})
            return
        request = message["d"]
        try:
            action = self._actions[request["a"]]
            answer = {"s": "ok", "d": action(request["b"])}
        except KeyError:
            answer = {"s": "invalid_action", "d": f"{request['a']} is not known"}
        except DeniedError:
            answer = {"s": "permission_denied", "d": "Permission denied"}
        except BadTokenError as error:
            answer = {"s": "invalid_token" if "parse" in str(error) else "expired_token", "d": str(error)}
        except _StaleError:
            answer = {"s": "datastale", "d": "Transaction hash does not match"}
        except BadDataError as error:
            answer = {"s": "invalid", "d": str(error)}
        self._send({"t": "d", "d": {"r": request["r"], "b": answer}})

    def _listen(self, body: Mapping[str, Any]) -> object:
        path, tag = parts(body["p"]), body.get("t")

        def deliver(name: str, below: Path, data: Any) -> None:
            whole = {"p": "/".join((*path, *below)), "d": data, **({} if tag is None else {"t": tag})}
            if name == "put":
                self._push("d", whole)
            elif name == "patch":
                self._push("m", whole)
            elif name == "cancel":
                self._push("c", {"p": body["p"], "q": body.get("q")})
            else:
                self._push("ac", ["expired_token", "Auth token is expired"])

        listener = Listener(path, query_of(body.get("q")), self._caller, deliver)
        tree = self._store.listen(listener)
        self._listeners[path, json.dumps(body.get("q"))] = listener
        deliver("put", (), exported(tree))
        return {}

    def _unlisten(self, body: Mapping[str, Any]) -> object:
        listener = self._listeners.pop((parts(body["p"]), json.dumps(body.get("q"))), None)
        if listener is not None:
            self._store.leave(listener)
        return ""

    def _get(self, body: Mapping[str, Any]) -> object:
        return exported(self._store.read(parts(body["p"]), self._caller, query_of(body.get("q"))))

    def _put(self, body: Mapping[str, Any]) -> object:
        path = parts(body["p"])
        if "h" in body and body["h"] != tree_hash(at(self._store.tree, path)):
            raise _StaleError
        self._store.write(path, [(path, body["d"])], self._caller, merge=False)
        return ""

    def _merge(self, body: Mapping[str, Any]) -> object:
        path = parts(body["p"])
        self._store.write(path, changes_of(path, body["d"]), self._caller, merge=True)
        return ""

    def _at_end(self, body: Mapping[str, Any]) -> object:
        self._later.append((parts(body["p"]), body["d"], False))
        return ""

    def _merge_at_end(self, body: Mapping[str, Any]) -> object:
        self._later.append((parts(body["p"]), body["d"], True))
        return ""

    def _cancel_at_end(self, body: Mapping[str, Any]) -> object:
        path = parts(body["p"])
        self._later = [one for one in self._later if one[0][: len(path)] != path]
        return ""

    def _change(self, path: Path, data: Any, *, merge: bool) -> None:
        with suppress(DeniedError, BadDataError):
            self._store.write(path, changes_of(path, data) if merge else [(path, data)], self._caller, merge=merge)

    def _sign_in(self, body: Mapping[str, Any]) -> object:
        self._caller = self._store.caller(body["cred"])
        return {"auth": self._caller.auth}

    def _sign_out(self, _: Mapping[str, Any]) -> object:
        self._caller = Caller()
        return ""


class _StaleError(Exception):
    """The data of a transaction changed meanwhile."""


def query_of(asked: Mapping[str, Any] | None) -> Query:
    """Return a query as a library writes it."""
    if not asked:
        return Query()
    start = end = None
    if "sp" in asked:
        start = (asked["sp"], asked.get("sn"), asked.get("sin", True))
    if "ep" in asked:
        end = (asked["ep"], asked.get("en"), asked.get("ein", True))
    return Query(asked.get("i", ".priority"), start, end, asked.get("l"), asked.get("vf") == "r")
