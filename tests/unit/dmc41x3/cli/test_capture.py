"""The proxy over real sockets: passed bytes, and their record."""

from __future__ import annotations

import asyncio
import io
from collections.abc import Awaitable, Callable

from dmc41x3.cli.recording import CaptureProxy, compared
from dmc41x3.wire.framing import Reply
from dmc41x3.wire.transcript import WirePiece, conversations, header, read
from tests.unit.dmc41x3.cli.bench import Bench, benched


class Client:
    """A connection to the go-between."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader = reader
        self._writer = writer

    async def ask(self, data: bytes, until: bytes) -> bytes:
        """Send bytes and return what comes, up to and with `until`."""
        self._writer.write(data)
        return await self._reader.readuntil(until)

    async def rest(self) -> bytes:
        """Return what comes until the other side ends."""
        return await self._reader.read()

    async def close(self) -> None:
        self._writer.close()
        await self._writer.wait_closed()


Act = Callable[[Bench, Callable[[], Awaitable[Client]]], Awaitable[None]]


def captured(act: Act) -> list[WirePiece]:
    """Return what is written down while `act` plays the clients."""
    file = io.StringIO()
    file.write(header("bench") + "\n")

    async def play() -> None:
        async with benched() as bench:
            between = CaptureProxy(bench.dial, file)
            host, _, port = (await between.listen("127.0.0.1", 0)).rpartition(":")

            async def client() -> Client:
                return Client(*await asyncio.open_connection(host, int(port)))

            try:
                await act(bench, client)
            finally:
                await between.close()

    asyncio.run(play())
    return read(io.StringIO(file.getvalue()))


def test_bytes_pass_unchanged_and_are_written_down() -> None:
    async def act(_: Bench, client: Callable[[], Awaitable[Client]]) -> None:
        one = await client()
        assert await one.ask(b"x=5;MG x\r", b"0\r\n:") == b": 5.0000\r\n:"
        assert len(await one.ask(b"QR\r", b":")) > 4
        await one.close()

    pieces = captured(act)
    assert pieces[0].event == "open"
    found = conversations(pieces)[1].exchanges
    assert [exchange.command for exchange in found] == ["x=5", "MG x", "QR"]
    assert found[1].reply == Reply(True, " 5.0000")
    assert [piece.time for piece in pieces] == sorted(piece.time for piece in pieces)


def test_clients_get_handles_of_their_own() -> None:
    async def act(_: Bench, client: Callable[[], Awaitable[Client]]) -> None:
        one, two = await client(), await client()
        assert await one.ask(b"WH\r", b":") == b"IHA\r\n:"
        assert await two.ask(b"WH\r", b":") == b"IHB\r\n:"
        await one.close()
        await two.close()

    assert {piece.link for piece in captured(act)} == {1, 2}


def test_the_end_of_the_controller_is_the_clients_end() -> None:
    async def act(bench: Bench, client: Callable[[], Awaitable[Client]]) -> None:
        one = await client()
        await one.ask(b"TP\r", b":")
        bench.controller.cut()
        assert await one.rest() == b""
        await one.close()

    assert captured(act)[-1][2:] == ("controller", b"", "end")


def test_a_controller_that_is_not_there_ends_the_client_only() -> None:
    async def act(bench: Bench, client: Callable[[], Awaitable[Client]]) -> None:
        bench.away = True
        one = await client()
        assert await one.rest() == b""
        await one.close()
        bench.away = False
        two = await client()
        assert await two.ask(b"WH\r", b":") == b"IHA\r\n:"
        await two.close()

    assert [piece.event for piece in captured(act)][:2] == ["open", "end"]


async def test_capture_can_be_replayed() -> None:
    pieces = [
        WirePiece(0.0, 1, "client", b"SHA;DP 5\rTP\r"),
        WirePiece(0.0, 1, "controller", b":: 5, 0, 0\r\n:"),
    ]
    async with benched() as bench:
        outcome = await compared(bench.dial, pieces, 0.0)
    assert outcome == (3, [])
