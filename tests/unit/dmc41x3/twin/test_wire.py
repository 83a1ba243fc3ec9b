"""The line discipline and the handles over real sockets, TCP and UDP."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from itertools import pairwise
from typing import Any

import pytest

from dmc41x3.language.record import decode
from dmc41x3.loops import run
from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.plant import BenchPlant
from dmc41x3.twin.wire.connections import SEGMENT, segments
from dmc41x3.twin.wire.server import VirtualController

PATIENCE = 20.0
"""Longest wait for something that must come [s]."""


class Wire:
    """One TCP connection to a controller."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.reader = reader
        self.writer = writer

    @property
    def own(self) -> tuple[str, int]:
        name = self.writer.get_extra_info("sockname")
        return name[0], name[1]

    async def say(self, data: bytes, answer: bytes) -> None:
        """Send bytes and take exactly the answer."""
        self.writer.write(data)
        await self.hear(answer)

    async def hear(self, expected: bytes) -> None:
        async with asyncio.timeout(PATIENCE):
            assert await self.reader.readexactly(len(expected)) == expected

    async def ends(self) -> bytes:
        """Return what comes before the end."""
        async with asyncio.timeout(PATIENCE):
            rest = b""
            with suppress(ConnectionResetError):
                while data := await self.reader.read(1000):
                    rest += data
            return rest


class Datagrams(asyncio.DatagramProtocol):
    """One UDP socket."""

    def __init__(self) -> None:
        self.inbox: asyncio.Queue[bytes] = asyncio.Queue()
        self.transport: asyncio.DatagramTransport | None = None

    def connection_made(self, transport: Any) -> None:
        self.transport = transport

    def datagram_received(self, data: bytes, addr: Any) -> None:
        self.inbox.put_nowait(data)

    def send(self, data: bytes) -> None:
        assert self.transport is not None
        self.transport.sendto(data)

    async def hear(self) -> bytes:
        async with asyncio.timeout(PATIENCE):
            return await self.inbox.get()

    async def say(self, data: bytes) -> bytes:
        self.send(data)
        return await self.hear()


class ServedClients:
    """A served controller, and everybody who talks to it."""

    def __init__(self, virtual: VirtualController, address: tuple[str, int]) -> None:
        self.virtual = virtual
        self.address = address
        self._heard = 0
        self._awaited: tuple[int, asyncio.Future[None]] | None = None
        virtual.tap = self._note
        self._writers: list[asyncio.StreamWriter] = []
        self._transports: list[asyncio.DatagramTransport] = []

    async def tcp(self, port: int | None = None) -> Wire:
        reader, writer = await asyncio.open_connection(self.address[0], port or self.address[1])
        self._writers.append(writer)
        return Wire(reader, writer)

    async def udp(self, port: int | None = None) -> Datagrams:
        address = (self.address[0], port or self.address[1])
        transport, protocol = await asyncio.get_running_loop().create_datagram_endpoint(Datagrams, remote_addr=address)
        self._transports.append(transport)
        return protocol

    def _note(self, letter: str, direction: str, data: bytes) -> None:
        self._heard += len(data) * (direction == "rx")
        if self._awaited is not None and self._heard >= self._awaited[0]:
            self._awaited[1].set_result(None)
            self._awaited = None

    async def delivered(self, wire: Wire, data: bytes) -> None:
        """Send bytes and wait until the controller has them, so that they came in a packet of their own."""
        if not data:
            return
        there = asyncio.get_running_loop().create_future()
        self._awaited = (self._heard + len(data), there)
        wire.writer.write(data)
        async with asyncio.timeout(PATIENCE):
            await there

    async def close(self) -> None:
        for transport in self._transports:
            transport.close()
        for writer in self._writers:
            writer.close()
            with suppress(ConnectionError):
                await writer.wait_closed()
        await self.virtual.close()


@asynccontextmanager
async def served_clients() -> AsyncIterator[ServedClients]:
    virtual = VirtualController(VirtualDmc(BenchPlant()))
    made = ServedClients(virtual, await virtual.serve())
    try:
        yield made
    finally:
        await made.close()


LINES = [
    (b"\r", b":"),
    (b"\n", b""),
    (b"\r\n", b":"),
    (b"\n\r", b":"),
    (b"x=1\r", b":"),
    (b"MG 7\r\n", b" 7.0000\r\n:"),
    (b"MG 7\n\r", b" 7.0000\r\n:"),
    (b"MG 7;", b" 7.0000\r\n:"),
    (b"MG 7;\r\n", b" 7.0000\r\n::"),
    (b"MG 1;MG 2\r", b" 1.0000\r\n: 2.0000\r\n:"),
    (b"MG 1;;MG 2\r", b" 1.0000\r\n:: 2.0000\r\n:"),
    (b"GF32;TC\r\n", b"? 1\r\n:"),
    (b"bg;TC\r", b"? 1\r\n:"),
    (b"TPA;\r\n", b" 0\r\n::"),
    (b"\x12\x16\r", b"DMC4133 Rev 1.3k\r\n:"),
    (b"WH\r", b"IHA\r\n:"),
    (b"QZ\r\n", b" 3, 52, 26, 36\r\n:"),
    (b"\xcd\xc7 \xb5\x8d\x8a", b" 5.0000\r\n:"),
    (b"'a comment; MG 6\r", b":"),
    (b"EO 1;MG 3\r", b": 3.0000\r\n:"),
    (b"v=1" + b" " * 77 + b"\r", b":"),
    (b"v=1" + b" " * 78 + b"\r", b"?"),
    (b"MG 1" + b";" * 76 + b"\r", b" 1.0000\r\n" + b":" * 77),
    (b'MG "' + b"y" * 70 + b'"\r', b"y" * 70 + b"\r\n:"),
]
"""Lines and what they answer, none more and none less."""
PROBE, PROBED = b"MG 99\r", b" 99.0000\r\n:"


@pytest.mark.parametrize(("line", "reply"), LINES)
def test_a_line_cut_at_every_byte(line: bytes, reply: bytes) -> None:
    async def main() -> None:
        async with served_clients() as made:
            wire = await made.tcp()
            for cut in range(len(line) + 1):
                await made.delivered(wire, line[:cut])
                await wire.say(line[cut:] + PROBE, reply + PROBED)

    run(main())


def test_all_lines_byte_by_byte_and_all_in_one_packet() -> None:
    async def main() -> None:
        async with served_clients() as made:
            wire = await made.tcp()
            everything = b"".join(line for line, _ in LINES)
            replies = b"".join(reply for _, reply in LINES)
            for byte in everything:
                await made.delivered(wire, bytes([byte]))
            await wire.hear(replies)
            await wire.say(everything, replies)

    run(main())


def test_qr_ends_in_a_colon_and_no_line_end() -> None:
    async def main() -> None:
        async with served_clients() as made:
            wire = await made.tcp()
            wire.writer.write(b"QR\r" + PROBE)
            async with asyncio.timeout(PATIENCE):
                data = await wire.reader.readexactly(191)
            assert (data[1:4], data[190:]) == (b"\x07\xbe\x00", b":")
            await wire.hear(PROBED)

    run(main())


def test_segments_fit_into_a_packet_and_lose_nothing() -> None:
    data = bytes(range(256)) * 5
    pieces = segments(data)
    assert [len(piece) for piece in pieces] == [SEGMENT, SEGMENT, 1280 - 2 * SEGMENT]
    assert b"".join(pieces) == data
    assert segments(b"") == []


def test_a_long_reply_arrives_whole_over_tcp_and_in_packets_over_udp() -> None:
    async def main() -> None:
        async with served_clients() as made:
            wire, udp = await made.tcp(), await made.udp()
            names = sorted(f"v{number}" for number in range(100, 180))
            for name in names:
                await wire.say(f"{name}=1\r".encode(), b":")
            listing = b"".join(f"{name}= 1.0000\r\n".encode() for name in names) + b":"
            await wire.say(b"LV\r", listing)
            heard = await udp.say(b"LV\r")
            sizes = [len(heard)]
            while len(heard) < len(listing):
                heard += (more := await udp.hear())
                sizes.append(len(more))
            assert heard == listing
            assert sizes == [len(piece) for piece in segments(listing)]

    run(main())


def test_several_ports_lead_to_one_machine_each_with_its_number() -> None:
    async def main() -> None:
        async with served_clients() as made:
            _, other = await made.virtual.serve()
            first, second, udp = await made.tcp(), await made.tcp(other), await made.udp(other)
            await first.say(b"x=5\r", b":")
            await second.say(b"MG x\r", b" 5.0000\r\n:")
            assert await udp.say(b"MG x\r") == b" 5.0000\r\n:"
            first.writer.write(b"TH\r")
            async with asyncio.timeout(PATIENCE):
                listed = (await first.reader.readuntil(b"IHH AVAILABLE\r\n:")).decode().splitlines()
            assert listed[1] == f"IHA TCP PORT {made.address[1]} TO IP ADDRESS 127,0,0,1 PORT {first.own[1]}"
            assert listed[2] == f"IHB TCP PORT {other} TO IP ADDRESS 127,0,0,1 PORT {second.own[1]}"
            assert listed[3].startswith(f"IHC UDP PORT {other} TO IP ADDRESS 127,0,0,1 PORT ")

    run(main())


def test_a_first_datagram_takes_a_handle_and_later_ones_keep_it() -> None:
    async def main() -> None:
        async with served_clients() as made:
            one, two = await made.udp(), await made.udp()
            assert [await one.say(b"WH\r"), await two.say(b"WH\r"), await one.say(b"WH\r")] == [
                b"IHA\r\n:", b"IHB\r\n:", b"IHA\r\n:"
            ]  # fmt: skip
            assert await one.say(b"QR\r") != b"?"
            one.send(b"MG ")
            assert await one.say(b"4\r") == b" 4.0000\r\n:"
            assert await two.say(b"IHA=>-1\r") == b":"
            assert made.virtual.connections == "B"
            assert await one.say(b"WH\r") == b"IHA\r\n:"

    run(main())


def test_the_ninth_is_refused_on_either_protocol_until_one_leaves() -> None:
    async def main() -> None:
        async with served_clients() as made:
            wires = [await made.tcp() for _ in range(7)]
            for wire in wires:
                await wire.say(PROBE, PROBED)
            udp = await made.udp()
            assert await udp.say(b"WH\r") == b"IHH\r\n:"
            assert await (await made.tcp()).ends() == b""
            deaf = await made.udp()
            deaf.send(b"WH\r")
            wires[2].writer.write(b"IHS=>-2\r")
            assert await wires[2].ends() == b":"
            assert await deaf.say(b"WH\r") == b"IHC\r\n:"

    run(main())


def test_iht_closes_the_sockets_of_all_others() -> None:
    async def main() -> None:
        async with served_clients() as made:
            wires = [await made.tcp() for _ in range(3)]
            for wire in wires:
                await wire.say(PROBE, PROBED)
            udp = await made.udp()
            await udp.say(b"WH\r")
            await wires[1].say(b"IHT=>-3\r", b":")
            assert [await wires[place].ends() for place in (0, 2)] == [b"", b""]
            assert made.virtual.connections == "B"
            await wires[1].say(b"WH\r", b"IHB\r\n:")

    run(main())


def test_a_reset_answers_and_ends_every_connection() -> None:
    async def main() -> None:
        async with served_clients() as made:
            first, second = await made.tcp(), await made.tcp()
            await second.say(PROBE, PROBED)
            first.writer.write(b"RS\rMG 1\r")
            assert (await first.ends(), await second.ends()) == (b":", b"")
            again = await made.tcp()
            await again.say(b"WH\r", b"IHA\r\n:")

    run(main())


def test_ports_below_1000_are_refused_by_ik_1() -> None:
    machine = VirtualDmc(BenchPlant())
    assert machine.connect(("127.0.0.1", 5), port=80) is None
    assert machine.connect(("127.0.0.1", 5), port=23) is not None


def test_messages_go_to_the_port_of_cf_marked_by_cw() -> None:
    async def main() -> None:
        async with served_clients() as made:
            asker, listener = await made.tcp(), await made.tcp()
            await listener.say(b"CF I;CW 1\r", b"::")
            await asker.say(b"DL\r#A\rMG 5\rEN\r\\", b"::")
            await asker.say(b"XQ #A\r", b":")
            await listener.hear(bytes(byte | 0x80 for byte in b" 5.0000\r\n"))
            await asker.say(b'MG {EB}"hi"\r', b":")
            await listener.hear(b"\xe8\xe9\x8d\x8a")
            await listener.say(b"CW 2\r", b":")
            udp = await made.udp()
            await udp.say(b"CF I\r")
            await asker.say(b"XQ #A\r", b":")
            assert await udp.hear() == b" 5.0000\r\n"
            await asker.say(b"IHC=>-1;XQ #A\r", b"::")
            await listener.hear(b" 5.0000\r\n")

    run(main())


def test_records_arrive_by_udp_in_time_and_without_a_colon() -> None:
    async def main() -> None:
        async with served_clients() as made:
            udp = await made.udp()
            await udp.say(b"WH\r")
            wire = await made.tcp()
            await wire.say(b"DR 8,0\r", b":")
            late = list[float]()
            samples = list[int]()
            for _ in range(64):
                record = decode(await udp.hear())
                late.append(made.virtual.machine.now * 1024 - record.sample)
                samples.append(record.sample)
            assert [after - before for before, after in pairwise(samples)] == [8] * 63
            assert sorted(late)[32] < 10.24
            await wire.say(b"DR 0\r", b":")

    run(main())


@asynccontextmanager
async def listener() -> AsyncIterator[tuple[int, asyncio.Queue[Wire]]]:
    """Somebody for the controller to dial: the port, and who called."""
    callers: asyncio.Queue[Wire] = asyncio.Queue()
    server = await asyncio.start_server(lambda reader, writer: callers.put_nowait(Wire(reader, writer)), "127.0.0.1", 0)
    try:
        yield server.sockets[0].getsockname()[1], callers
    finally:
        server.close()
        while not callers.empty():
            callers.get_nowait().writer.close()
        await server.wait_closed()


async def called(callers: asyncio.Queue[Wire]) -> Wire:
    async with asyncio.timeout(PATIENCE):
        return await callers.get()


def test_ih_dials_out_by_tcp() -> None:
    async def main() -> None:
        async with listener() as (port, callers), served_clients() as made:
            wire = await made.tcp()
            await wire.say(f"IHC=127,0,0,1<{port}>2\r".encode(), b":")
            slave = await called(callers)
            await wire.say(b"MG _IHC2,_IHC3\r", b"-2.0000 0.0000\r\n:")
            await wire.say(b'MG {EC}"TP"\r', b":")
            await slave.hear(b"TP\r\n")
            await made.delivered(slave, b" 1, 2\r\n:")
            await wire.say(b"MG _IHC4\r", b" 2.0000\r\n:")
            await wire.say(b"IHC=>-2\r", b":")
            assert await slave.ends() == b""
            slave.writer.close()

    run(main())


def test_ih_dials_out_by_udp() -> None:
    async def main() -> None:
        async with served_clients() as made:
            loop = asyncio.get_running_loop()
            transport, station = await loop.create_datagram_endpoint(Datagrams, local_addr=("127.0.0.1", 0))
            wire = await made.tcp()
            port = transport.get_extra_info("sockname")[1]
            await wire.say(f"IHB=127,0,0,1<{port}>1\r".encode(), b":")
            reached = b""
            while reached != b"-1.0000\r\n":
                wire.writer.write(b"MG _IHB2\r")
                reached = (await wire.reader.readuntil(b":"))[:-1]
            await wire.say(b'MG {EB}"TP"\r', b":")
            assert await station.hear() == b"TP\r\n"
            await wire.say(b"DR 8,1\r", b":")
            assert len(await station.hear()) == 190
            transport.close()

    run(main())


def test_unanswered_handle_is_closed_with_error_123() -> None:
    async def main() -> None:
        with socket.create_server(("127.0.0.1", 0)) as taken:
            port = taken.getsockname()[1]
        async with served_clients() as made:
            told: asyncio.Future[int] = asyncio.get_running_loop().create_future()
            made.virtual.machine.unit.on_tcp_error = told.set_result
            wire = await made.tcp()
            await wire.say(f"IA<4;IHD=127,0,0,1<{port}\r".encode(), b"::")
            async with asyncio.timeout(PATIENCE):
                assert await told == 3
            await wire.say(b"MG _IHD2,_IA4,_TC\r", b" 0.0000 3.0000 123.0000\r\n:")

    run(main())


def test_program_learns_of_a_lost_handle_by_tcperr() -> None:
    async def main() -> None:
        with socket.create_server(("127.0.0.1", 0)) as taken:
            port = taken.getsockname()[1]
        async with served_clients() as made:
            wire = await made.tcp()
            await wire.say(b'CF I\rDL\r#TCPERR\rMG "lost",_IA4,_TC\rRE\r\\', b":::")
            await wire.say(f"IA<4;IHB=127,0,0,1<{port}\r".encode(), b"::")
            await wire.hear(b"lost 1.0000 123.0000\r\n")

    run(main())


def test_sending_to_a_connection_that_was_reset_is_error_123() -> None:
    async def main() -> None:
        async with served_clients() as made:
            told: asyncio.Future[int] = asyncio.get_running_loop().create_future()
            made.virtual.machine.unit.on_tcp_error = told.set_result
            wire = await made.tcp()
            rude = socket.create_connection(made.address)
            rude.sendall(b"WH\r")
            await wire.say(PROBE, PROBED)
            rude.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\x01\x00\x00\x00\x00\x00\x00\x00")
            rude.close()
            async with asyncio.timeout(PATIENCE):
                assert await told in {0, 1}
            assert len(made.virtual.connections) == 1

    run(main())


def test_ordinary_close_is_no_error() -> None:
    async def main() -> None:
        async with served_clients() as made:
            first, second = await made.tcp(), await made.tcp()
            await first.say(PROBE, PROBED)
            await second.say(PROBE, PROBED)
            first.writer.close()
            await first.writer.wait_closed()
            async with asyncio.timeout(PATIENCE):
                while made.virtual.connections != "B":
                    await second.say(PROBE, PROBED)
            await second.say(b"MG _TC,_IA4\r", b" 0.0000 0.0000\r\n:")

    run(main())
