"""The port of unsolicited messages: CF, CW, and a closed port of CF."""

from __future__ import annotations

import pytest

from dmc41x3.twin.network import Handle, Handles, OutputBuffer


class Office:
    """Three connections A, B, C, and their outlet."""

    def __init__(self) -> None:
        self.handles = Handles()
        self.outlet = OutputBuffer(self.handles)
        self.handles.on_close = lambda handle: self.outlet.closed(handle.letter)
        self.given = [self.handles.connect(("10.0.0.1", port)) for port in range(3)]

    def at(self, letter: str) -> Handle:
        handle = self.handles.at(letter)
        assert handle is not None
        return handle

    def heard(self) -> list[tuple[str, bytes]]:
        return [(handle.letter, data) for handle, data in self.outlet.take()]


def test_message_is_not_sent_until_a_port_is_chosen() -> None:
    office = Office()
    assert office.outlet.say(b"x\r\n")
    office.outlet.port = "B"
    assert office.outlet.say(b"y\r\n")
    assert office.outlet.say(b"z\r\n", "A")
    assert office.outlet.say(b"w\r\n", "T")
    assert office.heard() == [("B", b"y\r\n"), ("A", b"z\r\n")]
    assert office.heard() == []


def test_cw_1_marks_every_byte_and_leaves_the_argument() -> None:
    office = Office()
    office.outlet.port, office.outlet.mark = "C", 1
    office.outlet.say(b"A\r\n")
    office.outlet.put(office.at("C"), b"A\r\n")
    assert office.heard() == [("C", b"\xc1\x8d\x8a"), ("C", b"A\r\n")]


@pytest.mark.parametrize(
    ("chosen", "closed", "port"),
    [
        ("A", "A", "S"),
        ("A", "B", "A"),
        ("AB", "B", "A"),
        ("ABC", "BC", "A"),
        ("ABC", "CAB", "S"),
        ("AT", "A", "T"),
        ("TA", "A", "T"),
        ("ABA", "A", "B"),
        ("BBB", "B", "S"),
    ],
)
def test_when_its_handle_closes_cf_goes_back_to_the_port_before(chosen: str, closed: str, port: str) -> None:
    office = Office()
    for name in chosen:
        office.outlet.port = name
    for name in closed:
        office.handles.close(office.at(name))
    assert office.outlet.port == port


def test_a_closed_port_takes_no_message() -> None:
    office = Office()
    assert not office.outlet.say(b"x", "H")
    assert office.heard() == []
    office.outlet.port = "A"
    office.outlet.reset()
    assert (office.outlet.port, office.outlet.mark) == ("S", 2)
