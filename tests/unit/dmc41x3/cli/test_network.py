"""`dmc find`, `dmc ip` and `dmc assign`: networks, questions, answers, and who may be changed."""

from __future__ import annotations

import asyncio
import io
import os
import socket
import struct
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from ipaddress import IPv4Address, IPv4Interface
from pathlib import Path

import pytest
from serial.tools.list_ports_common import ListPortInfo

from dmc41x3.address import parse
from dmc41x3.cli import assign as assigning
from dmc41x3.cli import network
from dmc41x3.cli.console import OutputSettings, complain
from dmc41x3.cli.main import main
from dmc41x3.errors import AddressInUse, AddressTaken, InvalidValue, NoAddressRequest, OtherDhcpServer, PortForbidden
from dmc41x3.twin.wire.server import VirtualController
from dmc41x3.wire.bootp import AddressReply, AddressRequest, DhcpKind, parse_reply, request
from tests.ports import free_port
from tests.served_twin import served
from tests.waiting import eventually

MAC = "00:50:4c:08:01:1f"
END_OF_INPUT = b"\x04"
"""Ctrl-D."""
ADDRESS, MASK = IPv4Address("127.0.0.9"), IPv4Address("255.0.0.0")


@contextmanager
def listener(answer: bytes) -> Iterator[tuple[int, list[bytes]]]:
    """Serve one connection that gives the same answer to anything."""
    heard: list[bytes] = []

    def serve(server: socket.socket) -> None:
        connection, _ = server.accept()
        with connection:
            heard.append(connection.recv(1000))
            connection.sendall(answer)

    with socket.create_server(("127.0.0.1", 0)) as server:
        thread = threading.Thread(target=serve, args=(server,))
        thread.start()
        yield server.getsockname()[1], heard
        thread.join()


@pytest.mark.parametrize(
    ("answer", "firmware"),
    [
        (b" DMC4133 Rev 1.3k\r\n:", "DMC4133 Rev 1.3k"),
        (b"\xff\xfd\x18DMC4183 Rev 1.3h\r\n:", "DMC4183 Rev 1.3h"),
        (b"login: ", None),
        (b"DMC4133 Rev \x1b[2Jhello\r\n:", None),
        (b"DMC4133 Rev 1.3\xff\r\n:", None),
        (b"x" * 2000, None),
    ],
)
def test_only_a_galil_controller_is_found_and_only_asked_its_firmware(answer: bytes, firmware: str | None) -> None:
    with listener(answer) as (port, heard):
        assert asyncio.run(network.identified("127.0.0.1", port)) == firmware
    assert heard == [b"\x12\x16\r"]


def test_serial_port_is_asked_without_a_change() -> None:
    with served() as twin:
        path = twin.do(lambda controller: controller.serve_serial())
        assert network.firmware_at(path) == "DMC4133 Rev 1.3k"
        assert twin.look(lambda machine: (machine.unit.echo, machine.unit.outlet.mark)) == (1, 2)
        twin.do(lambda controller: controller.unplug())
        assert network.firmware_at(path) is None


def test_host_without_a_listener_is_no_controller() -> None:
    assert asyncio.run(network.identified("127.0.0.1", free_port())) is None


@pytest.mark.parametrize(
    ("interface", "hosts"),
    [("192.168.1.7/24", 254), ("10.1.2.3/22", 1022), ("10.1.2.3/8", 254), ("10.1.2.3/32", 1), ("10.0.0.1/31", 2)],
)
def test_network_of_this_computer_is_bounded(interface: str, hosts: int) -> None:
    found = IPv4Interface(interface)
    near = network.near(found)
    assert found.ip in near
    assert len(list(near.hosts())) == hosts


def test_interfaces_are_read_from_the_system() -> None:
    assert all(not found.is_loopback for found in network.interfaces())


@pytest.mark.parametrize("text", ["10.0.0.0/21", "ten", "10.0.0.0/99"])
def test_network_that_is_not_searched_is_refused(text: str) -> None:
    with pytest.raises(InvalidValue):
        network.find([text], 23, False, OutputSettings())


@pytest.mark.parametrize(
    ("line", "code"),
    [
        (["--set", "nowhere", "--yes"], 4001),
        (["--set", "0.0.0.0", "--yes"], 4001),
        (["--set", "0.1.2.3", "--yes"], 4001),
        (["--set", "224.0.0.1", "--yes"], 4001),
        (["--set", "240.0.0.1", "--yes"], 4001),
        (["--set", "255.255.255.255", "--yes"], 4001),
        (["--set", "192.168.1.0", "--mask", "255.255.255.0", "--yes"], 4001),
        (["--set", "192.168.1.255", "--mask", "255.255.255.0", "--yes"], 4001),
        (["--mask", "255.255.255.255", "--yes"], 4001),
        (["--mask", "1.2.3.4", "--burn", "--yes"], 4001),
        (["--mask", "0.0.0.255", "--yes"], 4001),
        (["--mask", "300.0.0.0", "--yes"], 4001),
        (["--set", "127.0.0.2", "--dhcp", "--yes"], 4008),
        (["--burn"], 4008),
    ],
)
def test_wrong_change_is_refused_and_changes_nothing(
    line: list[str], code: int, capsys: pytest.CaptureFixture[str]
) -> None:
    with served() as twin:
        before = twin.look(lambda machine: machine.unit.network)
        assert main(["ip", twin.address, *line]) == 2
        assert f"error {code}" in capsys.readouterr().err
        assert twin.look(lambda machine: machine.unit.network) == before


def test_present_mask_decides_whether_a_device_can_have_an_address(capsys: pytest.CaptureFixture[str]) -> None:
    with served() as twin:
        assert main(["ip", twin.address, "--mask", "255.255.255.0", "--yes"]) == 0
        assert main(["ip", twin.address, "--set", "10.51.0.255", "--yes"]) == 2
        assert "all devices of the network 10.51.0.0/24" in capsys.readouterr().err
        assert twin.look(lambda machine: machine.unit.network.address) == (10, 51, 0, 87)


def test_loopback_address_is_refused_to_a_controller_that_is_not_reached_by_it(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with served() as twin:
        path = twin.do(lambda controller: controller.serve_serial())
        assert main(["ip", path, "--set", "127.0.0.3", "--yes"]) == 2
        assert "error 4001" in capsys.readouterr().err
        assert twin.look(lambda machine: machine.unit.network.address) == (10, 51, 0, 87)


def test_nothing_is_changed_if_another_controller_answers() -> None:
    with served() as twin:
        change = network.IpChange(dhcp=False, burn=True, yes=True)
        with pytest.raises(AddressTaken, match=r"00:50:4c:08:01:1f.*not 00:50:4c:00:00:01") as refused:
            asyncio.run(network.change_settings(parse(twin.address), change, OutputSettings(), "00:50:4c:00:00:01"))
        assert refused.value.address == twin.address
        assert not {"BN", "DH 0"} & {command for command, _ in twin.said}


def test_nothing_is_burned_if_another_controller_has_the_new_address(capsys: pytest.CaptureFixture[str]) -> None:
    with served() as moving, served() as other:
        other.do(lambda controller: identify_as(controller, hardware_address="00-50-4C-00-00-01"))
        there = other.do(lambda controller: asyncio.ensure_future(controller.serve("127.0.0.4", moving.port)))
        eventually(there.done, "a twin that listens")
        assert main(["ip", moving.address, "--set", "127.0.0.4", "--burn", "--yes"]) == 1
        assert "error 1016" in capsys.readouterr().err
        assert "BN" not in {command for command, _ in (*moving.said, *other.said)}


def identify_as(controller: VirtualController, **identity: str) -> None:
    unit = controller.machine.unit
    unit.identity = unit.identity._replace(**identity)


def test_speed_of_a_serial_port_is_refused_by_the_speeds_that_exist(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["send", "/dev/ttyUSB0@12345", "TP"]) == 2
    assert "is not valid: the speed after @ must be" in capsys.readouterr().err


def test_missing_com_port_is_reported_with_its_path(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("DMC_COM250", str(tmp_path / "port"))
    assert main(["send", "COM250", "TP"]) == 1
    said = capsys.readouterr().err
    assert f"The serial port {tmp_path / 'port'} cannot be opened" in said
    assert "COM250 means this port" in said
    assert "$DMC_COM250" in said


def test_port_without_a_description_has_no_name(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("serial.tools.list_ports.comports", lambda: [ListPortInfo("/dev/ttyS0")])
    assert main(["find", "127.0.0.0/30", "--port", str(free_port())]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "/dev/ttyS0  no name"


CLEAR = "\x1b[2J"
"""Control characters that clear a terminal."""


def test_control_characters_of_a_controller_are_not_printed(capsys: pytest.CaptureFixture[str]) -> None:
    with served() as twin:
        twin.do(lambda controller: identify_as(controller, firmware=f"DMC4133 Rev {CLEAR}"))
        assert main(["ip", twin.address]) == 1
    shown = capsys.readouterr()
    assert "error 1006" in shown.err
    assert CLEAR not in shown.out + shown.err


def test_control_characters_in_an_error_are_shown_as_codes(capsys: pytest.CaptureFixture[str]) -> None:
    complain(InvalidValue(key="x", value=f"a{CLEAR}", reason="it is\r\x9bbad"), OutputSettings())
    assert r"x = a\x1b[2J is not valid: it is\x0d\x9bbad." in capsys.readouterr().err


@contextmanager
def server() -> Iterator[tuple[socket.socket, socket.socket]]:
    """Give the socket of a server and one of a controller that is connected to it."""
    with assigning.opened(free_port()) as waiting, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
        asking.settimeout(5.0)
        asking.connect(("127.0.0.1", waiting.getsockname()[1]))
        yield waiting, asking


def answers(asking: socket.socket, count: int) -> list[AddressReply | None]:
    return [parse_reply(asking.recv(2048)) for _ in range(count)]


@pytest.mark.parametrize("dhcp", [False, True])
def test_named_controller_gets_its_address(dhcp: bool) -> None:
    with server() as (waiting, asking):
        here = IPv4Address("127.0.0.1")
        asking.send(b"no packet")
        asking.send(request(AddressRequest("00:50:4c:00:00:01", 5)))
        if dhcp:
            asking.send(request(AddressRequest(MAC, 5, DhcpKind.DISCOVER)))
            asking.send(request(AddressRequest(MAC, 6, DhcpKind.REQUEST, here, IPv4Address("127.0.0.3"))))
        last = AddressRequest(MAC, 6, DhcpKind.REQUEST, here, ADDRESS) if dhcp else AddressRequest(MAC, 6)
        asking.send(request(last))
        assigning.serve(waiting, MAC, ADDRESS, MASK, 5.0)
        kinds = ((5, DhcpKind.OFFER), (6, DhcpKind.ACK)) if dhcp else ((6, DhcpKind.NONE),)
        expected = [AddressReply(MAC, number, ADDRESS, here, MASK, kind) for number, kind in kinds]
        assert answers(asking, len(expected)) == expected
        asking.setblocking(False)
        with pytest.raises(BlockingIOError):
            asking.recv(2048)


def datagram(source_port: int, port: int, data: bytes) -> bytes:
    """Return a UDP header with data; it may have the source port 0, which no socket of the system sends."""
    return struct.pack("!HHHH", source_port, port, 8 + len(data), 0) + data


@pytest.mark.skipif(os.geteuid() != 0, reason="only root may send a datagram with the source port 0")
def test_request_that_cannot_be_answered_ends_nothing(caplog: pytest.LogCaptureFixture) -> None:
    with server() as (waiting, asking), socket.socket(socket.AF_INET, socket.SOCK_RAW, socket.IPPROTO_UDP) as raw:
        port = waiting.getsockname()[1]
        asked = request(AddressRequest(MAC, 5))
        raw.sendto(datagram(0, port, asked), ("127.0.0.1", 0))
        asking.send(request(AddressRequest(MAC, 6)))
        assigning.serve(waiting, MAC, ADDRESS, MASK, 5.0)
        assert answers(asking, 1) == [AddressReply(MAC, 6, ADDRESS, IPv4Address("127.0.0.1"), MASK, DhcpKind.NONE)]
    assert "127.0.0.1:0" in caplog.text


def test_answer_of_another_server_is_left_alone() -> None:
    with server() as (waiting, asking):
        asking.send(request(AddressRequest(MAC, 5, DhcpKind.REQUEST, IPv4Address("10.0.0.1"), ADDRESS)))
        with pytest.raises(OtherDhcpServer, match=r"10\.0\.0\.1"):
            assigning.serve(waiting, MAC, ADDRESS, MASK, 5.0)
        asking.setblocking(False)
        with pytest.raises(BlockingIOError):
            asking.recv(2048)


def test_controller_in_a_real_network_gets_no_loopback_address() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking, socket.socket(type=socket.SOCK_DGRAM) as waiting:
        waiting.bind(("127.0.0.1", 0))  # without the interface of a request it counts as one from a real network
        asking.connect(waiting.getsockname())
        asking.send(request(AddressRequest(MAC, 5)))
        with pytest.raises(InvalidValue, match="only a twin"):
            assigning.serve(waiting, MAC, ADDRESS, MASK, 5.0)
        asking.setblocking(False)
        with pytest.raises(BlockingIOError):
            asking.recv(2048)


def test_controller_that_does_not_ask_is_reported() -> None:
    with server() as (waiting, _), pytest.raises(NoAddressRequest, match=r"within 0\.01 s"):
        assigning.serve(waiting, MAC, ADDRESS, MASK, 0.01)


def test_port_of_another_server_is_refused() -> None:
    with server() as (waiting, _), pytest.raises(AddressInUse):
        assigning.opened(waiting.getsockname()[1])


def test_port_for_root_is_refused_to_others(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(socket.socket, "bind", refused)
    with pytest.raises(PortForbidden, match="port 67"):
        assigning.opened(67)


@pytest.mark.parametrize(
    "line",
    [
        ["xx", "10.0.0.1"],
        [MAC, "ten"],
        [MAC, "0.0.0.0"],
        [MAC, "224.0.0.1"],
        [MAC, "255.255.255.255"],
        [MAC, "10.0.0.1", "--mask", "x"],
        [MAC, "10.0.0.1", "--mask", "1.2.3.4"],
        [MAC, "10.0.0.255", "--mask", "255.255.255.0"],
        *([MAC, "10.0.0.1", "--for", seconds] for seconds in ("0", "-1", "nan", "inf", "1e10", "1e300")),
    ],
)
def test_wrong_assignment_is_refused(line: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["assign", *line, "--port", str(free_port())]) == 2
    assert "error 4001" in capsys.readouterr().err


def test_hardware_address_alone_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["assign", MAC, "--port", str(free_port())]) == 2
    assert f"ADDRESS is missing: write `dmc assign {MAC} 192.168.1.20`" in capsys.readouterr().err


@contextmanager
def typing(data: bytes, *names: str) -> Iterator[None]:
    """Let a terminal stand for these standard streams; a person has typed `data`."""
    ours, theirs = os.openpty()
    os.write(ours, data)
    with os.fdopen(theirs, "r+b", buffering=0) as terminal, pytest.MonkeyPatch.context() as patch:
        for name in names:
            patch.setattr(sys, name, io.TextIOWrapper(io.FileIO(terminal.fileno(), "r+", closefd=False)))
        yield
    os.close(ours)


def test_end_of_input_at_the_question_of_a_change_changes_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    with served() as twin:
        with typing(END_OF_INPUT, "stdin", "stdout"):
            assert main(["ip", twin.address, "--no-dhcp", "--burn"]) == 2
        assert "nothing was changed" in capsys.readouterr().err
        assert not {"BN", "DH 0"} & {command for command, _ in twin.said}


@pytest.mark.parametrize("typed", [END_OF_INPUT, b"\n"])
def test_person_who_chooses_no_address_ends_the_command(typed: bytes, capsys: pytest.CaptureFixture[str]) -> None:
    port = free_port()
    with asking_at(port), typing(typed, "stdin"):
        assert main(["assign", "--port", str(port), "--for", "10"]) == 0
    said = capsys.readouterr().out
    assert f"1  {MAC}" in said
    assert "`dmc assign MAC ADDRESS`" in said


@contextmanager
def asking_at(port: int) -> Iterator[None]:
    """Ask for an address, as a controller does, again and again while the block runs."""
    over = threading.Event()

    def ask() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
            while not over.wait(0.05):
                asking.sendto(request(AddressRequest(MAC, 5)), ("127.0.0.1", port))

    thread = threading.Thread(target=ask)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
