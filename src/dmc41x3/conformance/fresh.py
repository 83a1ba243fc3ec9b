"""Brings a controller on a bench to the state in which the table expects it, whatever was said to it before.

Settings are put back by commands, not by a master reset, which would take the network address as well. What no command
puts back (an armed latch, the clock) a reset does, when the settings have been burned.
"""

from __future__ import annotations

from collections.abc import Iterator

from dmc41x3.conformance.runner import ASK_AGAIN, SETTLE, ControllerChannel, Dial
from dmc41x3.conformance.vectors import fresh
from dmc41x3.language.commands import LINE_LIMIT
from dmc41x3.language.hardware import LETTERS

_PROMPTS = (b":", b"?")
_EMPTY = "DL\r\\"


def freshen(dial: Dial, axes: int) -> None:
    """Put every setting of a controller of `axes` axes back, and forget its program, variables and arrays.

    What a controller refuses is left as it is: the vectors will tell.
    """
    channel = dial()
    try:
        _freshen(channel, axes)
    finally:
        channel.close()


def restart(dial: Dial, axes: int) -> None:
    """Burn the settings of `freshen`, reset the controller and put them back; other connections end."""
    channel = dial()
    try:
        _freshen(channel, axes)
        for command in ("IHT=>-3", "BN", "BP", "BV"):
            _say(channel, [command])
        channel.send(b"RS\r")
        channel.ended()
    finally:
        channel.close()
    _await_answer(dial)
    freshen(dial, axes)


def _freshen(channel: ControllerChannel, axes: int) -> None:
    letters = LETTERS[:axes]
    _say(channel, ["HX", "ST", f"ST {letters}"])
    waited = 0.0
    asked = "|".join(f"_BG{letter}" for letter in letters)
    while _say(channel, [f"MG {asked}{{F1.0}}"]) != b" 0\r\n:" and waited < SETTLE:
        channel.wait(ASK_AGAIN)
        waited += ASK_AGAIN
    channel.send(_EMPTY.encode("ascii"))
    _prompts(channel, 2)
    for line in _packed(fresh()):
        _say(channel, line)


def _await_answer(dial: Dial) -> None:
    """Wait until a controller that resets itself can be talked to again."""
    waited = 0.0
    while waited < SETTLE:
        channel = dial()
        try:
            if _say(channel, ["NO"]) == b":":
                return
            channel.wait(ASK_AGAIN)
        finally:
            channel.close()
        waited += ASK_AGAIN


def _packed(commands: tuple[str, ...]) -> Iterator[list[str]]:
    """Yield commands by the line, as many as fit."""
    line: list[str] = []
    for command in commands:
        if len(";".join([*line, command])) > LINE_LIMIT:
            yield line
            line = []
        line.append(command)
    yield line


def _say(channel: ControllerChannel, commands: list[str]) -> bytes:
    """Send commands in one line and return what comes, up to their last prompt."""
    channel.send(f"{';'.join(commands)}\r".encode("ascii"))
    return _prompts(channel, len(commands))


def _prompts(channel: ControllerChannel, count: int) -> bytes:
    received = b""
    while sum(map(received.count, _PROMPTS)) < count:
        more = channel.receive()
        if not more:
            break
        received += more
    return received
