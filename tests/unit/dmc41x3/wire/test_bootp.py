"""Packets of BOOTP and DHCP, against bytes written by hand from RFC 951 and RFC 2131."""

from __future__ import annotations

from ipaddress import IPv4Address

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.wire.bootp import (
    AddressReply,
    AddressRequest,
    DhcpKind,
    answer,
    parse_mac,
    parse_reply,
    parse_request,
    request,
)

MAC = "00:50:4c:08:01:1f"
SERVER, ADDRESS, MASK = IPv4Address("10.0.0.1"), IPv4Address("10.0.0.7"), IPv4Address("255.255.255.0")
HARDWARE = bytes.fromhex("00504c08011f")
MAGIC = bytes.fromhex("63825363")

REQUEST = bytes.fromhex("0101060000000007") + bytes(20) + HARDWARE + bytes(10 + 64 + 128)
"""op 1, Ethernet, 6 bytes; number 7; no addresses; the hardware address; no names. 64 bytes for the vendor follow."""

REPLY = (
    bytes.fromhex("0201060000000007")
    + bytes(8)
    + ADDRESS.packed
    + SERVER.packed
    + bytes(4)
    + HARDWARE
    + bytes(10 + 64 + 128)
)

macs = st.binary(min_size=6, max_size=6).map(lambda data: data.hex(":"))
numbers = st.integers(0, 2**32 - 1)
addresses = st.integers(1, 2**32 - 1).map(IPv4Address)


def test_bootp_request_by_hand() -> None:
    asked = parse_request(REQUEST + bytes(64))
    assert asked == AddressRequest(MAC, 7)
    assert asked is not None
    assert asked.from_galil
    assert request(asked)[:236] == REQUEST


def test_bootp_reply_by_hand() -> None:
    sent = answer(AddressRequest(MAC, 7), ADDRESS, MASK, SERVER)
    assert sent[:236] == REPLY
    assert sent[236:] == MAGIC + bytes([1, 4]) + MASK.packed + b"\xff" + bytes(300 - 236 - 11)
    assert parse_reply(REPLY + bytes(64)) == AddressReply(MAC, 7, ADDRESS, SERVER)


def test_dhcp_discover_is_offered_an_address_without_end() -> None:
    asked = parse_request(REQUEST + MAGIC + bytes([53, 1, 1, 255]))
    assert asked == AddressRequest(MAC, 7, DhcpKind.DISCOVER)
    assert asked is not None
    sent = answer(asked, ADDRESS, MASK, SERVER)
    options = bytes([53, 1, 2, 54, 4, *SERVER.packed, 51, 4, 255, 255, 255, 255, 1, 4, *MASK.packed, 255])
    assert sent[:236] == REPLY
    assert sent[236:].startswith(MAGIC + options)


def test_dhcp_request_names_its_server() -> None:
    options = bytes([0, 53, 1, 3, 54, 4, *SERVER.packed, 50, 4, *ADDRESS.packed, 255])
    asked = parse_request(REQUEST + MAGIC + options)
    assert asked == AddressRequest(MAC, 7, DhcpKind.REQUEST, SERVER, ADDRESS)
    assert asked is not None
    found = parse_reply(answer(asked, ADDRESS, MASK, SERVER))
    assert found == AddressReply(MAC, 7, ADDRESS, SERVER, MASK, DhcpKind.ACK)


@pytest.mark.parametrize(
    "data",
    [
        b"",
        REQUEST[:200],
        REPLY + bytes(64),
        b"\x01\x06" + REQUEST[2:] + bytes(64),
        REQUEST + MAGIC + bytes([53, 1, 7, 255]),
        REQUEST + MAGIC + bytes([53, 0, 255]),
    ],
)
def test_other_datagram_is_no_request(data: bytes) -> None:
    assert parse_request(data) is None


@given(st.binary(max_size=400) | st.binary(max_size=100).map(lambda data: REQUEST + MAGIC + data))
def test_any_datagram_is_read_without_an_error(data: bytes) -> None:
    parse_request(data)
    parse_reply(b"\x02" + data[1:])


@given(macs, numbers, st.sampled_from([DhcpKind.NONE, DhcpKind.DISCOVER, DhcpKind.REQUEST]), addresses, addresses)
def test_packed_request_is_read_again(
    mac: str, number: int, kind: DhcpKind, server: IPv4Address, wanted: IPv4Address
) -> None:
    named = kind is DhcpKind.REQUEST
    asked = AddressRequest(mac, number, kind, *((server, wanted) if named else ()))
    assert parse_request(request(asked)) == asked


@pytest.mark.parametrize("text", ["00:50:4C:08:01:1F", "00-50-4c-08-01-1f"])
def test_hardware_address_in_either_notation(text: str) -> None:
    assert parse_mac(text) == MAC


@pytest.mark.parametrize("text", ["mac", "00:50:4C:08:01", "00:50-4C:08:01:1F", "00504C08011F", "0g:50:4C:08:01:1F"])
def test_other_text_is_no_hardware_address(text: str) -> None:
    with pytest.raises(ValueError, match=text):
        parse_mac(text)
