"""Serial ports: the greeting, the transport, and the stop, against the twin on a pseudo terminal."""

from __future__ import annotations

import asyncio
import errno
import os
import threading
import tty
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.address import SerialAddress
from dmc41x3.driver import Driver
from dmc41x3.errors import ConnectFailed, LinkLost, LinkTimeout, MachineError, SerialPortUnavailable
from dmc41x3.language.hardware import LETTERS
from dmc41x3.wire import emergency
from dmc41x3.wire.serial_port import BlockingPort, Greeting, unavailable
from dmc41x3.wire.transport import SerialTransport, connect
from tests.served_twin import ServedTwin, served


@contextmanager
def plugged() -> Iterator[tuple[ServedTwin, SerialAddress]]:
    with served() as twin:
        yield twin, SerialAddress(twin.do(lambda controller: controller.serve_serial()))


def write_raw(place: SerialAddress, data: bytes) -> None:
    """Write bytes as a program that ends in the middle of something."""
    port = BlockingPort(place, 5.0)
    port.sendall(data)
    port.close()


def talk(place: SerialAddress, *commands: str) -> list[str]:
    async def run() -> list[str]:
        driver = await Driver.open(await connect(place, 5.0), timeout=5.0)
        try:
            return [await driver.send(command) for command in commands]
        finally:
            await driver.close()

    return asyncio.run(run())


def test_driver_over_a_serial_port() -> None:
    with plugged() as (twin, place):
        assert twin.look(lambda machine: machine.unit.echo) == 1
        assert talk(place, "WH", "MG _WH", "SH", "PRA=100", "BGA") == ["USB", "-1.0000", "", "", ""]
        assert twin.look(lambda machine: (machine.unit.echo, machine.unit.outlet.mark)) == (0, 1)
        assert twin.look(lambda machine: machine.unit.handles.free) == len(LETTERS)


@pytest.mark.parametrize("left", [b"BG", b"v=1;BG", b'MG "', b"'", b"DL\r#A\rEN\r", b"x" * 200])
def test_unfinished_line_of_another_program_is_not_executed(left: bytes) -> None:
    with plugged() as (twin, place):
        talk(place, "SH", "JG 1000,1000,1000")
        write_raw(place, left)
        assert talk(place, "MG 5", "TC1") == ["5.0000", "0"]
        assert not twin.look(lambda machine: any(axis.moving for axis in machine.unit.axes))


def test_program_that_talks_does_not_disturb_the_greeting() -> None:
    with plugged() as (_, place):
        for _ in range(3):
            talk(place, "HX", "CF S", "CW 2")
            write_raw(place, b'DL\r#A\rMG "talk",TIME\rJP #A\r\\\rXQ #A\r')
            assert talk(place, "MG 5") == ["5.0000"]


def test_messages_come_marked_by_the_serial_port() -> None:
    async def run(place: SerialAddress) -> str:
        driver = await Driver.open(await connect(place, 5.0), timeout=5.0)
        message: asyncio.Future[str] = asyncio.get_running_loop().create_future()
        driver.on_message = message.set_result
        try:
            await driver.download('#A\nMG "hello"\nEN\n')
            await driver.subscribe()
            await driver.send("XQ #A")
            async with asyncio.timeout(5.0):
                return await message
        finally:
            await driver.close()

    with plugged() as (_, place):
        assert asyncio.run(run(place)) == "hello"


def test_reset_of_the_controller_is_found_by_its_echo() -> None:
    async def run(twin: ServedTwin, place: SerialAddress) -> None:
        driver = await Driver.open(await connect(place, 5.0), timeout=5.0)
        try:
            await asyncio.to_thread(twin.do, lambda controller: controller.reset())
            with pytest.raises(MachineError):
                await driver.record()
            assert driver.lost.done()
        finally:
            await driver.close()
        assert len(await asyncio.to_thread(talk, place, "MG 5")) == 1

    with plugged() as (twin, place):
        asyncio.run(run(twin, place))


def test_unplugged_port_is_a_lost_link() -> None:
    async def run(twin: ServedTwin, place: SerialAddress) -> None:
        driver = await Driver.open(await connect(place, 5.0), timeout=5.0)
        try:
            assert await driver.send("MG 1") == "1.0000"
            await asyncio.to_thread(twin.do, lambda controller: controller.unplug())
            assert isinstance(await driver.lost, LinkLost)
            with pytest.raises(LinkLost):
                await driver.send("MG 1")
        finally:
            await driver.close()
        with pytest.raises(SerialPortUnavailable, match="no such device"):
            await connect(place, 5.0)

    with plugged() as (twin, place):
        asyncio.run(run(twin, place))


def test_port_of_another_program_is_busy() -> None:
    async def run(place: SerialAddress) -> None:
        first = await SerialTransport.connect(place, 5.0)
        with pytest.raises(SerialPortUnavailable, match="another program uses it"):
            await SerialTransport.connect(place, 5.0)
        await first.close()
        await (await SerialTransport.connect(place, 5.0)).close()

    with plugged() as (_, place):
        asyncio.run(run(place))


@pytest.mark.parametrize(
    ("path", "reason"), [("/dev/no-such-port", "no such device"), ("/dev/null", "it is no serial port")]
)
def test_missing_port_says_what_is_wrong(path: str, reason: str) -> None:
    with pytest.raises(SerialPortUnavailable, match=reason):
        asyncio.run(connect(SerialAddress(path), 1.0))


def test_forbidden_port_names_the_group(tmp_path: os.PathLike[str]) -> None:
    error = unavailable(SerialAddress(str(tmp_path)), errno.EACCES)
    assert "usermod -aG" in str(error)
    assert "dialout" in str(unavailable(SerialAddress("/no-such-file"), errno.EPERM))


def test_port_without_a_controller_is_given_up() -> None:
    master, slave = os.openpty()
    tty.setraw(slave)
    try:
        with pytest.raises(ConnectFailed, match="at 19200 baud"):
            asyncio.run(connect(SerialAddress(os.ttyname(slave), 19200), 0.05))
    finally:
        os.close(slave)
        os.close(master)


@given(st.lists(st.integers(1, 40)), st.booleans())
def test_greeting_ends_at_its_answer_however_it_is_cut(cuts: list[int], echo: bool) -> None:
    greeting = Greeting("ST S")
    number = int(greeting.data.rpartition(b"+")[0].rpartition(b" ")[2]) + 1
    echoed = greeting.data.replace(b"\r", b"\r\n") if echo else b""
    stream = b"old 5\r\n:" + echoed + b"?:::" + b" %d" % number + bytes(byte | 0x80 for byte in b"hi\r\n") + b"\r\n:"
    for cut in cuts:
        piece, stream = stream[:cut], stream[cut:]
        if stream:
            assert not greeting.feed(piece)
        else:
            stream = piece
    assert greeting.feed(stream)


@pytest.mark.parametrize("held", [False, True])
def test_stop_by_a_serial_port(held: bool) -> None:
    """Also while another program has locked the port and takes answers that are not its own."""

    def moving(twin: ServedTwin) -> str:
        return twin.look(lambda machine: "".join(axis.letter for axis in machine.unit.axes if axis.moving))

    with plugged() as (twin, place):
        talk(place, "SH", "JG 1000,1000", "DC 1024,1024", "BG AB")
        assert moving(twin) == "AB"
        over = threading.Event()
        thief = threading.Thread(target=steal, args=(place, over))
        if held:
            thief.start()
        try:
            assert emergency.stop(place, 8.0).decelerating == "AB"
        finally:
            over.set()
            if held:
                thief.join()
        assert twin.look(lambda machine: [machine.unit.core.stop_code(axis) for axis in machine.unit.axes[:2]]) == [
            4,
            4,
        ]


def steal(place: SerialAddress, over: threading.Event) -> None:
    """Read what arrives, until the first bytes that were not asked for, as a driver does."""
    port = BlockingPort(place, 0.01)
    try:
        while not over.is_set():
            try:
                port.recv(5)
                return
            except TimeoutError:
                continue
    finally:
        port.close()


def test_stop_without_an_answer_is_an_error() -> None:
    master, slave = os.openpty()
    tty.setraw(slave)
    try:
        with pytest.raises(LinkTimeout):
            emergency.stop(SerialAddress(os.ttyname(slave)), 0.1)
        assert os.read(master, 4096).count(b"ST S\r") == 3
    finally:
        os.close(slave)
        os.close(master)
