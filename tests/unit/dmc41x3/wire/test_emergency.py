"""The stop of last resort, against a scripted controller on a real socket."""

from __future__ import annotations

import socket
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

import pytest

from dmc41x3.address import NetworkAddress
from dmc41x3.errors import ConnectFailed, EndedUnanswered, LinkLost, LinkTimeout, UnexpectedReply
from dmc41x3.language.record import AxisRecord, AxisStatus, DataRecord, encode
from dmc41x3.wire import emergency
from dmc41x3.wire.framing import LineSplitter

MOVING = AxisRecord(status=AxisStatus.MOVING | AxisStatus.POSITION_MODE)
IN_SEQUENCE = AxisRecord(status=AxisStatus.MOVING | AxisStatus.COORDINATED)
AT_REST = AxisRecord()


def record(*axes: AxisRecord) -> bytes:
    return encode(DataRecord(axes=axes)) + b":"


@contextmanager
def controller(answers: Mapping[str, bytes]) -> Iterator[tuple[int, list[str]]]:
    """Serve one connection in a thread; a command without an answer ends it."""
    heard: list[str] = []

    def serve(listener: socket.socket) -> None:
        connection, _ = listener.accept()
        splitter = LineSplitter()
        with connection:
            while data := connection.recv(1000):
                for command in splitter.feed(data):
                    heard.append(command)
                    if command not in answers:
                        return
                    connection.sendall(answers[command])

    with socket.create_server(("127.0.0.1", 0)) as listener:
        thread = threading.Thread(target=serve, args=(listener,))
        thread.start()
        yield listener.getsockname()[1], heard
        thread.join()


@pytest.mark.parametrize(
    ("axes", "outcome", "commands"),
    [
        ((AT_REST, AT_REST, AT_REST), ("", ""), ["ST S", "QR"]),
        ((AT_REST, IN_SEQUENCE, IN_SEQUENCE), ("BC", ""), ["ST S", "QR"]),
        ((MOVING, AT_REST, MOVING), ("", "AC"), ["ST S", "QR", "ST AC"]),
        ((MOVING, IN_SEQUENCE, IN_SEQUENCE), ("BC", "A"), ["ST S", "QR", "ST A"]),
    ],
)
def test_the_sequence_stops_on_its_path_and_the_others_by_name(
    axes: tuple[AxisRecord, ...], outcome: tuple[str, str], commands: list[str]
) -> None:
    answers = {"ST S": b":", "QR": record(*axes), "ST A": b":", "ST AC": b":"}
    with controller(answers) as (port, heard):
        stopped = emergency.stop(NetworkAddress("127.0.0.1", port), 5.0)
    assert stopped == outcome
    assert stopped.decelerating == "".join(sorted("".join(outcome)))
    assert heard == commands


def test_record_is_requested_in_the_packet_of_the_stop() -> None:
    """Else a slow motion could be at rest before the record is taken, and would not be reported."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        packets: list[bytes] = []

        def serve() -> None:
            connection, _ = listener.accept()
            with connection:
                packets.append(connection.recv(1000))
                connection.sendall(b":" + record(IN_SEQUENCE))

        thread = threading.Thread(target=serve)
        thread.start()
        assert emergency.stop(NetworkAddress(*listener.getsockname()), 5.0).coordinated == "A"
        thread.join()
    assert packets == [b"ST S\rQR\r"]


def test_a_controller_without_a_sequence_may_refuse_to_stop_it() -> None:
    with controller({"ST S": b"?", "QR": record(MOVING), "ST A": b":"}) as (port, _):
        assert emergency.stop(NetworkAddress("127.0.0.1", port), 5.0).decelerating == "A"


def test_messages_of_programs_are_passed_over() -> None:
    note = bytes(code | 0x80 for code in b"note\r\n")
    with controller({"ST S": note + b":", "QR": note + record(IN_SEQUENCE)}) as (port, _):
        assert emergency.stop(NetworkAddress("127.0.0.1", port), 5.0).coordinated == "A"


@pytest.mark.parametrize(
    "answers",
    [
        {"ST S": b"x"},
        {"ST S": b":", "QR": b"?"},
        {"ST S": b":", "QR": b"\x87\x07\xff\xff"},
        {"ST S": b":", "QR": record(MOVING), "ST A": b"?"},
    ],
)
def test_unintelligible_answer_is_named(answers: Mapping[str, bytes]) -> None:
    with controller(answers) as (port, _), pytest.raises(UnexpectedReply):
        emergency.stop(NetworkAddress("127.0.0.1", port), 5.0)


def test_controller_that_hangs_up_before_any_answer_is_missing() -> None:
    with controller({}) as (port, _), pytest.raises(EndedUnanswered):
        emergency.stop(NetworkAddress("127.0.0.1", port), 5.0)


def test_a_controller_that_hangs_up_is_a_lost_link() -> None:
    with controller({"ST S": b":"}) as (port, _), pytest.raises(LinkLost):
        emergency.stop(NetworkAddress("127.0.0.1", port), 5.0)


def test_a_controller_that_says_nothing_is_given_up() -> None:
    with controller({"ST S": b"", "QR": b""}) as (port, _), pytest.raises(LinkTimeout, match="ST S"):
        emergency.stop(NetworkAddress("127.0.0.1", port), 0.05)


def test_missing_controller() -> None:
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        with pytest.raises(ConnectFailed):
            emergency.stop(NetworkAddress(*unused.getsockname()), 5.0)


def test_importing_it_brings_nothing_heavy() -> None:
    code = "import dmc41x3.wire.emergency, sys; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert not {"asyncio", "numpy", "pydantic", "dataclasses", "maya_un.config"} & set(loaded)
