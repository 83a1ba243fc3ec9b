"""Address strings of GOpen."""

from __future__ import annotations

import pytest

from dmc41x3.gclib.errors import Code, GclibError
from dmc41x3.gclib.session import AddressOptions, parse

ALL = frozenset({"MG", "DR", "EI"})


@pytest.mark.parametrize(
    ("address", "options"),
    [
        ("192.168.0.42", AddressOptions("192.168.0.42")),
        ("192.168.0.42 --direct -s ALL", AddressOptions("192.168.0.42", subscriptions=ALL)),
        ("-d 192.168.0.42 -s MG -s DR", AddressOptions("192.168.0.42", subscriptions=frozenset({"MG", "DR"}))),
        ("--address box --subscribe none", AddressOptions("box")),
        ("-a box:5023 -t 500", AddressOptions("box", 5023, timeout=500)),
        ("box --p1 5023 --p2 5024 --timeout 0", AddressOptions("box", 5023, 5024, timeout=0)),
        ("box -u none -c TCP", AddressOptions("box", unsolicited="NONE")),
        ("box --unsolicited TCP -b 19200 --handshake NONE", AddressOptions("box", unsolicited="TCP", baud=19200)),
        ("/dev/ttyUSB0", AddressOptions("/dev/ttyUSB0", serial=True)),
        (
            "COM1 --baud 19200 -s MG",
            AddressOptions("/dev/ttyS0", subscriptions=frozenset({"MG"}), serial=True, baud=19200),
        ),
    ],
)
def test_address_options(address: str, options: AddressOptions) -> None:
    assert parse(address) == options


@pytest.mark.parametrize(
    "address",
    [
        "",
        "--direct",
        "box other",
        "box -s EVERYTHING",
        "box -s",
        "box --timeout soon",
        "box --timeout 65536",
        "box --p1 -1",
        "box:port",
        "box -c UDP",
        "box -u RADIO",
        "box --fast",
        "COM1 --baud 19",
        "/dev/ttyUSB0 box",
        "GALILPCI1",
        'box "-s',
    ],
)
def test_invalid_address(address: str) -> None:
    with pytest.raises(GclibError, match="a bad address was specified in open") as caught:
        parse(address)
    assert caught.value.code is Code.ADDRESS
    assert caught.value.detail


@pytest.mark.parametrize(
    ("address", "port"), [("box", 60007), ("box:5023", 5023), ("box:5023 --p2 60007", 60007), ("box --p2 5", 5)]
)
def test_datagrams_go_to_their_own_port_on_a_controller_and_to_the_same_on_a_twin(address: str, port: int) -> None:
    assert parse(address).unsolicited_port == port
