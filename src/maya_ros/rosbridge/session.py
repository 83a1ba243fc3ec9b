"""One client of the endpoint: its messages are carried out in order, and every error is sent as a status."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable, Iterable
from contextlib import AsyncExitStack, suppress
from typing import Any

from dmc41x3.i18n import phrase
from maya_ros.rosbridge import outgoing
from maya_ros.rosbridge.actions import ClientActions, ClientGoals
from maya_ros.rosbridge.client import Id, MessageScheduler, RosbridgeClient, StatusLevel
from maya_ros.rosbridge.incoming import (
    Fields,
    FragmentCollector,
    Objects,
    as_object,
    decoded,
    not_json,
    parsed,
    stop_in,
)
from maya_ros.rosbridge.limits import LONGEST_MESSAGE, NESTED, WAITING
from maya_ros.rosbridge.rosapi import Rosapi
from maya_ros.rosbridge.services import ClientCalls, ClientServices
from maya_ros.rosbridge.topics import ClientPublications, ClientSubscriptions
from maya_un.errors import InvalidRequest, MayaError
from maya_un.http.log import written_down

Operation = Callable[[Fields], Awaitable[None] | None]
"""Carries out a message at once, or returns what must be awaited before the next message."""

Entry = Callable[[str | None], Awaitable[None]]
"""Signs a client in with a token; raises the reason of a refusal."""

_LEVELS = tuple(StatusLevel.__members__)


class RosbridgeSession:
    """Carries out the messages of one client, in `turns` for all clients. `on_calm` is called when it can take more.

    `entry` is called with tokens, if clients must sign in.

    No message of a client raises an error here. Messages that come while it is `busy` wait and use memory.
    """

    def __init__(
        self, client: RosbridgeClient, rosapi: Rosapi, turns: MessageScheduler, entry: Entry | None = None
    ) -> None:
        self._client = client
        self._turns = turns
        self._entry = entry
        self._subscribing = ClientSubscriptions(client)
        self._publishing = ClientPublications(client, self._subscribing.hears)
        self._subscribing.on_end = self._publishing.ended
        self._calling = ClientCalls(client, rosapi)
        self._serving = ClientServices(client)
        self._goals = ClientGoals(client)
        self._acting = ClientActions(client)
        self._gathering = FragmentCollector()
        self._objects = Objects()
        self._inbox: deque[str | bytes] = deque()
        self._loop = asyncio.get_running_loop()
        self._closed = False
        self._at_it = False
        self._looked_at = False
        self.on_calm: Callable[[], None] | None = None
        self._ops: dict[str, Operation] = {
            **self._subscribing.ops, **self._publishing.ops, **self._calling.ops, **self._serving.ops,
            **self._goals.ops, **self._acting.ops, "set_level": self._set_level, "auth": self._auth,
        }  # fmt: skip

    @property
    def busy(self) -> bool:
        """Whether reading should pause; during a check of a token it continues, for a stop."""
        return self._at_it and not (self._looked_at and len(self._inbox) < WAITING)

    def begin(self, token: str | None) -> None:
        """Sign in with the `token` of the connection; messages wait meanwhile."""
        if self._entry is not None:
            self._at_it = True
            self._client.spawn(self._after(self._introduced(self._entry, token)), "who is there")

    async def _introduced(self, entry: Entry, token: str | None) -> None:
        try:
            await self._shown(entry, token)
        except Exception as error:  # noqa: BLE001 - as for a message
            if token is not None:
                self._refuse(error, None)

    async def _shown(self, entry: Entry, token: str | None) -> None:
        self._looked_at = True
        self._stop_ahead(self._inbox)
        self._hear_more()  # reading paused when the message with the token came
        try:
            await entry(token)
        finally:
            self._looked_at = False

    def take(self, *texts: str | bytes) -> None:
        """Carry out the messages of one text, after earlier ones.

        A stop does not wait for the check of a token: it begins at once, and again in its order. After the end of the
        session, messages are dropped: the connection can still receive some.
        """
        if self._closed:
            return
        self._inbox.extend(texts)
        if self._looked_at:
            self._stop_ahead(texts)
        if self._inbox and not self._at_it:
            self._at_it = True
            self._turns.give(self._step)

    def _stop_ahead(self, texts: Iterable[str | bytes]) -> None:
        for service in filter(None, map(stop_in, texts)):
            self._client.spawn(self._stop(service), "a stop ahead")

    async def _stop(self, service: str) -> None:
        with suppress(MayaError):  # it is refused again in its order, and that refusal is sent
            await self._client.graph.call(service, {})

    def _step(self) -> bool:
        """Carry out the next message; return whether another can be carried out now."""
        step = None if self._closed else self._carry_out(self._inbox.popleft())
        if step is not None:
            self._client.spawn(self._after(step), "a message")
        return step is None and self._goes_on()

    async def _after(self, step: Awaitable[None]) -> None:
        await step
        if self._goes_on():
            self._turns.give(self._step)

    def _goes_on(self) -> bool:
        """Return whether more messages wait; allow reading, unless the session is busy."""
        self._at_it = bool(self._inbox) and not self._closed
        self._hear_more()
        return self._at_it

    def _hear_more(self) -> None:
        if not self.busy and self.on_calm is not None:
            self.on_calm()

    def _carry_out(self, text: str | bytes) -> Awaitable[None] | None:
        """Carry out a message; return what must be awaited, None if it is done."""
        name: Id = None
        try:
            whole = self._next_object(text)
            message = None if whole is None else self._unwrapped(whole)
            if message is None:
                return None
            fields = Fields(message)
            name = fields.id
            step = self._operation(fields)(fields)
        except Exception as error:  # noqa: BLE001 - a client gets one sentence, the log the rest
            self._refuse(error, name)
            return None
        return None if step is None else self._watched(step, name)

    async def _watched(self, step: Awaitable[None], name: Id) -> None:
        try:
            await step
        except Exception as error:  # noqa: BLE001 - as above
            self._refuse(error, name)

    def _refuse(self, error: Exception, name: Id) -> None:
        self._client.refuse(error if isinstance(error, MayaError) else written_down(error), name)

    def _operation(self, fields: Fields) -> Operation:
        op = fields.get("op")
        found = self._ops.get(op) if isinstance(op, str) else None
        if found is None:
            raise InvalidRequest(
                key="op",
                reason=phrase(
                    "it must be one of {choices}", choices=", ".join(sorted([*self._ops, "fragment", "png"]))
                ),
            )
        return found

    def _next_object(self, text: str | bytes) -> dict[str, Any] | None:
        """Return the object of a text, or the first of several; None for a part of an object."""
        try:
            text = text if isinstance(text, str) else text.decode()
            value = parsed(text)
        except UnicodeDecodeError as error:
            raise not_json(error) from error
        except ValueError as error:
            return self._next_of_several(str(text), error)
        if not self._objects.incomplete:
            return as_object(value)
        if not isinstance(value, dict) or "op" not in value:
            return self._next_of_several(text)
        self._objects.forget()
        self._client.refuse(InvalidRequest(key="message", reason="it is incomplete, and the next message has begun"))
        return value

    def _next_of_several(self, text: str, error: ValueError | None = None) -> dict[str, Any] | None:
        found = self._objects.add(text)
        self._inbox.extendleft(found[:0:-1])
        if found:
            return decoded(found[0])
        if error is not None and not self._objects.incomplete:
            raise not_json(error) from error
        return None

    def _unwrapped(self, message: dict[str, Any]) -> dict[str, Any] | None:
        """Return the message, unpacked from fragments or a picture; None if fragments are missing."""
        for _ in range(NESTED):
            op = message.get("op")
            if op is None:
                raise InvalidRequest(key="op", reason="it is missing")
            if op not in ("fragment", "png"):
                return message
            fields = Fields(message)
            pieces = op == "fragment" or fields.get("num") is not None
            found = self._gathering.add(fields, op, self._loop.time()) if pieces else fields.text("data")
            if found is None:
                return None
            message = decoded(outgoing.decoded(found, LONGEST_MESSAGE) if op == "png" else found)
        raise InvalidRequest(key="op", reason=phrase("a message is wrapped at most {most} times", most=NESTED))

    def _set_level(self, fields: Fields) -> None:
        self._client.level = StatusLevel[fields.one_of("level", _LEVELS, "")]

    def _auth(self, fields: Fields) -> Awaitable[None] | None:
        """Carry out `auth`: `mac` is a token, because only hashes of tokens are stored, which cannot check a MAC."""
        token, name = fields.text("mac"), fields.id
        if not token:
            raise InvalidRequest(key="mac", reason="it must be a token, like maya_…")
        return None if self._entry is None else self._signed_in(self._entry, token, name)

    async def _signed_in(self, entry: Entry, token: str, name: Id) -> None:
        await self._shown(entry, token)
        self._client.tell(StatusLevel.info, "signed in", name)

    async def close(self) -> None:
        """End everything that this client started, and return when it has ended, also after an error of a part."""
        self._closed = True
        self._inbox.clear()
        self._client.level = StatusLevel.none
        async with AsyncExitStack() as ends:
            ends.push_async_callback(self._client.close)
            for part in (self._acting, self._serving, self._subscribing, self._publishing):
                ends.callback(part.close)
