"""One client of the stream: its handshake, the replay of missed events, and its messages.

Each page of a replay is a turn in the share of all readers of the past, so the loop stays free for other tasks, however
many events are requested.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any

from starlette.websockets import WebSocket

from dmc41x3.i18n import phrase
from maya_un import __version__
from maya_un.errors import EventsForgotten, InvalidRequest, MayaError, NotSignedIn, StreamLagging
from maya_un.http.bridge import Bridge, LoopShare
from maya_un.http.connections import is_local, source_of
from maya_un.http.dates import moment
from maya_un.http.errors import language_of
from maya_un.http.log import written_down
from maya_un.http.stream.hub import CHUNK, StreamHub, StreamReader
from maya_un.http.stream.messages import (
    PROTOCOL,
    ReplayStart,
    StreamWire,
    decoded,
    error_frame,
    event_frame,
    kind_of,
    plain_frame,
    subscription,
)
from maya_un.http.stream.requests import StreamRequests
from maya_un.http.stream.topics import TOPICS, Audience
from maya_un.schema.robot import EventMessage
from maya_un.service.access.operations import Caller, Operation


async def received(socket: WebSocket) -> str | bytes | None:
    """Return the next message of a client, None if the connection is over."""
    message = await socket.receive()
    if message["type"] == "websocket.disconnect":
        return None
    text: str | bytes | None = message.get("text")
    return message["bytes"] if text is None else text


INTRODUCTION = 10.0
"""Time limit for the first message of a client that must sign in [s]."""


class StreamHandshake:
    """Identifies the client of `socket`; called again for every message, since a token may be revoked.

    `language` is that of the texts on this connection.
    """

    def __init__(self, socket: WebSocket, bridge: Bridge) -> None:
        self._socket = socket
        self._bridge = bridge
        self._shown = socket.headers.get("authorization")
        self.language = language_of(socket.headers)

    async def caller(self) -> Caller:
        """Return the caller; raises `NotSignedIn`, `TooManyRequests`."""
        source, local = source_of(self._socket), is_local(self._socket)
        return await self._bridge.caller(self._shown, "", source, loopback=local, stopping=False)

    async def introduced(self) -> Caller | None:
        """Return the caller, identified by the request or the first message; None if the connection is over.

        Raises `NotSignedIn` too if the first message does not arrive in time. The time that the service needs to answer
        is not limited: a busy service must not tell a client that it has to sign in.
        """
        try:
            return await self.caller()
        except NotSignedIn:
            if self._shown is not None:
                raise
        text = await self._first_message()
        return None if text is None else await self.meet(decoded(text))

    async def _first_message(self) -> str | bytes | None:
        try:
            async with asyncio.timeout(INTRODUCTION):
                return await received(self._socket)
        except TimeoutError:
            raise NotSignedIn(
                reason=phrase("no `hello` with a token arrived within {seconds:g} s", seconds=INTRODUCTION)
            ) from None

    async def meet(self, message: Mapping[str, Any]) -> Caller:
        """Return the caller of a `hello`, by its token if it has one; raises as `introduced` does."""
        if kind_of(message) != "hello":
            raise NotSignedIn(reason="the first message is not `hello` with a token")
        if message.get("protocol", PROTOCOL) != PROTOCOL:
            raise InvalidRequest(key="protocol", reason=phrase("this is version {version}", version=PROTOCOL))
        for key in ("token", "language"):
            if not isinstance(message.get(key, ""), str | None):
                raise InvalidRequest(key=key, reason="it must be a text")
        if (token := message.get("token")) is not None:
            self._shown = f"Bearer {token}"
        if language := message.get("language"):
            self.language = language_of({"accept-language": language})
        return await self.caller()


PAGE = 250
"""Number of past events read at once."""

NEAR = 250
"""A client that lags by at most this many events gets them at once, and then the new ones."""

LookUp = Callable[[int, int], Awaitable[list[EventMessage]]]
"""Returns events of this run numbered above the first argument, at most as many as the second, oldest first."""


async def catch_up(
    reader: StreamReader, hub: StreamHub, look_up: LookUp, room: Callable[[], Awaitable[object]], share: LoopShare
) -> None:
    """Send a reader its missing events from the hub's ring or from `look_up`; then the hub continues.

    `room` is awaited before every page. Raises `EventsForgotten` if an event is missing, and what `look_up` raises.
    """
    ring = hub.ring
    reader.catching = True
    while reader.seen is not None and not (ring.reaches(reader.seen) and ring.last - reader.seen <= NEAR):
        await room()
        async with share.turn():
            if ring.reaches(reader.seen):
                upto, frames = ring.after(reader.seen, CHUNK)
            else:
                page = await look_up(reader.seen, PAGE)
                if not page or page[0].seq != reader.seen + 1:
                    raise EventsForgotten(since=reader.seen, oldest=page[0].seq if page else ring.first)
                upto, frames = page[-1].seq, b"".join(event_frame(hub.run, event) for event in page)
            reader.send_past(upto, frames)
    reader.catching = False
    hub.send_events(reader)


MOST_MESSAGES, BURST = 100.0, 200
"""Messages of a client that are answered per second, and at once after a pause."""

PAST_COSTS = 0.5
"""Delay that a request for past events adds to the client's messages beyond its allowance [s]."""

_DEFECT = 1011
"""Closing code for a defect of the server (RFC 6455, 7.4.1)."""


def refuse(wire: StreamWire, error: MayaError, language: str) -> None:
    """Send the reason why a connection ends, and close it with the code of the error."""
    wire.write(error_frame(error, language))
    wire.end(error.code if 4000 <= error.code < 5000 else _DEFECT, type(error).__name__)


class StreamSession:
    """Exchanges messages with `caller` on `socket`; `hub` sends data over `wire`."""

    def __init__(
        self,
        socket: WebSocket,
        wire: StreamWire,
        bridge: Bridge,
        hub: StreamHub,
        handshake: StreamHandshake,
        caller: Caller,
    ) -> None:
        self._socket = socket
        self._handshake = handshake
        self._wire = wire
        self._bridge = bridge
        self._hub = hub
        self._caller = caller
        self._reader = StreamReader(wire, hub.ring, self._lag)
        self._requests = StreamRequests(socket, wire.write, lambda: handshake.language)
        self._catching: asyncio.Task[None] | None = None
        self._bound = ""
        self._heard_until = 0.0

    async def converse(self) -> None:
        """Greet the client and answer its messages, until one side ends."""
        self._address()
        await self._greet({})
        try:
            while (text := await received(self._socket)) is not None:
                await self._wire.writable.wait()  # no messages of a client that does not read are processed
                await self._hear(text)
                await self._breathe()
        finally:
            self._stop_catching_up()
            self._requests.end()
            self._wire.on_room = None
            self._hub.leave(self._reader)
            await self._let_go()

    @property
    def caller(self) -> Caller:
        """The caller."""
        return self._caller

    def take_rights(self, now: Caller | MayaError) -> None:
        """Apply changed rights of the client; disconnect it if they have ended."""
        if isinstance(now, MayaError):
            refuse(self._wire, now, self._handshake.language)
        else:
            self._become(now)

    def _become(self, caller: Caller) -> None:
        self._caller = caller
        self._address()

    def _address(self) -> None:
        """Have personal topics follow the rights of this client, under the lease that its requests have."""
        caller = replace(self._caller, source="", token="", lease=self._bound)
        self._hub.address(self._reader, Audience(caller, self._handshake.language))

    async def _breathe(self) -> None:
        """Delay the next message of a client that sends too many; other clients do not wait."""
        self._charge(1.0 / MOST_MESSAGES)
        now = asyncio.get_running_loop().time()
        if self._heard_until > now:
            await asyncio.sleep(self._heard_until - now)

    def _charge(self, cost: float) -> None:
        """Add `cost` [s] to the delay of the client's next message; unused allowance adds up to `BURST` messages."""
        now = asyncio.get_running_loop().time()
        self._heard_until = max(self._heard_until, now - BURST / MOST_MESSAGES) + cost

    async def _hear(self, text: str | bytes) -> None:
        message: dict[str, Any] = {}
        try:
            message = decoded(text)
            kind = kind_of(message)
            if kind == "hello":
                self._become(await self._handshake.meet(message))
                await self._greet(message)
                return
            self._become(await self._handshake.caller())
            match kind:
                case "subscribe":
                    await self._subscribe(message)
                case "renew":
                    await self._renew(message)
                case "request":
                    self._requests.begin(message, self._caller, self._bound)
                case _:
                    self._wire.write(plain_frame("pong", message, clock=asyncio.get_running_loop().time()))
        except NotSignedIn:
            raise
        except MayaError as error:
            self._wire.write(error_frame(error, self._handshake.language, message))

    async def _greet(self, about: Mapping[str, Any]) -> None:
        """Introduce the robot, with the date of a time of its clock, because events have times of that clock."""
        time, date = await self._bridge.within(_clocks)
        who = {"name": self._caller.name, "role": self._caller.role.word}
        facts = {
            "version": __version__,
            "protocol": PROTOCOL,
            "run": self._hub.run,
            "last_event": self._hub.ring.last,
            "clock": asyncio.get_running_loop().time(),
        }
        self._wire.write(plain_frame("hello", about, **facts, **self._hub.about, time=time, date=date, who=who))

    async def _subscribe(self, message: Mapping[str, Any]) -> None:
        wanted = subscription(message)
        if wanted.past is not None:
            self._charge(PAST_COSTS)
        past = await self._past(wanted.past)
        self._wire.write(plain_frame("subscribed", message, run=self._hub.run))
        if "state" in wanted.named:
            self._hub.show_states(self._reader, wanted.rate)
        for name in wanted.named & TOPICS.keys():
            topic = TOPICS[name]
            self._hub.show(self._reader, topic, wanted=topic in wanted.topics)
        if "events" in wanted.named:
            self._send_events(past, restarted=wanted.past is not None and wanted.past.run not in {None, self._hub.run})

    async def _past(self, wanted: ReplayStart | None) -> int | None:
        """Return the number after which events start, None without a subscription; raises `InvalidRequest`."""
        if wanted is None:
            return None
        if wanted.run is not None and wanted.run != self._hub.run:
            return 0
        if wanted.since is None:
            return self._hub.ring.last
        if wanted.since > self._hub.ring.last:  # the client may know of an event that has not arrived here yet
            last = (await self._bridge.asked(lambda service: service.status())).last_event
            if wanted.since > last:
                raise InvalidRequest(
                    key="events.since", reason=phrase("the last event of this run has number {last}", last=last)
                )
        return wanted.since

    def _send_events(self, since: int | None, *, restarted: bool) -> None:
        self._stop_catching_up()
        self._hub.stop_events(self._reader)
        if restarted:
            self._wire.write(plain_frame("restart", run=self._hub.run))
        self._reader.seen = since
        if since is not None:
            self._catching = asyncio.get_running_loop().create_task(self._catch_up(), name="past events")

    async def _catch_up(self) -> None:
        try:
            await catch_up(self._reader, self._hub, self._look_up, self._wire.writable.wait, self._bridge.past)
        except MayaError as error:
            self._reader.seen = None
            self._wire.write(error_frame(error, self._handshake.language))
        except Exception as defect:  # noqa: BLE001 - no code awaits this task; the client and the log get the error
            refuse(self._wire, written_down(defect), self._handshake.language)

    async def _look_up(self, above: int, most: int) -> list[EventMessage]:
        run = self._hub.run
        return await self._bridge.call(
            self._caller, Operation.READ, lambda service: service.history.events(run, above, most)
        )

    def _stop_catching_up(self) -> None:
        if self._catching is not None:
            self._catching.cancel()
            self._catching = None
            self._reader.catching = False

    def _lag(self) -> None:
        seen = self._reader.seen or 0
        refuse(self._wire, StreamLagging(behind=self._hub.ring.last - seen, since=seen), self._handshake.language)

    async def _renew(self, message: Mapping[str, Any]) -> None:
        """Renew a lease; a `bound` lease is released when this connection ends."""
        lease, bound = message.get("lease"), message.get("bound", False)
        if not isinstance(lease, str) or not lease:
            raise InvalidRequest(key="lease", reason="it must be the id that you received with the lease")
        if not isinstance(bound, bool):
            raise InvalidRequest(key="bound", reason="it must be true or false")
        holder = replace(self._caller, lease=lease)
        view = await self._bridge.call(holder, Operation.RENEW, lambda service: service.lease.renew(holder))
        self._bound = lease if bound else ""
        self._address()
        self._wire.write(plain_frame("renewed", message, expires_in=view.expires_in, bound=bound))

    async def _let_go(self) -> None:
        if self._bound:
            holder = replace(self._caller, lease=self._bound)
            with suppress(MayaError):  # the lease has already ended
                await self._bridge.call(
                    holder, Operation.LEASE, lambda service: service.lease.release(holder, lost=True)
                )


async def _clocks() -> tuple[float, str]:
    """Return the time of the running loop [s], and its date."""
    return asyncio.get_running_loop().time(), moment()
