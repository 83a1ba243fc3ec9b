"""One owner of a controller at a time: a token in the controller identifies the owner.

The token is the axis user variable ZAB. It always exists, no burn restores it, and a reset makes it 0, which means no
owner (Galil DMC-41x3, command ZA). A living owner beats: it writes TIME into `mayabeat` periodically. The controller
executes one command at a time. So every write here is one command that takes effect only while the token has the value
that its writer expects:

- a claim swaps the token only if token and last beat are unchanged since they were read;
- a beat, or a command that arms the guard, changes nothing if the token belongs to another program;
- one command compares the token and changes the output.

BG cannot carry a condition. So the new owner closes the connection of the old owner (IH). Commands that the old owner
sent too late never arrive, even if its host was suspended between its check and its BG.
"""

from __future__ import annotations

import asyncio
import getpass
import os
import platform
import secrets
from collections.abc import Awaitable, Callable
from typing import NamedTuple

from dmc41x3.driver import Driver
from dmc41x3.i18n import phrase
from dmc41x3.language.hardware import LETTERS
from dmc41x3.language.numbers import parse_number
from maya_un.controller.seek import brake
from maya_un.controller.watchdog_program import BEAT, OUT, SAMPLES
from maya_un.errors import CommandRejected, ControllerMoves, ControllerOwned, UnexpectedReply

Moving = Callable[[], Awaitable[bool]]
"""Reads the axes, and returns whether one of them moves."""

LOOK = 0.05
"""Time between two reads of a beat or of the axes [s]."""

SILENT = 1.0
"""An owner counts as dead after this time without a beat [s], or after twice the guard's time if that is longer."""

REST_WITHIN = 15.0
"""Longest wait for the axes of a dead owner to rest [s]: the longest guard time, and the time of a stop."""

TELL = 0.1
"""A living owner has this time to notice its loss [s] before its connection ends."""

_NAMES = tuple(f"mayawho{place}" for place in range(1, 5))
_CHARACTERS = 6
_PROCESS, _HANDLE, _PEER, _PORT = "mayapid", "mayahand", "mayapeer", "mayaport"
_MOST = 10**9
_WRAP = 2**32


class OwnershipReading(NamedTuple):
    """Ownership as read: the `token` (0: no owner), TIME now, and TIME of the last beat (None: never)."""

    token: int
    time: int
    beat: int | None

    @property
    def age(self) -> float:
        """Age of the last beat [s], across a wrap of TIME; infinite without a beat."""
        return float("inf") if self.beat is None else (self.time - self.beat) % _WRAP / SAMPLES


class Ownership:
    """This program's ownership of a controller; an owner may be silent for at most `patience` [s]."""

    def __init__(self, patience: float) -> None:
        self._patience = patience
        self.token = secrets.randbelow(_MOST - 1) + 1
        self.ours = f"(_ZAB={self.token})"
        self.theirs = f"(_ZAB<>{self.token})"

    @property
    def beat(self) -> str:
        """The command of a beat; it has no effect on the guard of another owner."""
        return self._kept(BEAT, "TIME")

    @property
    def arm(self) -> tuple[str, ...]:
        """The commands that restart the guard's time; the variables must exist."""
        return self.beat, f"{OUT}={self.theirs}*{OUT}"

    @property
    def first_arm(self) -> tuple[str, ...]:
        """The same after a reset removed the variables; without this program's token they do not restart the time."""
        return f"{BEAT}={self.ours}*TIME", f"{OUT}={self.theirs}"

    def output(self, bit: int, *, high: bool) -> str:
        """Return the command that sets or clears an output.

        It has no effect unless this program owns the controller.
        """
        return f"OB {bit},{self.ours}|@OUT[{bit}]" if high else f"OB {bit},{self.theirs}&@OUT[{bit}]"

    async def claim(self, driver: Driver, address: str, moving: Moving, *, take_over: bool = False) -> None:
        """Claim the controller if it has no owner, is already this program's, or its owner is silent and its axes rest.

        `take_over` claims it from a living owner too. Otherwise raises `ControllerOwned` for a living owner. Also
        raises `ControllerOwned` if another program took it over meanwhile, `ControllerMoves` if the axes do not come to
        rest, and the errors of the driver.
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
        if not await self.sign(driver):  # taken over before it had our connection: the next owner could not close it
            raise ControllerOwned(address=address, holder=await self.holder(driver) or "a program that is ending")
        if held.token and await moving():
            await brake(driver)
            while await moving():
                await self._wait_for_rest(driver, now=False, latest=latest)

    async def look(self, driver: Driver) -> OwnershipReading:
        """Read the present ownership."""
        try:
            token, beat, time = await _numbers(driver, "_ZAB", BEAT, "TIME")
        except CommandRejected:
            token, time = await _numbers(driver, "_ZAB", "TIME")
            return OwnershipReading(token, time, None)
        return OwnershipReading(token, time, beat)

    async def did(self, driver: Driver, *commands: str) -> bool:
        """Send commands that take effect only if this program owns the controller; return whether it does."""
        question = f"MG{self.ours}"
        answers = await driver.batch([*commands, question])
        return _number(answers[-1], question) == 1.0

    async def holds(self, driver: Driver) -> bool:
        """Return whether this program owns the controller now."""
        return await self.did(driver)

    async def holder(self, driver: Driver) -> str:
        """Return the owner's name for display, "" without an owner."""
        if (await self.look(driver)).token == 0:
            return ""
        try:
            names = await driver.batch([f"MG {name}{{S{_CHARACTERS}}}" for name in _NAMES])
            (process,) = await _numbers(driver, _PROCESS)
        except CommandRejected:
            return phrase("an unnamed program")
        return _named("".join(names).strip(), process)

    async def successor(self, driver: Driver) -> str:
        """Return the name of the program that took the controller over, "" without an owner.

        A new owner signs only after it has closed this program's connection. Until then the controller stores this
        program's name, and the result is "not yet named".
        """
        holder = await self.holder(driver)
        return phrase("not yet named") if holder == _named(_written(_own_name()), os.getpid()) else holder

    async def sign(self, driver: Driver) -> bool:
        """Write this program's name and connection into the controller if it is the owner; return whether it is.

        After that, the next owner can close this connection, so that commands sent too late never arrive.
        """
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
            return await self.did(driver, *(self._kept(name, value) for name, value in mine.items()))
        except CommandRejected:
            return await self.did(driver, *(f"{name}={self.ours}*{value}" for name, value in mine.items()))

    async def release(self, driver: Driver) -> None:
        """Release the controller, if this program owns it."""
        await driver.send(f"ZAB={self.theirs}*_ZAB")

    def _kept(self, variable: str, value: str) -> str:
        """Return the command that sets a variable if this program owns the controller, and else does not change it."""
        return f"{variable}={self.ours}*{value}+({self.theirs}*{variable})"

    async def silent(self, driver: Driver, held: OwnershipReading, address: str) -> OwnershipReading | None:
        """Return the ownership once the owner is silent, None if the owner has changed.

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
        """Wait before the next read of moving axes.

        Raise `ControllerMoves` if `now` or after loop time `latest` [s].
        """
        if now or asyncio.get_running_loop().time() >= latest:
            raise ControllerMoves(address=driver.address, holder=await self.holder(driver) or "another program")
        await asyncio.sleep(LOOK)

    async def _swapped(self, driver: Driver, held: OwnershipReading, *, alive: bool) -> bool:
        """Replace the token by this program's if it is unchanged, and send the first beat.

        Return whether it succeeded.
        """
        same = f"(_ZAB={held.token})"
        if held.beat is not None and held.token and not alive:
            same += f"&({BEAT}={held.beat})"
        swap = f"ZAB={same}*({self.token}-{held.token})+_ZAB"
        arm = self.first_arm if held.beat is None else (self.beat,)
        return await self.did(driver, swap, *arm)

    async def _fence(self, driver: Driver) -> None:
        """Close the connection of the former owner, so its late commands never arrive."""
        letter = await self._former_handle(driver)
        if letter is None:
            return
        try:
            await driver.send(f"IH{letter}=>-3")
        except CommandRejected:
            if await self._former_handle(driver) is not None:
                raise  # otherwise the connection has ended in between

    async def _former_handle(self, driver: Driver) -> str | None:
        """Return the letter of the handle on which the former owner is connected, None if there is none."""
        try:
            (handle,) = await _numbers(driver, _HANDLE)
            letter = LETTERS[handle]
            same, own = await _numbers(driver, f"(_IH{letter}0={_PEER})&(_IH{letter}1={_PORT})&{self.ours}", "_IA3")
        except (CommandRejected, IndexError):
            return None  # it did not sign, or its handle is free
        return letter if same and own != handle else None


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
        pass  # the device does not have these variables
    return ""


async def _numbers(driver: Driver, *operands: str) -> list[int]:
    """Return whole numbers, printed in an explicit format, because VF could truncate them."""
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


def _written(name: str) -> str:
    """Return a name in the characters and length that the controller can store."""
    return "".join(character if " " < character <= "~" else "-" for character in name)[: _CHARACTERS * len(_NAMES)]


def _named(name: str, process: int) -> str:
    """Return a program for display."""
    return phrase("{name} (process {number})", name=name, number=process)


def _packed(name: str) -> list[str]:
    """Return a name as numbers: six characters are the six bytes of a variable (Galil DMC-41x3, strings)."""
    room = _CHARACTERS * len(_NAMES)
    data = _written(name).encode("ascii")
    pieces = [data[place : place + _CHARACTERS].ljust(_CHARACTERS, b"\0") for place in range(0, room, _CHARACTERS)]
    return [f"${piece[:4].hex()}.{piece[4:].hex()}".upper() for piece in pieces]
