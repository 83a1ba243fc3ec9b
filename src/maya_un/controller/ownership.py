"""One owner of a controller at a time: a token in the controller says whose it is.

The token is the axis user variable ZAB: it is always there, no burn brings it back, and a reset makes it 0, which means
nobody's (Galil DMC-41x3, command ZA). An owner lives as long as its beat does, TIME written into `mayabeat` again and
again. The controller executes one command at a time, so every write here is one command that takes effect only while
the token has the value that its writer expects:

- a claim swaps the token only where it is still the one that was seen, with the same last beat;
- a beat, and whatever arms the guard, changes nothing once the token is somebody else's;
- an output changes in the same command that compares the token.

BG cannot carry a condition. So the new owner ends the connection of the old one (IH): what the old one sent too late
never arrives, not even from a host that slept between its proof and its BG.
"""

from __future__ import annotations

import asyncio
import getpass
import os
import platform
import secrets
from collections.abc import Awaitable, Callable
from typing import NamedTuple

from maya_un.controller.guard_program import BEAT, OUT, SAMPLES
from maya_un.controller.seek import brake
from maya_un.errors import CommandRejected, ControllerMoves, ControllerOwned, UnexpectedReply
from maya_un.galil.driver import Driver
from maya_un.galil.hardware import LETTERS
from maya_un.galil.numbers import parse_number

Moving = Callable[[], Awaitable[bool]]
"""Looks at the axes, and tells whether one of them moves."""

LOOK = 0.05
"""Time between two looks at a beat or at the axes [s]."""

SILENT = 1.0
"""An owner is taken for dead after so long without a beat [s], and not before twice the guard's time."""

REST_WITHIN = 15.0
"""Longest wait for the axes of a dead owner [s]: the longest guard time, and a stop."""

TELL = 0.1
"""A living owner hears of its loss for so long [s] before its connection ends."""

_NAMES = tuple(f"mayawho{place}" for place in range(1, 5))
_CHARACTERS = 6
_PROCESS, _HANDLE, _PEER, _PORT = "mayapid", "mayahand", "mayapeer", "mayaport"
_MOST = 10**9
_WRAP = 2**32


class Held(NamedTuple):
    """Whose the controller is: the `token` (0: nobody's), TIME now, and TIME of the last beat, None where none is."""

    token: int
    time: int
    beat: int | None

    @property
    def age(self) -> float:
        """Age of the last beat [s]: TIME wraps; without a beat it is infinite."""
        return float("inf") if self.beat is None else (self.time - self.beat) % _WRAP / SAMPLES


class Ownership:
    """This program's ownership of a controller; an owner stays it while silent for at most `patience` [s]."""

    def __init__(self, patience: float) -> None:
        self._patience = patience
        self.token = secrets.randbelow(_MOST - 1) + 1
        self.ours = f"(_ZAB={self.token})"
        self.theirs = f"(_ZAB<>{self.token})"

    @property
    def beat(self) -> str:
        """The command of a beat; it feeds nobody else's guard."""
        return self._kept(BEAT, "TIME")

    @property
    def arm(self) -> tuple[str, ...]:
        """The commands that begin the guard's time anew; the variables must be there."""
        return self.beat, f"{OUT}={self.theirs}*{OUT}"

    @property
    def first_arm(self) -> tuple[str, ...]:
        """The same where a reset took the variables; whose token is not there any more makes no guard patient."""
        return f"{BEAT}={self.ours}*TIME", f"{OUT}={self.theirs}"

    def output(self, bit: int, *, high: bool) -> str:
        """Return the command that sets or clears an output, and leaves it where the token is not ours."""
        return f"OB {bit},{self.ours}|@OUT[{bit}]" if high else f"OB {bit},{self.theirs}&@OUT[{bit}]"

    async def claim(self, driver: Driver, address: str, moving: Moving, *, take_over: bool = False) -> None:
        """Make the controller ours where it is nobody's, ours already, or its owner is silent and its axes rest.

        With `take_over` also from an owner that lives. Raises `ControllerOwned` for one that lives otherwise,
        `ControllerMoves` where its axes do not come to rest, and as the driver.
        """
        loop = asyncio.get_running_loop()
        latest = loop.time() + REST_WITHIN
        while True:
            held = await self.look(driver)
            if held.token not in (0, self.token) and not take_over:
                held = await self.silent(driver, held, address)
                if held is None:
                    continue
            alive = held.token not in (0, self.token) and held.age <= self._patience
            if held.token and await moving():
                await self._wait_for_rest(driver, now=alive, latest=latest)
            elif await self._swapped(driver, held, alive=alive):
                break
        if alive:
            await asyncio.sleep(TELL)
        await self._fence(driver)
        await self.sign(driver)
        if held.token and await moving():
            await brake(driver)
            while await moving():
                await self._wait_for_rest(driver, now=False, latest=latest)

    async def look(self, driver: Driver) -> Held:
        """Return whose the controller is now."""
        try:
            token, beat, time = await _numbers(driver, "_ZAB", BEAT, "TIME")
        except CommandRejected:
            token, time = await _numbers(driver, "_ZAB", "TIME")
            return Held(token, time, None)
        return Held(token, time, beat)

    async def did(self, driver: Driver, *commands: str) -> bool:
        """Send commands that hold while the controller is ours, and tell whether it was."""
        question = f"MG{self.ours}"
        answers = await driver.batch([*commands, question])
        return _number(answers[-1], question) == 1.0

    async def holds(self, driver: Driver) -> bool:
        """Tell whether the controller is ours now."""
        return await self.did(driver)

    async def holder(self, driver: Driver) -> str:
        """Return the name of the controller's owner for people, "" if nobody owns it."""
        if (await self.look(driver)).token == 0:
            return ""
        try:
            names = await driver.batch([f"MG {name}{{S{_CHARACTERS}}}" for name in _NAMES])
            (process,) = await _numbers(driver, _PROCESS)
        except CommandRejected:
            return "an unnamed program"
        return f"{''.join(names).strip()} (process {process})"

    async def sign(self, driver: Driver) -> None:
        """Write our name and connection into the controller, but never over those of another owner."""
        (handle,) = await _numbers(driver, "_IA3")
        letter = LETTERS[handle]
        mine = {
            **dict(zip(_NAMES, _packed(_own_name()), strict=True)),
            _PROCESS: str(os.getpid()),
            _HANDLE: str(handle),
            _PEER: f"_IH{letter}0",
            _PORT: f"_IH{letter}1",
        }
        try:
            await driver.batch([self._kept(name, value) for name, value in mine.items()])
        except CommandRejected:
            await driver.batch([f"{name}={self.ours}*{value}" for name, value in mine.items()])

    async def release(self, driver: Driver) -> None:
        """Make the controller nobody's, if it is ours."""
        await driver.send(f"ZAB={self.theirs}*_ZAB")

    def _kept(self, variable: str, value: str) -> str:
        """Return the command that gives a variable a value while the token is ours, and else its own."""
        return f"{variable}={self.ours}*{value}+({self.theirs}*{variable})"

    async def silent(self, driver: Driver, held: Held, address: str) -> Held | None:
        """Return what is held once its owner is silent, None where it has changed hands meanwhile.

        Raises `ControllerOwned` as soon as the owner beats.
        """
        while held.age <= self._patience:
            await asyncio.sleep(LOOK)
            newer = await self.look(driver)
            if newer.token != held.token:
                return None
            if newer.beat != held.beat:
                raise ControllerOwned(address=address, holder=await self.holder(driver) or "a program that is ending")
            held = newer
        return held

    async def _wait_for_rest(self, driver: Driver, *, now: bool, latest: float) -> None:
        """Wait until the next look at axes that move; raises `ControllerMoves` `now`, or behind the latest time."""
        if now or asyncio.get_running_loop().time() >= latest:
            raise ControllerMoves(address=driver.address, holder=await self.holder(driver) or "another program")
        await asyncio.sleep(LOOK)

    async def _swapped(self, driver: Driver, held: Held, *, alive: bool) -> bool:
        """Swap the token for ours if it is still as it was seen; begin to beat in the same breath."""
        same = f"(_ZAB={held.token})"
        if held.beat is not None and held.token and not alive:
            same += f"&({BEAT}={held.beat})"
        swap = f"ZAB={same}*({self.token}-{held.token})+_ZAB"
        arm = self.first_arm if held.beat is None else (self.beat,)
        return await self.did(driver, swap, *arm)

    async def _fence(self, driver: Driver) -> None:
        """End the connection of the owner until now, so that nothing it sent before arrives any more."""
        try:
            (handle,) = await _numbers(driver, _HANDLE)
            letter = LETTERS[handle]
            same, own = await _numbers(driver, f"(_IH{letter}0={_PEER})&(_IH{letter}1={_PORT})", "_IA3")
        except (CommandRejected, IndexError):
            return  # it left no name, or its handle is free
        if same and own != handle:
            await driver.send(f"IH{letter}=>-3")


async def living_owner(driver: Driver) -> str:
    """Return the name of the living owner, "" without one; writes nothing."""
    observer = Ownership(SILENT)
    try:
        (token,) = await _numbers(driver, "_ZAB")
        if token:
            await observer.silent(driver, await observer.look(driver), driver.address)
    except ControllerOwned as owned:
        return str(owned.details["holder"])
    except (CommandRejected, UnexpectedReply):
        pass  # it knows nothing of owners
    return ""


async def _numbers(driver: Driver, *operands: str) -> list[int]:
    """Return whole numbers, printed in a format of our own, so that VF cannot cut them."""
    command = f"MG {','.join(f'{operand}{{F10.0}}' for operand in operands)}"
    reply = await driver.send(command)
    words = reply.split()
    if len(words) != len(operands):
        raise UnexpectedReply(command=command, reply=reply)
    return [round(_number(word, command)) for word in words]


def _number(word: str, command: str) -> float:
    try:
        return parse_number(word)
    except ValueError as error:
        raise UnexpectedReply(command=command, reply=word) from error


def _own_name() -> str:
    try:
        user = getpass.getuser()
    except (OSError, KeyError):
        user = str(os.getuid())
    return f"{user}@{platform.node()}"


def _packed(name: str) -> list[str]:
    """Return a name as numbers: six characters are the six bytes of a variable (Galil DMC-41x3, strings)."""
    room = _CHARACTERS * len(_NAMES)
    data = "".join(character if " " < character <= "~" else "-" for character in name)[:room].encode("ascii")
    pieces = [data[place : place + _CHARACTERS].ljust(_CHARACTERS, b"\0") for place in range(0, room, _CHARACTERS)]
    return [f"${piece[:4].hex()}.{piece[4:].hex()}".upper() for piece in pieces]
