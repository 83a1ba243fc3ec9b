"""The transports. TCP and UDP run in the ordinary loop: real sockets do not belong in virtual time."""

from __future__ import annotations

import asyncio
import socket
import struct

import pytest

from dmc41x3.driver import Driver
from dmc41x3.errors import ConnectFailed, LinkLost
from dmc41x3.wire.transport import TcpTransport, UdpTransport, datagram_pair, loopback_pair
from tests.virtual_time import elapse


async def test_loopback_carries_both_directions() -> None:
    host, controller = loopback_pair("twin")
    host.write(b"TP\r")
    controller.write(b":")
    assert (await controller.read(), await host.read(), host.peer) == (b"TP\r", b":", "twin")


async def test_loopback_wakes_its_reader() -> None:
    host, controller = loopback_pair()
    reading = asyncio.create_task(host.read())
    await elapse(0.1)
    controller.write(b"a")
    controller.write(b"b")
    assert await reading == b"ab"


async def test_closed_loopback_delivers_bytes_on_their_way() -> None:
    host, controller = loopback_pair()
    host.write(b"BN\r")
    await host.close()
    await host.close()
    assert (await controller.read(), await controller.read(), await host.read()) == (b"BN\r", b"", b"")


async def test_cut_loopback_loses_bytes_on_their_way() -> None:
    host, controller = loopback_pair()
    host.write(b"BN\r")
    reading = asyncio.create_task(host.read())
    await elapse(0.1)
    host.cut()
    assert (await controller.read(), await reading) == (b"", b"")


async def test_loopback_refuses_to_write_after_its_end() -> None:
    host, controller = loopback_pair()
    controller.cut()
    host.write(b"nobody sees the end but by reading")
    host.cut()
    with pytest.raises(LinkLost):
        host.write(b"x")


def test_tcp_carries_a_conversation_until_the_end() -> None:
    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while (await reader.read(100)) == b"TP\r":
            writer.write(b" 1, 2, 3\r\n:")
        writer.close()
        await writer.wait_closed()

    async def main() -> None:
        async with await asyncio.start_server(serve, "127.0.0.1") as server:
            port = server.sockets[0].getsockname()[1]
            transport = await TcpTransport.connect("127.0.0.1", port, timeout=5.0)
            assert transport.peer == f"127.0.0.1:{port}"
            driver = await Driver.open(transport, timeout=5.0)
            assert [await driver.send("TP") for _ in range(3)] == ["1, 2, 3"] * 3
            with pytest.raises(LinkLost):
                await driver.send("end")
            await driver.close()
            with pytest.raises(LinkLost):
                transport.write(b"x")

    asyncio.run(main())


def test_tcp_sends_small_pieces_at_once() -> None:
    async def main() -> None:
        async with await asyncio.start_server(lambda _, writer: writer.close(), "127.0.0.1") as server:
            transport = await TcpTransport.connect(*server.sockets[0].getsockname(), timeout=5.0)
            sock: socket.socket = transport._stream.get_extra_info("socket")
            assert sock.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
            assert await transport.read() == b""
            await transport.close()
            await transport.close()

    asyncio.run(main())


def test_tcp_broken_off_is_a_lost_link() -> None:
    def reset(writer: asyncio.StreamWriter) -> None:
        sock: socket.socket = writer.get_extra_info("socket")
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        writer.transport.abort()

    async def main() -> None:
        async with await asyncio.start_server(lambda _, writer: reset(writer), "127.0.0.1") as server:
            transport = await TcpTransport.connect(*server.sockets[0].getsockname(), timeout=5.0)
            with pytest.raises(LinkLost, match="reset"):
                await transport.read()
            await transport.close()

    asyncio.run(main())


def test_tcp_error_names_the_cause() -> None:
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        port: int = unused.getsockname()[1]
        with pytest.raises(ConnectFailed, match=rf"127\.0\.0\.1:{port} \(Connection refused\)"):
            asyncio.run(TcpTransport.connect("127.0.0.1", port, timeout=5.0))


@pytest.mark.parametrize(("host", "port"), [("127.0.0.1", 70000), ("a" * 70, 23)])
def test_tcp_takes_an_impossible_address_for_a_failed_connection(host: str, port: int) -> None:
    with pytest.raises(ConnectFailed):
        asyncio.run(TcpTransport.connect(host, port, timeout=5.0))


def test_tcp_gives_up_in_time() -> None:
    with socket.socket() as full:
        full.bind(("127.0.0.1", 0))
        full.listen(0)
        address = full.getsockname()
        with socket.create_connection(address), pytest.raises(ConnectFailed, match="no answer within"):

            async def fill() -> None:
                for _ in range(4):
                    await TcpTransport.connect(*address, timeout=0.05)

            asyncio.run(fill())


async def test_datagrams_in_memory_keep_their_bounds() -> None:
    host, controller = datagram_pair("twin")
    reading = asyncio.create_task(controller.read())
    await elapse(0.1)
    host.write(b"WH\r")
    host.write(b"TP\r")
    controller.write(b"IHB\r\n:")
    assert (await reading, await controller.read(), await host.read()) == (b"WH\r", b"TP\r", b"IHB\r\n:")
    assert host.peer == "twin"


async def test_datagrams_into_a_blocked_way_are_lost() -> None:
    host, controller = datagram_pair()
    host.blocked = True
    host.write(b"lost")
    host.blocked = False
    host.write(b"here")
    assert await controller.read() == b"here"


async def test_datagrams_end_on_one_side_only() -> None:
    host, controller = datagram_pair()
    controller.write(b"last")
    await host.close()
    await host.close()
    controller.write(b"too late")
    assert (await host.read(), await host.read()) == (b"last", b"")


async def test_datagrams_are_delivered_on_arrival() -> None:
    host, controller = datagram_pair()
    came: list[bytes] = []
    host.deliver(came.append)
    controller.write(b"one")
    controller.write(b"two")
    assert came == [b"one", b"two"]
    await host.close()
    assert await host.read() == b""


async def test_unread_datagrams_keep_the_newest() -> None:
    host, controller = datagram_pair()
    for number in range(300):
        controller.write(b"%d" % number)
    assert await host.read() == b"44"


def test_udp_carries_both_directions() -> None:
    async def main() -> None:
        with socket.socket(type=socket.SOCK_DGRAM) as box:
            box.bind(("127.0.0.1", 0))
            host, port = box.getsockname()
            transport = await UdpTransport.connect(host, port)
            assert transport.peer == f"{host}:{port}"
            transport.write(b"WH\r")
            data, sender = await asyncio.to_thread(box.recvfrom, 100)
            box.sendto(b"IHB\r\n:", sender)
            assert (data, await transport.read()) == (b"WH\r", b"IHB\r\n:")
            await transport.close()
            transport.write(b"too late")
            assert await transport.read() == b""

    asyncio.run(main())


def test_udp_to_a_closed_port_is_found_out() -> None:
    async def main() -> None:
        with socket.socket(type=socket.SOCK_DGRAM) as unused:
            unused.bind(("127.0.0.1", 0))
            host, port = unused.getsockname()
        transport = await UdpTransport.connect(host, port)
        transport.write(b"WH\r")
        with pytest.raises(LinkLost, match="refused"):
            await transport.read()
        await transport.close()

    asyncio.run(main())


def test_udp_takes_an_impossible_address_for_a_failed_connection() -> None:
    with pytest.raises(ConnectFailed):
        asyncio.run(UdpTransport.connect("a" * 70, 23))
