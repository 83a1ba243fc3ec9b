"""`dmc assign`: answer a controller that asks for an address by BOOTP or DHCP."""

from __future__ import annotations

import asyncio
import errno
import logging
import socket
import struct
import sys
import time
from collections.abc import Iterator
from ipaddress import IPv4Address
from typing import NamedTuple

from dmc41x3.address import NetworkAddress
from dmc41x3.cli import console
from dmc41x3.cli.console import OutputSettings
from dmc41x3.cli.ipv4 import parse_mask, require_host, require_outside
from dmc41x3.cli.network import IpChange, change_settings, identified, parse_place
from dmc41x3.errors import (
    AddressInUse,
    InvalidCommandLine,
    InvalidValue,
    NoAddressRequest,
    OtherDhcpServer,
    PortForbidden,
)
from dmc41x3.i18n import phrase, translate
from dmc41x3.wire.bootp import NOWHERE, AddressRequest, DhcpKind, answer, parse_mac, parse_request

LONGEST = 86_400.0
"""Longest wait for requests [s]: a day."""

_log = logging.getLogger(__name__)

_PKTINFO = 8
"""IP_PKTINFO of Linux, which Python does not name: the interface of a datagram, and its address there."""

_INFO = struct.Struct("@i4s4s")
_LARGEST = 2048
_NOT_YET = "0.0.0.0"
"""The source of a datagram from a host without an address."""
_ATTEMPTS, _PAUSE = 12, 0.25
"""Attempts to reach the controller at its new address, and the time between two [s]."""


class AssignOptions(NamedTuple):
    """The options of the command line; `seconds` is the longest wait [s], above 0 and at most `LONGEST`."""

    mask: str | None = None
    port: int = 67
    seconds: float = 60.0
    burn: bool = False


class _Heard(NamedTuple):
    """A request with the source of its datagram, the interface where it arrived, and this computer's address there."""

    request: AddressRequest
    source: tuple[str, int]
    interface: int
    here: IPv4Address


def assign(mac: str | None, address: str | None, options: AssignOptions, settings: OutputSettings) -> int:
    """Give `address` to the controller with the hardware address `mac`, or list controllers that ask, and let choose.

    Only requests of that controller are answered. Raises `InvalidCommandLine` for `mac` without `address`,
    `InvalidValue`, `PortForbidden`, `AddressInUse`, `NoAddressRequest`, `OtherDhcpServer`, and for a burn the errors of
    the link.
    """
    if not 0.0 < options.seconds <= LONGEST:
        reason = phrase("it must be above 0 and at most {most:g} s", most=LONGEST)
        raise InvalidValue(key="--for", value=options.seconds, reason=reason)
    named = None if mac is None else _mac(mac)
    place = None if address is None else parse_place(address)
    mask = NOWHERE if options.mask is None else parse_mask(options.mask)
    if place is not None:
        require_host(place[0], mask, "ADDRESS", place[0])
    if named is not None and place is None:
        raise _incomplete(named, settings)
    with opened(options.port) as sock:
        if named is None or place is None:
            asking = _listed(sock, options.seconds, settings)
            chosen = None if settings.json or not sys.stdin.isatty() else _chosen(asking, settings.language)
            if chosen is None:
                return console.answer({"asking": asking}, _summary(asking, settings.language), settings)
            named, place = chosen
            require_host(place[0], mask, "ADDRESS", place[0])
        serve(sock, named, place[0], mask, options.seconds)
    return _given(named, place, options, settings)


def _incomplete(mac: str, settings: OutputSettings) -> InvalidCommandLine:
    command = f"{settings.site.command} assign"
    reason = phrase(
        "ADDRESS is missing: write `{command} {mac} 192.168.1.20`, or leave out both to list the controllers that ask "
        "for an address",
        command=command,
        mac=mac,
    )
    return InvalidCommandLine(reason=reason, command=command)


def _mac(text: str) -> str:
    try:
        return parse_mac(text)
    except ValueError as error:
        raise InvalidValue(key="MAC", value=text, reason=phrase("it must be like 00:50:4C:08:01:1F")) from error


def opened(port: int) -> socket.socket:
    """Return a socket for requests; raises `PortForbidden`, and `AddressInUse` if a server runs on this computer."""
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        sock.setsockopt(socket.IPPROTO_IP, _PKTINFO, 1)
        sock.bind(("", port))
    except OSError as error:
        sock.close()
        if error.errno in {errno.EACCES, errno.EPERM}:
            raise PortForbidden(port=port) from error
        raise AddressInUse(address=f"UDP port {port}") from error
    return sock


def _requests(sock: socket.socket, seconds: float) -> Iterator[_Heard]:
    """Yield the requests that arrive within `seconds` [s]."""
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0.0:
        sock.settimeout(left)
        try:
            data, ancillary, _, source = sock.recvmsg(_LARGEST, socket.CMSG_SPACE(_INFO.size))
        except TimeoutError:
            return
        asked = parse_request(data)
        if asked is None:
            continue
        interface, here, _ = _INFO.unpack(ancillary[0][2]) if ancillary else (0, NOWHERE.packed, b"")
        yield _Heard(asked, (source[0], source[1]), interface, IPv4Address(here))


def serve(sock: socket.socket, mac: str, address: IPv4Address, mask: IPv4Address, seconds: float) -> None:
    """Answer one controller until it has its address.

    Raises `NoAddressRequest`, `OtherDhcpServer`, and `InvalidValue` for an address of the loopback in a real network.
    """
    for heard in _requests(sock, seconds):
        asked = heard.request
        if asked.mac != mac:
            continue
        require_outside(address, heard.here.is_loopback, "ADDRESS")
        if asked.kind is DhcpKind.REQUEST and asked.server not in {NOWHERE, heard.here}:
            raise OtherDhcpServer(mac=mac, server=str(asked.server))
        if asked.kind is DhcpKind.REQUEST and asked.wanted not in {NOWHERE, address}:
            continue  # it remembers another address; without an answer it sends a DISCOVER
        if not _sent(sock, heard, answer(asked, address, mask, heard.here)):
            continue
        if asked.kind is not DhcpKind.DISCOVER:
            return
    raise NoAddressRequest(mac=mac, seconds=f"{seconds:g}")


def _sent(sock: socket.socket, heard: _Heard, data: bytes) -> bool:
    """Return whether the system sent an answer; if it refuses, as for port 0, the log says why."""
    try:
        _send(sock, heard, data)
    except OSError as error:
        host, port = heard.source
        _log.warning("no answer could be sent to %s:%d: %s", host, port, error.strerror)
        return False
    return True


def _send(sock: socket.socket, heard: _Heard, data: bytes) -> None:
    """Send an answer, as a broadcast by the interface of the request if the sender has no address yet."""
    host, port = heard.source
    if host != _NOT_YET:
        sock.sendto(data, (host, port))
        return
    info = (socket.IPPROTO_IP, _PKTINFO, _INFO.pack(heard.interface, b"\0" * 4, b"\0" * 4))
    sock.sendmsg([data], [info], 0, ("255.255.255.255", port))


def _listed(sock: socket.socket, seconds: float, settings: OutputSettings) -> list[str]:
    """Return the hardware addresses of the Galil controllers that ask within `seconds` [s]; print each at once."""
    if not settings.json:
        text = translate(
            "Waiting {seconds:g} s for controllers that ask for an address.", settings.language, seconds=seconds
        )
        console.say(text)
    asking: list[str] = []
    for heard in _requests(sock, seconds):
        if heard.request.from_galil and heard.request.mac not in asking:
            asking.append(heard.request.mac)
            if not settings.json:
                console.say(f"{len(asking)}  {heard.request.mac}")
            if sys.stdin.isatty() and not settings.json:
                break
    return asking


def _summary(asking: list[str], language: str) -> str:
    if asking:
        return translate("`dmc assign MAC ADDRESS` gives one of them an address.", language)
    return translate("No controller asked for an address.", language)


def _chosen(asking: list[str], language: str) -> tuple[str, tuple[IPv4Address, int]] | None:
    """Return the first controller and the address that a person types for it; None without one."""
    if not asking:
        return None
    address = console.typed(translate("Address for {mac}: ", language, mac=asking[0]))
    return (asking[0], parse_place(address)) if address else None


def _given(mac: str, place: tuple[IPv4Address, int], options: AssignOptions, settings: OutputSettings) -> int:
    """Wait for the controller at its address, burn that if requested, and print the result."""
    address = NetworkAddress(str(place[0]), place[1])
    firmware = asyncio.run(_identified(address))
    if options.burn:
        asyncio.run(change_settings(address, IpChange(dhcp=False, burn=True, yes=True), settings, mac))
    value = {"mac": mac, "address": str(address), "firmware": firmware, "burned": options.burn}
    lines = [translate("{mac} has the address {address}.", settings.language, mac=mac, address=place[0])]
    if firmware is None:
        lines.append(translate("It does not answer there yet.", settings.language))
    elif not options.burn:
        lines.append(
            translate(
                "{firmware} answers. `{command}` makes the address permanent.",
                settings.language,
                firmware=firmware,
                command=f"{settings.site.command} ip {address} --no-dhcp --burn",
            )
        )
    console.answer(value, "\n".join(lines), settings)
    return console.DONE if firmware is not None else console.FAILED


async def _identified(address: NetworkAddress) -> str | None:
    for attempt in range(_ATTEMPTS):
        if attempt:
            await asyncio.sleep(_PAUSE)
        firmware = await identified(*address)
        if firmware is not None:
            return firmware
    return None
