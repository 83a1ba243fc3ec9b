"""The address of a controller, as people write it: `sim`, `real`, HOST or HOST:PORT.

Imports nothing heavy, because an emergency stop needs it.
"""

from __future__ import annotations

import re

from dmc41x3.i18n import phrase

SIM = "sim"
"""The address of a virtual controller in this process."""

REAL = "real"
"""The address of the configured controller (`controller.address`)."""

PORT = 23
"""Galil's port for commands."""


def meant(address: str, configured: str) -> str:
    """Return `configured` if `address` is `real`, else `address`."""
    return configured if address == REAL else address


def split(address: str) -> tuple[str, int]:
    """Return host and port of HOST or HOST:PORT; the default port is `PORT`.

    Raises `ValueError` with the reason in words; `sim` and `real` are no hosts.
    """
    host, _, port = address.partition(":")
    if host in {SIM, REAL} or not re.fullmatch(r"[A-Za-z0-9](?:[A-Za-z0-9._-]*[A-Za-z0-9])?", host):
        raise ValueError(phrase("it must be HOST or HOST:PORT"))
    if address == host:
        return host, PORT
    if not re.fullmatch(r"[0-9]{1,5}", port) or not 0 < int(port) < 65536:
        raise ValueError(phrase("the port behind the colon must be 1 to 65535"))
    return host, int(port)
