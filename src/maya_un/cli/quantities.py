"""Values in user input: plain numbers are SI, and a unit may follow (30deg, 120mm)."""

from __future__ import annotations

import re
from math import isfinite, pi

from dmc41x3.address import SIM, meant
from dmc41x3.cli import console
from dmc41x3.cli.console import host_and_port
from dmc41x3.i18n import phrase
from maya_un.errors import InvalidValue, SpeedOnRealMachine
from maya_un.values import FARTHEST, WITHIN, Joints, Point

_NUMBER = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([A-Za-zµ°%]*)")
_LENGTHS = {"": 1.0, "m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6}
_ANGLES = {"": 1.0, "rad": 1.0, "mrad": 1e-3, "deg": pi / 180.0, "°": pi / 180.0}
_DURATIONS = {"": 1.0, "s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0}
_SHARES = {"": 1.0, "%": 0.01}


def length(text: str, key: str) -> float:
    """Return a length [m]; raises `InvalidValue` naming `key`."""
    rule = phrase("a length is a number in m, or with m, cm, mm or um behind it")
    return _coordinate(text, key, _quantity(text, key, _LENGTHS, rule))


def angle(text: str, key: str) -> float:
    """Return an angle [rad]; raises `InvalidValue` naming `key`."""
    rule = phrase("an angle is a number in rad, or with rad, mrad or deg behind it")
    return _coordinate(text, key, _quantity(text, key, _ANGLES, rule))


def point_of(x: str, y: str, z: str) -> Point:
    """Return a point [m]; raises `InvalidValue` naming the coordinate."""
    return Point(length(x, "x"), length(y, "y"), length(z, "z"))


def joints_of(a: str, b: str, c: str) -> Joints:
    """Return joints (rad, m, m); raises `InvalidValue` naming the joint."""
    return Joints(angle(a, "a"), length(b, "b"), length(c, "c"))


def share(text: str, key: str) -> float:
    """Return a ratio, 1 for 100 %; raises `InvalidValue` naming `key`."""
    return _quantity(text, key, _SHARES, phrase("a share is a number, or with % behind it"))


def duration(text: str, key: str) -> float:
    """Return a duration [s]; raises `InvalidValue` naming `key`."""
    return _quantity(text, key, _DURATIONS, phrase("a duration is a number in s, or with s, min, h or d behind it"))


def _quantity(text: str, key: str, units: dict[str, float], rule: str) -> float:
    found = _NUMBER.fullmatch(text.strip())
    if found is None or found[2] not in units:
        raise InvalidValue(key=key, value=repr(text), reason=rule)
    value = float(found[1]) * units[found[2]]
    if not isfinite(value):
        raise InvalidValue(key=key, value=repr(text), reason="it is not finite")
    return value


def _coordinate(text: str, key: str, value: float) -> float:
    if abs(value) > FARTHEST:
        raise InvalidValue(key=key, value=repr(text), reason=WITHIN)
    return value


def clock_factor(speed: float | None, address: str) -> float:
    """Return the speed of the twin's clock relative to real time, 1 by default.

    Raises `SpeedOnRealMachine` if `speed` is given for a real machine, and `InvalidValue` outside 0 < speed ≤ 1000.
    """
    if speed is not None and address != SIM:
        raise SpeedOnRealMachine(address=address)
    return console.clock_factor(speed)


def target_address(text: str, configured: str) -> str:
    """Return the meaning of an address: "sim", or HOST[:PORT]; for "real", the `configured` address.

    Raises `InvalidValue`.
    """
    if text != SIM:
        host_and_port(meant(text, configured), words=phrase("sim or real"))
    return meant(text, configured)
