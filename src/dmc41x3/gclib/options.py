"""The address string of GOpen: who is meant, by which sockets, and what besides answers is wanted.

| switch | meaning |
|---|---|
| `HOST`, `HOST:PORT`, `-a`, `--address` | the controller; a port behind it is ours, gclib has `--p1` |
| `-d`, `--direct` | without Galil's server gcaps; always so here |
| `-s`, `--subscribe` `NONE`, `MG`, `DR`, `EI`, `ALL` | messages, data records, interrupts; may be given several times |
| `-t`, `--timeout` MS | longest wait for an answer, 5000 |
| `--p1`, `--p2` PORT | for commands (23), and for what comes unasked (60007; on another `--p1` the same number) |
| `-c`, `--command` `TCP` | how commands go |
| `-u`, `--unsolicited` `UDP`, `TCP`, `NONE` | how the rest comes |
| `-b`, `--baud`, `--handshake` | for serial ports; read and left alone |
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TypeAlias

from dmc41x3.gclib.errors import Code, GclibError

PORT = 23
SECOND_PORT = 60007
TIMEOUT = 5000
"""Longest wait for an answer where the address says nothing [ms]."""

SUBSCRIPTIONS = ("MG", "DR", "EI")
_WAYS = ("UDP", "TCP", "NONE")


@dataclass(frozen=True, slots=True)
class AddressOptions:
    """What an address string says. `timeout` is in ms, `second_port` None where it is not said."""

    host: str = ""
    port: int = PORT
    second_port: int | None = None
    subscriptions: frozenset[str] = frozenset()
    unsolicited: str = "UDP"
    timeout: int = TIMEOUT

    @property
    def unsolicited_port(self) -> int:
        """The port that datagrams go to.

        A real controller takes any; something on another port than 23 is a twin, whose UDP has that number too.
        """
        if self.second_port is not None:
            return self.second_port
        return SECOND_PORT if self.port == PORT else self.port


_Taker: TypeAlias = Callable[[AddressOptions, str], AddressOptions]


def parse(address: str) -> AddressOptions:
    """Return what an address string says; raises `GclibError` (-10006) for one that is not understood."""
    options = AddressOptions()
    try:
        words = iter(shlex.split(address))
        for word in words:
            options = _take(options, word, words)
    except ValueError as error:
        raise _bad(str(error)) from error
    if not options.host:
        raise _bad("it names no controller")
    return options


def _take(options: AddressOptions, word: str, words: Iterator[str]) -> AddressOptions:
    if word in ("-d", "--direct"):
        return options
    if not word.startswith("-"):
        return _addressed(options, word)
    taker = _SWITCHES.get(word)
    value = next(words, None)
    if taker is None or value is None:
        raise _bad(f"{word} is not known" if taker is None else f"{word} lacks its value")
    return taker(options, value)


def _addressed(options: AddressOptions, word: str) -> AddressOptions:
    if options.host:
        raise _bad(f"{options.host} and {word} are two controllers")
    if word.upper().startswith(("COM", "GALILPCI", "/DEV/")):
        raise _bad(f"{word} is no network address")
    host, colon, port = word.rpartition(":")
    return replace(options, host=host, port=_number(port, 65535)) if colon else replace(options, host=word)


def _subscribed(options: AddressOptions, value: str) -> AddressOptions:
    name = value.upper()
    if name not in ("ALL", "NONE", *SUBSCRIPTIONS):
        raise _bad(f"{value} cannot be subscribed to")
    added = SUBSCRIPTIONS if name == "ALL" else () if name == "NONE" else (name,)
    return replace(options, subscriptions=options.subscriptions.union(added))


def _unsolicited(options: AddressOptions, value: str) -> AddressOptions:
    if value.upper() not in _WAYS:
        raise _bad(f"nothing comes unasked by {value}")
    return replace(options, unsolicited=value.upper())


def _command(options: AddressOptions, value: str) -> AddressOptions:
    if value.upper() != "TCP":
        raise _bad(f"commands do not go by {value}")
    return options


def _number(text: str, most: int) -> int:
    if not text.isdecimal() or int(text) > most:
        raise _bad(f"{text!r} is no number up to {most}")
    return int(text)


def _bad(detail: str) -> GclibError:
    return GclibError(Code.ADDRESS, detail)


_LONG: dict[str, _Taker] = {
    "--address": _addressed,
    "--baud": lambda options, _: options,
    "--command": _command,
    "--handshake": lambda options, _: options,
    "--p1": lambda options, value: replace(options, port=_number(value, 65535)),
    "--p2": lambda options, value: replace(options, second_port=_number(value, 65535)),
    "--subscribe": _subscribed,
    "--timeout": lambda options, value: replace(options, timeout=_number(value, 65535)),
    "--unsolicited": _unsolicited,
}
_SHORT = ("--address", "--baud", "--command", "--subscribe", "--timeout", "--unsolicited")
_SWITCHES: dict[str, _Taker] = {**_LONG, **{name[1:3]: _LONG[name] for name in _SHORT}}
