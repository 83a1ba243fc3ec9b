"""Addresses as people write them."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.address import BAUDS, NetworkAddress, SerialAddress, com_port, parse


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("box", NetworkAddress("box", 23)),
        ("192.168.1.20:5023", NetworkAddress("192.168.1.20", 5023)),
        ("/dev/ttyUSB0", SerialAddress("/dev/ttyUSB0", 115200)),
        ("/dev/ttyUSB0@19200", SerialAddress("/dev/ttyUSB0", 19200)),
        ("/dev/ttyUSB0 --baud 19200", SerialAddress("/dev/ttyUSB0", 19200)),
        ("/dev/ttyUSB0 -b 9600", SerialAddress("/dev/ttyUSB0", 9600)),
        ("/dev/serial/by-id/usb-FTDI_FT232R-if00", SerialAddress("/dev/serial/by-id/usb-FTDI_FT232R-if00")),
        ("COM1", SerialAddress("/dev/ttyS0")),
        ("COM3@38400", SerialAddress("/dev/ttyS2", 38400)),
        ("COM3.example.org", NetworkAddress("COM3.example.org")),
        ("COMET", NetworkAddress("COMET")),
    ],
)
def test_address_names_its_place(text: str, place: NetworkAddress | SerialAddress) -> None:
    assert parse(text) == place


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("sim", "it must be HOST"),
        ("/dev/ttyUSB0@12", "^the speed after @ must be 9600, 19200, 38400, 57600 or 115200$"),
        ("/dev/ttyUSB0 --baud 12", "^the speed after --baud must be 9600"),
        ("/dev/ttyUSB0@", "PATH@BAUD"),
        ("/dev/ttyUSB0 --baud", "PATH@BAUD"),
        ("/dev/tty USB0", "PATH@BAUD"),
        ("box:0", "1 to 65535"),
    ],
)
def test_address_that_names_no_place_is_refused(text: str, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        parse(text)


def test_com_port_is_that_of_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DMC_COM7", "/dev/pts/4")
    assert parse("COM7") == SerialAddress("/dev/pts/4")


def test_com_port_of_a_path_is_the_one_that_means_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DMC_COM7", "/dev/pts/4")
    monkeypatch.setenv("DMC_COM3", "/dev/ttyUSB0")
    assert [com_port(path) for path in ("/dev/pts/4", "/dev/ttyS0", "/dev/ttyS2", "/dev/ttyUSB1")] == [
        "COM7",
        "COM1",
        None,
        None,
    ]


@given(st.from_regex(r"/[a-zA-Z0-9/._-]{1,30}", fullmatch=True), st.sampled_from(BAUDS))
def test_printed_serial_address_is_read_again(path: str, baud: int) -> None:
    place = SerialAddress(path, baud)
    assert parse(str(place)) == place


@given(st.text(max_size=30))
def test_any_text_is_a_place_or_refused(text: str) -> None:
    try:
        place = parse(text)
    except ValueError:
        return
    assert parse(str(place)) == place
