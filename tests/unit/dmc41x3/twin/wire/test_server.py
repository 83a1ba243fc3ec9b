"""The virtual controller on its wires. TCP runs in the ordinary loop: real sockets do not belong in virtual time."""

from __future__ import annotations

import asyncio
import socket
from contextlib import suppress

import pytest

from dmc41x3.driver import Driver
from dmc41x3.errors import AddressInUse, CommandRejected, LinkLost
from dmc41x3.language.record import decode
from dmc41x3.loops import run
from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.plant import BenchPlant
from dmc41x3.twin.wire.server import TICK, VirtualController
from tests.virtual_time import elapse, turn


def made() -> VirtualController:
    return VirtualController(VirtualDmc(BenchPlant()))


async def test_the_driver_talks_to_it_in_virtual_time() -> None:
    virtual = made()
    driver = await Driver.open(virtual.loopback(), timeout=1.0)
    await driver.batch(["SHA", "SPA=10240", "ACA=10240", "DCA=10240", "PAA=102400", "BGA"])
    with pytest.raises(CommandRejected):
        await driver.send("BGA")
    await elapse(10.5)
    assert (await driver.record()).axes[0].moving
    await elapse(0.6)
    record = await driver.record()
    assert (record.axes[0].moving, record.axes[0].position) == (False, 102_400)
    await driver.close()
    await virtual.close()


async def test_time_is_the_loops_also_without_anybody_asking() -> None:
    virtual = made()
    driver = await Driver.open(virtual.loopback(), timeout=1.0)
    await driver.batch(["SHA", "JGA=25000", "BGA"])
    await elapse(2.0)
    assert virtual.machine.now == asyncio.get_running_loop().time()
    await driver.close()
    await virtual.close()


async def test_a_cut_ends_every_link_and_no_motion() -> None:
    virtual = made()
    drivers = [await Driver.open(virtual.loopback(), timeout=1.0) for _ in range(2)]
    await drivers[0].batch(["SHA", "PRA=50000", "BGA"])
    await drivers[1].send("TP")
    await elapse(0.5)
    virtual.cut()
    await asyncio.wait([driver.lost for driver in drivers])
    with pytest.raises(LinkLost):
        await drivers[1].send("TP")
    assert virtual.connections == ""
    again = await Driver.open(virtual.loopback(), timeout=1.0)
    await elapse(60.0)
    assert await again.send("WH") == "IHA"
    assert await again.value("_TPA") == 50000.0
    for driver in (*drivers, again):
        await driver.close()
    await virtual.close()


async def test_refused_connections_end_at_once() -> None:
    virtual = made()
    virtual.refuse(True)
    assert await virtual.loopback().read() == b""
    virtual.refuse(False)
    ends = [virtual.loopback() for _ in range(9)]
    assert virtual.connections == "ABCDEFGH"
    assert await ends[8].read() == b""
    await virtual.close()
    assert await ends[0].read() == b""


async def test_iht_really_closes_the_others() -> None:
    virtual = made()
    first, second = virtual.loopback(), virtual.loopback()
    second.write(b"IHT=>-3\rWH\r")
    assert await first.read() == b""
    assert await second.read() == b":IHB\r\n:"
    assert virtual.connections == "B"
    await virtual.close()


async def test_ihs_is_answered_and_then_ends_the_link() -> None:
    virtual = made()
    host = virtual.loopback()
    host.write(b"IHS=>-3\r")
    assert (await host.read(), await host.read()) == (b":", b"")
    assert virtual.connections == ""
    await virtual.close()


async def test_a_message_for_another_handle_arrives_there() -> None:
    virtual = made()
    heard: list[str] = []
    first = await Driver.open(virtual.loopback(), timeout=1.0)
    first.on_message = heard.append
    await first.subscribe()
    second = virtual.loopback()
    second.write(b'MG {EA}"hello"\r')
    assert await second.read() == b":"
    assert await first.send("WH") == "IHA"
    assert heard == ["hello"]
    await first.close()
    await virtual.close()


async def test_the_tap_sees_both_directions() -> None:
    virtual = made()
    seen: list[tuple[str, str, bytes]] = []
    virtual.tap = lambda *what: seen.append(what)
    host = virtual.loopback()
    host.write(b"WH\r")
    await host.read()
    assert seen == [("A", "rx", b"WH\r"), ("A", "tx", b"IHA\r\n:")]
    await virtual.close()


async def test_emergency_stop_and_amplifier_fault_from_outside() -> None:
    virtual = made()
    driver = await Driver.open(virtual.loopback(), timeout=1.0)
    await driver.batch(["SH", "OE*=1", "JGA=25000", "BGA"])
    await elapse(1.0)
    virtual.abort_input(True)
    assert await driver.value("_SCA") == 6.0
    virtual.abort_input(False)
    await driver.batch(["SH", "BGA"])
    virtual.amplifier_fault(1 << 24)
    assert await driver.value("_SCA") == 15.0
    await driver.close()
    await virtual.close()


async def _ask(host: str, port: int, pieces: list[bytes], end: bytes) -> tuple[bytes, tuple[str, int]]:
    reader, writer = await asyncio.open_connection(host, port)
    for piece in pieces:
        writer.write(piece)
        await writer.drain()
    reply = await reader.readuntil(end)
    name = writer.get_extra_info("sockname")
    writer.close()
    await writer.wait_closed()
    return reply, (name[0], name[1])


def test_tcp_in_pieces_and_in_one() -> None:
    async def main() -> None:
        virtual = made()
        host, port = await virtual.serve()
        line = b"x=5;MG x;QZ\r\n"
        expected = b": 5.0000\r\n: 3, 52, 26, 36\r\n:"
        for pieces in ([line], [bytes([byte]) for byte in line]):
            assert (await _ask(host, port, pieces, b"36\r\n:"))[0] == expected
        await virtual.close()

    run(main())


def test_tcp_handles_are_listed_by_name_and_freed() -> None:
    async def main() -> None:
        virtual = made()
        host, port = await virtual.serve()
        reply, own = await _ask(host, port, [b"TH\r"], b"IHH AVAILABLE\r\n:")
        assert f"IHA TCP PORT {port} TO IP ADDRESS 127,0,0,1 PORT {own[1]}" in reply.decode()
        reader, writer = await asyncio.open_connection(host, port)
        writer.write(b"WH\r")
        assert (await reader.readuntil(b":"))[:2] == b"IH"
        virtual.cut()
        with suppress(ConnectionResetError):  # the end may come with a reset or without
            assert await reader.read() == b""
        writer.close()
        await virtual.close()

    run(main())


async def _say_until_nobody_listens(host: socket.socket, line: bytes, most: int) -> int:
    """Send a line again and again, until no more is taken for long; return how many bytes went."""
    sent = refused = 0
    while sent < most and refused < 2_000:
        try:
            sent += host.send(line[sent % len(line) :] + line * 800)
            refused = 0
        except BlockingIOError:
            refused += 1
            await turn()
    return sent


def test_client_that_does_not_read_is_not_read_and_loses_nothing() -> None:
    line, most = b'MG "' + 70 * b"x" + b'"\r', 32_000_000

    async def main() -> None:
        virtual = made()
        host, port = await virtual.serve()
        with socket.socket() as silent:
            silent.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            silent.connect((host, port))
            silent.setblocking(False)
            sent = await _say_until_nobody_listens(silent, line, most)
            assert sent < most
            assert (await _ask(host, port, [b"MG 7\r"], b":"))[0] == b" 7.0000\r\n:"
            loop, answers = asyncio.get_running_loop(), 0
            async with asyncio.timeout(30.0):
                while answers < sent // len(line):
                    answers += (await loop.sock_recv(silent, 65536)).count(b":")
        await virtual.close()

    run(main())


def test_client_that_does_not_read_program_messages_is_dropped() -> None:
    async def main() -> None:
        virtual = made()
        host, port = await virtual.serve()
        with socket.socket() as silent:
            silent.connect((host, port))
            await _ask(host, port, [b"WH\r"], b":")
            outlet, owner = virtual.machine.unit.outlet, virtual.machine.unit.handles.at("A")
            assert owner is not None
            for _ in range(400):
                outlet.put(owner, 65536 * b"x")
                virtual.look()
                await turn()
            assert virtual.connections == ""
            assert virtual.machine.unit.handles.last_lost == 0
        await virtual.close()

    run(main())


def test_taken_port_is_reported_in_use() -> None:
    async def main() -> None:
        with socket.create_server(("127.0.0.1", 0)) as taken, pytest.raises(AddressInUse):
            await made().serve("127.0.0.1", taken.getsockname()[1])

    run(main())


async def test_records_go_out_within_ten_milliseconds_and_never_drift() -> None:
    virtual = made()
    host = virtual.loopback_datagrams()
    late: list[float] = []
    loop = asyncio.get_running_loop()

    def note(_: str, direction: str, data: bytes) -> None:
        if direction == "tx" and len(data) == 190:
            late.append(loop.time() % 64.0 - decode(data).sample / 1024.0)

    virtual.tap = note
    host.write(b"DR 8,0\r")
    await elapse(0.0)
    asker = virtual.loopback()
    for _ in range(60):
        await elapse(1.0)
        asker.write(b"TP\r")
    assert len(late) == 60 * 128
    assert min(late) > -1e-9
    assert max(late) <= 0.010
    assert max(late[-128:]) <= TICK
    await host.close()
    await virtual.close()
