"""The main serial port of the twin, and its address on the network."""

from __future__ import annotations

import asyncio
import os
import select
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from ipaddress import IPv4Address
from typing import cast

import pytest

from dmc41x3.driver import Driver
from dmc41x3.errors import MachineError
from dmc41x3.twin.wire.connections import ask_for_address
from dmc41x3.twin.wire.server import VirtualController, bench
from dmc41x3.wire.bootp import answer, parse_request
from dmc41x3.wire.transport import TcpTransport
from tests.served_twin import ServedTwin, served


class Cable:
    """A serial port as any program opens it."""

    def __init__(self, path: str) -> None:
        self._file = os.open(path, os.O_RDWR | os.O_NOCTTY)

    def say(self, text: str, answered: str) -> None:
        """Send a line and take exactly the answer."""
        os.write(self._file, text.encode())
        self.hear(answered)

    def hear(self, expected: str) -> None:
        """Take exactly that text."""
        heard = b""
        while len(heard) < len(expected) and select.select([self._file], [], [], 5.0)[0]:
            heard += os.read(self._file, 4096)
        assert heard.decode("latin-1") == expected

    def close(self) -> None:
        """Close the port."""
        os.close(self._file)


@contextmanager
def plugged() -> Iterator[tuple[ServedTwin, Cable]]:
    with served() as twin:
        cable = Cable(twin.do(lambda controller: controller.serve_serial()))
        try:
            yield twin, cable
        finally:
            cable.close()


def test_echo_follows_eo() -> None:
    with plugged() as (_, cable):
        cable.say("TP\r", "TP\r\n 0, 0, 0\r\n:")
        cable.say("MG 1;MG 2\r", "MG 1; 1.0000\r\n:MG 2\r\n 2.0000\r\n:")
        cable.say("XX\r", "XX\r\n?")
        cable.say("EO 0\rTP\r", "EO 0\r\n: 0, 0, 0\r\n:")
        cable.say("TP\r", " 0, 0, 0\r\n:")
        cable.say("EO 1\rMG 3\r", ":MG 3\r\n 3.0000\r\n:")


def test_messages_go_to_the_serial_port_by_default() -> None:
    with plugged() as (_, cable):
        cable.say("EO 0\r", "EO 0\r\n:")
        cable.say('DL\r#A\rMG "one"\rMG {P1}"two"\rMG {P2}"three"\rEN\r\\XQ #A\r', "::" + ":one\r\ntwo\r\n")
        marked = "".join(chr(ord(letter) | 0x80) for letter in "one\r\ntwo\r\n")
        cable.say("CW 1\rXQ #A\r", "::" + marked)


def test_port_is_none_of_the_eight_handles() -> None:
    with plugged() as (twin, cable):
        cable.say("EO 0\r", "EO 0\r\n:")
        cable.say("WH\r", "USB\r\n:")
        cable.say("MG _WH,_IA2,_IA3\r", "-1.0000 8.0000 -1.0000\r\n:")
        cable.say("IHS=>-3\r", "?")
        cable.say("HSS=A\r", "?")
        cable.say("IHT=>-3\rCF I\rMG _CF\r", ":: 83.0000\r\n:")
        assert twin.do(lambda controller: controller.connections) == "S"
        twin.do(lambda controller: controller.cut())
        cable.say("MG 1\r", " 1.0000\r\n:")


def test_port_echoes_again_after_power_up() -> None:
    with plugged() as (twin, cable):
        cable.say("EO 0\r", "EO 0\r\n:")
        twin.do(lambda controller: controller.power(False))
        twin.do(lambda controller: controller.power(True))
        cable.say("MG 2\r", "MG 2\r\n 2.0000\r\n:")


async def talk(place: tuple[str, int], *commands: str) -> list[str]:
    driver = await Driver.open(await TcpTransport.connect(*place, 5.0), timeout=5.0)
    replies: list[str] = []
    try:
        with suppress(MachineError):
            for command in commands:
                replies.append(await driver.send(command))
        return replies
    finally:
        await driver.close()


async def until(controller: VirtualController, host: str) -> None:
    """Wait until the twin listens at a host."""
    async with asyncio.timeout(10.0):
        while controller.address[0] != host:  # noqa: ASYNC110 - each turn of the loop brings it nearer
            await asyncio.sleep(0)


def test_address_of_the_loopback_is_listened_at() -> None:
    async def run() -> None:
        controller = bench(3)
        try:
            host, port = await controller.serve()
            assert await talk((host, port), "DH 0", "IA 127,0,0,2") == ["", ""]
            await until(controller, "127.0.0.2")
            assert await talk(("127.0.0.2", port), "IA ?") == ["127, 0, 0, 2"]
            with pytest.raises(MachineError):
                await TcpTransport.connect(host, port, 5.0)
            await talk(("127.0.0.2", port), "RS")
            await until(controller, host)
            assert await talk((host, port), "DH 0", "IA 127,0,0,3") == ["", ""]
            await until(controller, "127.0.0.3")
            assert await talk(("127.0.0.3", port), "BN", "RS", "IA ?") == ["", ""]
            assert await talk(("127.0.0.3", port), "IA ?") == ["127, 0, 0, 3"]
            assert await talk(("127.0.0.3", port), "IA 10,0,0,7") == [""]
            await until(controller, host)
            assert await talk((host, port), "IA ?") == ["10, 0, 0, 7"]
        finally:
            await controller.close()

    asyncio.run(run())


@pytest.mark.parametrize("dhcp", [False, True])
def test_controller_asks_until_it_is_answered(dhcp: bool) -> None:
    """The server drops the first request; by DHCP there are two more, by BOOTP one."""
    mac, address = "00:50:4c:08:01:1f", IPv4Address("127.0.0.4")
    heard: list[str] = []

    class Server(asyncio.DatagramProtocol):
        def connection_made(self, transport: asyncio.BaseTransport) -> None:
            self.transport = cast("asyncio.DatagramTransport", transport)

        def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
            asked = parse_request(data)
            assert asked is not None
            heard.append(asked.kind.name)
            if len(heard) > 1:
                server = IPv4Address("127.0.0.1")
                self.transport.sendto(answer(asked._replace(number=asked.number ^ 1), address, server, server), addr)
                self.transport.sendto(answer(asked, address, IPv4Address("255.0.0.0"), server), addr)

    async def run() -> None:
        transport, _ = await asyncio.get_running_loop().create_datagram_endpoint(Server, local_addr=("127.0.0.1", 0))
        try:
            found = await ask_for_address(transport.get_extra_info("sockname"), mac, dhcp=dhcp)
        finally:
            transport.close()
        assert (found.address, str(found.mask)) == (address, "255.0.0.0")

    asyncio.run(run())
    assert heard == (["DISCOVER", "DISCOVER", "REQUEST"] if dhcp else ["NONE", "NONE"])
