"""The address of a controller, as people write it: `sim`, `real`, HOST, HOST:PORT, or a serial port.

A serial port is a path, as in `/dev/ttyUSB0`, `/dev/ttyUSB0@19200` or `/dev/ttyUSB0 --baud 19200`, or a name of Windows
like `COM3` (see `device`).

Imports nothing heavy, because an emergency stop needs it.
"""

from __future__ import annotations

import os
import re
from typing import NamedTuple, TypeAlias

from dmc41x3.i18n import phrase

SIM = "sim"
"""The address of a virtual controller in this process."""

REAL = "real"
"""The address of the configured controller (`controller.address`)."""

PORT = 23
"""Galil's port for commands."""

BAUD = 115200
"""Speed of a serial port if the address names none [bit/s]."""

BAUDS = (9600, 19200, 38400, 57600, 115200)
"""Speeds of a serial port [bit/s]; jumpers choose that of the controller."""

# Not compiled here: most commands parse no serial port, and `re` compiles a pattern once, at its first use.
_SERIAL = r"(?P<path>/[^@\s]+|COM[0-9]{1,3})(?:(?:@|\s+(?:-b|--baud)[\s=])\s*(?P<baud>[0-9]{1,7}))?"
_SERIAL_BEGIN = r"/|COM[0-9]+(?![\w.-])"
_COM = r"COM([0-9]+)"
_TTY = r"/dev/ttyS([0-9]+)"


class NetworkAddress(NamedTuple):
    """Host and TCP port of a controller."""

    host: str
    port: int = PORT

    def __str__(self) -> str:
        """Return HOST:PORT."""
        return f"{self.host}:{self.port}"


class SerialAddress(NamedTuple):
    """Path and speed [bit/s] of a serial port with a controller."""

    path: str
    baud: int = BAUD

    def __str__(self) -> str:
        """Return PATH, or PATH@BAUD if the speed is not the default one."""
        return self.path if self.baud == BAUD else f"{self.path}@{self.baud}"


ControllerAddress: TypeAlias = NetworkAddress | SerialAddress


def meant(address: str, configured: str) -> str:
    """Return `configured` if `address` is `real`, else `address`."""
    return configured if address == REAL else address


def parse(address: str) -> ControllerAddress:
    """Return the place that an address names: HOST, HOST:PORT or a serial port.

    Raises `ValueError` with the reason in words; `sim` and `real` are no places.
    """
    if not is_serial(address):
        return NetworkAddress(*split(address))
    found = re.fullmatch(_SERIAL, address.strip())
    if found is None:
        raise ValueError(phrase("a serial port must be PATH or PATH@BAUD"))
    baud = int(found["baud"] or BAUD)
    if baud not in BAUDS:
        raise ValueError(_wrong_speed("@" if "@" in address else "--baud"))
    return SerialAddress(device(found["path"]), baud)


def is_serial(address: str) -> bool:
    """Return whether an address begins like that of a serial port; the rest may be wrong."""
    return re.match(_SERIAL_BEGIN, address) is not None


def device(name: str) -> str:
    """Return the path of a serial port. COMn is the path in $DMC_COMn, else the port of that number (/dev/ttySn-1)."""
    com = re.fullmatch(_COM, name)
    if com is None:
        return name
    return os.environ.get(f"DMC_{name}") or f"/dev/ttyS{max(int(com[1]) - 1, 0)}"


def com_port(path: str) -> str | None:
    """Return the name COMn that means a path (see `device`), None without one."""
    port = re.fullmatch(_TTY, path)
    usual = f"COM{int(port[1]) + 1}" if port else ""
    named = [name.removeprefix("DMC_") for name, place in os.environ.items() if place == path]
    return next((name for name in (*named, usual) if re.fullmatch(_COM, name) and device(name) == path), None)


def split(address: str) -> tuple[str, int]:
    """Return host and port of HOST or HOST:PORT; the default port is `PORT`.

    Raises `ValueError` with the reason in words; `sim` and `real` are no hosts.
    """
    if "://" in address:
        raise ValueError(
            phrase("it must be HOST or HOST:PORT, without {scheme}", scheme=address.partition("//")[0] + "//")
        )
    host, _, port = address.partition(":")
    if re.fullmatch(r"[0-9.]+", host) and not _is_ipv4(host):
        raise ValueError(phrase("an address of numbers must be like 192.168.1.20"))
    if host in {SIM, REAL} or not re.fullmatch(r"[A-Za-z0-9](?:[A-Za-z0-9._-]*[A-Za-z0-9])?", host):
        raise ValueError(phrase("it must be HOST or HOST:PORT"))
    if address == host:
        return host, PORT
    if not re.fullmatch(r"[0-9]{1,5}", port) or not 0 < int(port) < 65536:
        raise ValueError(phrase("the port behind the colon must be 1 to 65535"))
    return host, int(port)


def _is_ipv4(host: str) -> bool:
    parts = host.split(".")
    return len(parts) == 4 and all(part.isdigit() and int(part) < 256 for part in parts)


def _wrong_speed(mark: str) -> str:
    *others, last = map(str, BAUDS)
    return phrase("the speed after {mark} must be {speeds} or {last}", mark=mark, speeds=", ".join(others), last=last)
