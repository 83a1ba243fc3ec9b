"""`dmc find`, `dmc assign` and `dmc ip`: find controllers, give them an address, and show or change it."""

from __future__ import annotations

import asyncio
import re
import sys
from collections.abc import Callable, Iterator
from ipaddress import IPv4Address, IPv4Interface, IPv4Network
from pathlib import Path
from typing import NamedTuple

from dmc41x3.address import ControllerAddress, NetworkAddress, SerialAddress, split
from dmc41x3.cli import console
from dmc41x3.cli.connection import TIMEOUT, until_asked
from dmc41x3.cli.console import OutputSettings, controller_address
from dmc41x3.cli.ipv4 import is_mask, parse_address, parse_mask, require_host, require_outside
from dmc41x3.driver import Driver
from dmc41x3.errors import (
    AddressNotReached,
    AddressTaken,
    CommandRejected,
    ConnectFailed,
    InvalidCommandLine,
    InvalidValue,
    MachineError,
    UnexpectedReply,
)
from dmc41x3.i18n import phrase, translate, visible
from dmc41x3.wire.transport import connect

MOST_HOSTS = 1022
"""Most hosts of a network that are all asked (/22); of a larger one, those of the /24 of this computer."""

AT_ONCE = 128
"""Most hosts that are asked at the same time."""

PATIENCE = 1.0
"""Longest wait for a host to connect, and for its answer [s]."""

_FIRMWARE = "\x12\x16"
_IDENTITY = re.compile(rb"(DMC\w+ Rev [ -~]+)\r\n")
_LONGEST_ANSWER = 512
_UNNAMED = "n/a"
"""The description by pyserial of a port without one."""


class FoundController(NamedTuple):
    """A controller that answered: its address, its firmware line, and its hardware address if that is known."""

    address: str
    firmware: str
    mac: str | None = None


class FoundPort(NamedTuple):
    """A serial port of this computer, and the firmware line of the controller that answered there."""

    path: str
    description: str
    firmware: str | None = None


def find(networks: list[str], port: int, ask_serial: bool, settings: OutputSettings) -> int:
    """Ask every host of the networks who it is, by default of those of this computer, and list serial ports.

    Nothing but the request for the firmware line is sent, to serial ports only if `ask_serial`. Raises `InvalidValue`.
    """
    hosts, asked = _hosts(networks)
    counter = _Counter(len(hosts), settings)
    found = asyncio.run(until_asked(_ask_all(hosts, port, counter.count))) or []
    counter.end()
    ports = list(_ports(ask_serial))
    value = {
        "networks": [str(network) for network in asked],
        "controllers": [one._asdict() for one in found],
        "serial": [one._asdict() for one in ports],
    }
    return console.answer(value, "\n".join(_listing(found, ports, asked, settings.language)), settings)


def _hosts(networks: list[str]) -> tuple[list[str], list[IPv4Network]]:
    """Return the hosts to ask, and their networks."""
    asked = [_network(text) for text in networks] if networks else [near(interface) for interface in interfaces()]
    hosts = {str(host): None for network in asked for host in network.hosts()}
    return list(hosts), asked


def _network(text: str) -> IPv4Network:
    try:
        network = IPv4Network(text, strict=False)
    except ValueError as error:
        raise InvalidValue(key="NETWORK", value=text, reason=phrase("it must be like 192.168.1.0/24")) from error
    if network.num_addresses > MOST_HOSTS + 2:
        raise InvalidValue(key="NETWORK", value=text, reason=phrase("the largest network to search is a /22"))
    return network


def near(interface: IPv4Interface) -> IPv4Network:
    """Return the network of an interface, or the /24 around its address if the network is too large."""
    network = interface.network
    return network if network.num_addresses <= MOST_HOSTS + 2 else IPv4Network((interface.ip, 24), strict=False)


def interfaces() -> Iterator[IPv4Interface]:
    """Yield the addresses of this computer with their networks, without the loopback."""
    import fcntl
    import socket
    import struct

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        for _, name in socket.if_nameindex():
            asked = struct.pack("256s", name[:15].encode())
            try:
                address = fcntl.ioctl(sock, 0x8915, asked)[20:24]  # SIOCGIFADDR
                mask = fcntl.ioctl(sock, 0x891B, asked)[20:24]  # SIOCGIFNETMASK
            except OSError:
                continue  # it has no address
            found = IPv4Interface((IPv4Address(address), str(IPv4Address(mask))))
            if not found.is_loopback:
                yield found


async def _ask_all(hosts: list[str], port: int, count: Callable[[], None]) -> list[FoundController]:
    limit = asyncio.Semaphore(AT_ONCE)

    async def ask(host: str) -> FoundController | None:
        async with limit:
            firmware = await identified(host, port)
            count()
        return None if firmware is None else FoundController(str(NetworkAddress(host, port)), firmware, _hardware(host))

    return [one for one in await asyncio.gather(*map(ask, hosts)) if one is not None]


async def identified(host: str, port: int) -> str | None:
    """Return the firmware line of the controller at a host, None if there is none."""
    try:
        async with asyncio.timeout(PATIENCE):
            reader, writer = await asyncio.open_connection(host, port)
    except (OSError, TimeoutError):
        return None
    answer = b""
    try:
        async with asyncio.timeout(PATIENCE):
            writer.write(f"{_FIRMWARE}\r".encode("ascii"))
            while _IDENTITY.search(answer) is None and len(answer) < _LONGEST_ANSWER:
                data = await reader.read(_LONGEST_ANSWER)
                if not data:
                    break
                answer += data
    except (OSError, TimeoutError):
        pass
    finally:
        writer.close()
    found = _IDENTITY.search(answer)
    return None if found is None else found[1].decode("ascii")


def _hardware(host: str) -> str | None:
    """Return the hardware address of a host that was just connected, from the system's table."""
    try:
        lines = Path("/proc/net/arp").read_text(encoding="ascii").splitlines()[1:]
    except OSError:
        return None
    return next((line.split()[3] for line in lines if line.split()[0] == host), None)


def _ports(ask: bool) -> Iterator[FoundPort]:
    from serial.tools.list_ports import comports

    for port in comports():
        yield FoundPort(port.device, visible(port.description), firmware_at(port.device) if ask else None)


def firmware_at(path: str) -> str | None:
    """Return the firmware line of the controller at a serial port, None if there is none; changes no setting."""
    from dmc41x3.wire.serial_port import BlockingPort

    try:
        port = BlockingPort(SerialAddress(path), PATIENCE)
    except ConnectFailed:
        return None
    answer = b""
    try:
        port.sendall(f"{_FIRMWARE}\r".encode("ascii"))
        while _IDENTITY.search(answer) is None and len(answer) < _LONGEST_ANSWER:
            answer += port.recv(_LONGEST_ANSWER)
    except OSError:
        pass
    finally:
        port.close()
    found = _IDENTITY.search(answer)
    return None if found is None else found[1].decode("ascii")


class _Counter:
    """Shows on a terminal how many hosts were asked."""

    def __init__(self, most: int, settings: OutputSettings) -> None:
        self._most = most
        self._language = settings.language
        self._shown = sys.stderr.isatty() and not settings.json
        self._done = 0

    def count(self) -> None:
        """Count one host."""
        self._done += 1
        if self._shown:
            text = translate("{done} of {most} hosts asked", self._language, done=self._done, most=self._most)
            print(f"\r{text}", end="", file=sys.stderr, flush=True)

    def end(self) -> None:
        """Leave the line."""
        if self._shown and self._done:
            print(file=sys.stderr)


def _listing(
    found: list[FoundController], ports: list[FoundPort], asked: list[IPv4Network], language: str
) -> Iterator[str]:
    for one in found:
        yield "  ".join(filter(None, (one.address, one.firmware, one.mac)))
    if not found:
        names = ", ".join(map(str, asked)) or "–"
        yield translate("No controller answers in {networks}.", language, networks=names)
    for port in ports:
        named = port.description not in {"", _UNNAMED}
        name = port.description if named else translate("no name", language)
        yield f"{port.path}  {port.firmware or name}"


_TH = re.compile(r"IP ADDRESS (\d+),(\d+),(\d+),(\d+) ETHERNET ADDRESS ([0-9A-Fa-f-]{17})")
_BURN_TIME = 10.0
"""Longest wait for BN [s]."""

_ATTEMPTS, _PAUSE = 8, 0.25
"""Attempts to reach a controller at its new address, and the time between two [s]."""


class IpSettings(NamedTuple):
    """The network settings of a controller. `retry` is in samples, `serial_number` that of the controller."""

    address: IPv4Address
    mask: IPv4Address
    mac: str
    dhcp: bool
    multicast: IPv4Address
    retry: int
    firmware: str
    serial_number: int


class IpChange(NamedTuple):
    """The changes that `dmc ip` makes; None leaves a setting as it is."""

    address: str | None = None
    mask: str | None = None
    dhcp: bool | None = None
    burn: bool = False
    yes: bool = False

    @property
    def anything(self) -> bool:
        """Whether a setting changes or is burned."""
        return self.burn or not (self.address is None and self.mask is None and self.dhcp is None)


def ip(host: str, change: IpChange, settings: OutputSettings) -> int:
    """Show the network settings of a controller, or change them; it is reached again before anything is burned.

    Raises `InvalidValue`, `InvalidCommandLine` without a confirmation, `ControllerOwned`, `AddressNotReached`, and the
    errors of the link.
    """
    place = controller_address(settings.site.meant(host, settings.config), "HOST")
    found, place = asyncio.run(change_settings(place, change, settings))
    value = {**{key: str(item) if isinstance(item, IPv4Address) else item for key, item in found._asdict().items()}}
    value |= {"reached": str(place), "burned": change.burn}
    return console.answer(value, "\n".join(_ip_lines(found, place, change, settings)), settings)


async def change_settings(
    place: ControllerAddress, change: IpChange, settings: OutputSettings, mac: str | None = None
) -> tuple[IpSettings, ControllerAddress]:
    """Change the network settings of a controller; return them, and where it is reached now.

    If `mac` is given, only the controller with this hardware address is changed. Raises as `ip`.
    """
    address = None if change.address is None else parse_address(change.address, "--set")
    mask = None if change.mask is None else parse_mask(change.mask)
    if address is not None and mask is not None:
        require_host(address, mask, "--set", address)
    if change.dhcp and address is not None:
        reason = phrase("--set and --dhcp exclude each other: with DHCP, the server chooses the address")
        raise InvalidCommandLine(reason=reason, command=f"{settings.site.command} ip")
    driver = await Driver.open(await connect(place, TIMEOUT), timeout=TIMEOUT)
    try:
        found = await read_settings(driver)
        if not change.anything:
            return found, place
        _require_same(found.mac, mac or found.mac, place)
        _require_usable(found, place, address, mask)
        await settings.site.require_free(driver, str(place))
        _confirm(found, place, address, change, settings)
        commands = _commands(found, address, mask, change.dhcp)
        if commands:
            await driver.batch(commands)
        if address is not None and address != found.address:
            driver, place = await _moved(driver, place, address, found.mac)
        if change.burn:
            await driver.send("BN", timeout=_BURN_TIME)
        return await read_settings(driver), place
    finally:
        await driver.close()


def _require_same(found: str, mac: str, place: ControllerAddress) -> None:
    """Raise `AddressTaken` if the hardware address that was `found` is not `mac`."""
    if found != mac:
        raise AddressTaken(address=str(place), found=found, mac=mac)


def _require_usable(
    found: IpSettings, place: ControllerAddress, address: IPv4Address | None, mask: IPv4Address | None
) -> None:
    """Raise `InvalidValue` if nobody could reach the controller with its new address or its new mask."""
    inside = isinstance(place, NetworkAddress) and _names_this_computer(place.host)
    if address is not None:
        require_outside(address, inside or found.address.is_loopback, "--set")
    within = found.mask if mask is None else mask
    if not is_mask(within):  # it was burned earlier
        return
    if address is not None:
        require_host(address, within, "--set", address)
    elif mask is not None and int(found.address):
        require_host(found.address, mask, "--mask", mask)


def _names_this_computer(host: str) -> bool:
    return host == "localhost" or host.startswith("127.")


async def read_settings(driver: Driver) -> IpSettings:
    """Return the network settings of a controller; only asks. Raises as `Driver.send`."""
    address, mac = await _addresses(driver)
    mask, dhcp, multicast = await driver.batch(["SM ?", "DH ?", "MU ?"])
    return IpSettings(
        address=address,
        mask=_quad(mask, "SM ?"),
        mac=mac,
        dhcp=float(dhcp) != 0.0,
        multicast=_quad(multicast, "MU ?"),
        retry=int(await driver.value("_IA1")),
        firmware=await _firmware(driver),
        serial_number=int(await driver.value("_BN")),
    )


async def _firmware(driver: Driver) -> str:
    """Return the firmware line; raises `UnexpectedReply` for one with control characters, which a terminal executes."""
    line = await driver.send(_FIRMWARE)
    if not line.isprintable():
        raise UnexpectedReply(command=_FIRMWARE, reply=line[:80])
    return line


async def _addresses(driver: Driver) -> tuple[IPv4Address, str]:
    """Return the address of a controller, and its hardware address in lower case with colons; raises as `send`."""
    listed = await driver.send("TH")
    found = _TH.search(listed)
    if found is None:
        raise UnexpectedReply(command="TH", reply=listed[:80])
    return _quad(",".join(found.groups()[:4]), "TH"), found[5].lower().replace("-", ":")


def _quad(text: str, command: str) -> IPv4Address:
    """Return an address as the controller prints it, `255, 255, 255, 0`."""
    try:
        return IPv4Address(".".join(str(int(float(part))) for part in text.split(",")))
    except ValueError as error:
        raise UnexpectedReply(command=command, reply=text) from error


def _commands(found: IpSettings, address: IPv4Address | None, mask: IPv4Address | None, dhcp: bool | None) -> list[str]:
    """Return the commands before the one that changes the address, which is refused (163) while DH is 1."""
    commands: list[str] = []
    if address is not None or dhcp is not None:
        commands.append(f"DH {int(bool(dhcp))}")
    if mask is not None and mask != found.mask:
        commands.append(f"SM {_commas(mask)}")
    return commands


def _commas(address: IPv4Address) -> str:
    return ",".join(map(str, address.packed))


async def _moved(
    driver: Driver, place: ControllerAddress, address: IPv4Address, mac: str
) -> tuple[Driver, ControllerAddress]:
    """Change the address and return a link to the controller there; by a serial port the link stays."""
    command = f"IA {_commas(address)}"
    if isinstance(place, SerialAddress):
        await driver.send(command)
        return driver, place
    try:
        await driver.send(command)
    except CommandRejected:
        raise
    except MachineError:
        pass  # a controller need not answer by an address that it has given up
    await driver.close()
    there = NetworkAddress(str(address), place.port)
    failure: MachineError | None = None
    for attempt in range(_ATTEMPTS):
        if attempt:
            await asyncio.sleep(_PAUSE)
        try:
            moved = await Driver.open(await connect(there, PATIENCE), timeout=TIMEOUT)
        except ConnectFailed as error:
            failure = error
            continue
        try:
            _, other = await _addresses(moved)
            _require_same(other, mac, there)
            return moved, there
        except MachineError as error:
            failure = error
        await moved.close()
    if isinstance(failure, AddressTaken):
        raise failure
    reason = str(failure) if failure is None else failure.details.get("reason", str(failure))
    raise AddressNotReached(address=str(there), reason=str(reason)) from failure


def _confirm(
    found: IpSettings,
    place: ControllerAddress,
    address: IPv4Address | None,
    change: IpChange,
    settings: OutputSettings,
) -> None:
    """Ask the user before a setting changes; raises `InvalidCommandLine` if nobody can be asked or the answer is no."""
    if change.yes:
        return
    command = f"{settings.site.command} ip"
    if settings.json or not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise InvalidCommandLine(reason=phrase("a change needs --yes where nobody can be asked"), command=command)
    question = translate(
        "Change the network settings of {firmware} (serial number {number}) at {place}?",
        settings.language,
        firmware=found.firmware,
        number=found.serial_number,
        place=place,
    )
    if address is not None:
        question += " " + translate("Its address becomes {address}.", settings.language, address=address)
    if change.burn:
        question += " " + translate("BN burns all its present settings.", settings.language)
    if console.typed(f"{question} [y/N] ").lower() not in {"y", "yes", "s", "sí", "si"}:
        raise InvalidCommandLine(reason=phrase("nothing was changed"), command=command)


def _ip_lines(found: IpSettings, place: ControllerAddress, change: IpChange, settings: OutputSettings) -> Iterator[str]:
    command, language = settings.site.command, settings.language
    yield translate("{firmware}, serial number {number}", language, firmware=found.firmware, number=found.serial_number)
    yield translate("address           {address}", language, address=found.address)
    yield translate("subnet mask       {mask}", language, mask=found.mask)
    yield translate("hardware address  {mac}", language, mac=found.mac)
    yield translate("DHCP              on" if found.dhcp else "DHCP              off", language)
    if change.burn:
        yield translate("Burned: the controller has these settings after power-up.", language)
    elif change.anything:
        yield translate(
            "Not burned: after power-up the former settings hold. `{command}` burns them.",
            language,
            command=f"{command} ip {place} --burn",
        )


def parse_place(text: str) -> tuple[IPv4Address, int]:
    """Return the address and the port of ADDRESS or ADDRESS:PORT; raises `InvalidValue`."""
    try:
        host, port = split(text)
    except ValueError as error:
        raise InvalidValue(key="ADDRESS", value=text, reason=phrase("it must be like 192.168.1.20")) from error
    return parse_address(host, "ADDRESS"), port
