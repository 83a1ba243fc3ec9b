"""Another program changes what safety stands on, in motion, at rest and in homing; the mechanics judge it."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, suppress
from operator import le
from random import Random
from typing import NamedTuple

import pytest

from dmc41x3.loops import run_virtual
from maya_un.controller.registers import MEANING, operands
from maya_un.errors import (
    Faulted,
    MayaError,
    NotHomed,
)
from maya_un.machine.truth import StartPose
from maya_un.testing import Rig, rig
from maya_un.values import Joints, Mode
from tests.calm import SELDOM_BEATING
from tests.campaign import Campaign
from tests.homing_mark import take_over
from tests.virtual_time import elapse

HERE, FAR = Joints(0.3, 1.5, 1.3), Joints(1.0, 1.2, 1.6)
TOUCH = 0.02
"""[s]"""

LOADS = 2.0
"""No line carries more, whatever another program commands."""

VALUES = {
    "LD": "3",
    "OE": "0",
    "ER": "2000000",
    "VR": "10",
    "VS": "400000",
    "VA": "1048576",
    "VD": "1024",
    "CN0": "CN 1",
    "TL": "9.9",
    "TK": "9.9",
    "GR": "0.5",
    "OF": "1",
    "TM": "TM 500",
    "CN3": "CN ,,,1",
    "SP": "2000000",
    "AC": "1048576",
    "DC": "1024",
    "SD": "1024",
    "FL": "0",
    "BL": "3000000",
    "MT": "-1",
    "CE": "2",
    "DV": "1",
    "AF": "1",
    "KP": "0",
    "KI": "1",
    "KD": "0",
    "IT": "0.5",
    "PT": "1",
    "FV": "100",
    "BR": "-1",
    "FA": "10",
    "IL": "1",
    "PL": "0.5",
    "GM": "1",
    "NB": "10",
    "NF": "50",
    "NZ": "1",
    "OA": "1",
    "OT": "100",
    "OV": "0.1",
    "BW": "100",
}
"""Values that another program writes into each register."""

NAMED = frozenset({2312})
MOVED = frozenset({2311, 2313})


class Case(NamedTuple):
    """A command of another program, the codes that may name it, and whether the homing is void then."""

    name: str
    commands: tuple[str, ...]
    codes: frozenset[int]
    void: bool | None = None


def registers() -> Iterator[Case]:
    """Yield a change of every register that safety stands on."""
    for group in operands():
        for operand in group:
            name = operand[1:]
            register = name if name in VALUES else name[:2]
            value = VALUES[register]
            command = value if " " in value else f"{register} {value}" if name[2:] == "S" else f"{name}={value}"
            yield Case(name, (command,), NAMED, True if register in MEANING else None)


def actions() -> Iterator[Case]:
    """Yield other things that a program may do to the axes."""
    for axis, way in (("A", 2000), ("B", 60_000), ("C", 60_000)):
        yield Case(f"define {axis}", (f"DP{axis}=123456",), MOVED, True)
        yield Case(f"define {axis} a little", (f"DP{axis}=_RP{axis}+100",), MOVED, True)
        for sign in (-1, 1):
            yield Case(f"jog {axis} {sign:+}", (f"JG{axis}={sign * way}", f"BG{axis}"), MOVED | NAMED, True)
            fast = (f"AC{axis}=67107840", f"JG{axis}={sign * way * 20}", f"BG{axis}")
            yield Case(f"jog {axis} {sign:+} fast", fast, MOVED | NAMED | {2302, 2306}, None)
            yield Case(f"move {axis} {sign:+}", (f"PR{axis}={sign * way}", f"BG{axis}"), MOVED, True)
            yield Case(f"shift {axis} {sign:+}", (f"IP{axis}={sign * way // 20}",), MOVED, True)
        yield Case(f"motor {axis} off", (f"MO{axis}",), frozenset({2306, 2301}))  # it may coast onto its switch
        geared = (f"GA{axis}={'B' if axis != 'B' else 'C'}", f"GR{axis}=-1")
        yield Case(f"gear {axis}", geared, NAMED | MOVED | {2302, 2306})  # the boom cannot follow a line's pace
    lines = ("CS S", "LM BC", "VS 40000", "VA 102400", "VD 102400", "LI -60000,-60000", "LE", "BGS")
    yield Case("sequence of the lines", lines, MOVED | NAMED, None)


CASES = {case.name: case for case in (*registers(), *actions())}
PHASES = ("at rest", "in motion", "the boom in motion", "in homing")


def test_every_safety_register_is_tried() -> None:
    assert {name for group in operands() for name in group} <= {f"_{name}" for name in CASES}


@pytest.mark.timeout(7200)
@pytest.mark.parametrize("phase", PHASES)
def test_every_change_in_every_phase_is_named_and_harmless(phase: str, campaign: Campaign) -> None:
    wrong: list[str] = []
    for number, case in enumerate(campaign.some(list(CASES.values()), ci=2)):
        try:
            run_virtual(_trial(case, phase, campaign.rng(number)))
        except AssertionError as found:
            wrong.append(str(found))
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize(
    ("name", "phase"),
    [
        ("define B", "at rest"),
        ("define C a little", "at rest"),
        ("define B", "the boom in motion"),
        ("jog B -1", "at rest"),
        ("jog B -1", "in homing"),
        ("jog C -1 fast", "in homing"),
        ("VRS", "in motion"),
        ("LDB", "at rest"),
        ("OEB", "at rest"),
        ("TM", "at rest"),
        ("CEB", "at rest"),
        ("sequence of the lines", "at rest"),
    ],
)
def test_change_by_another_program_is_named_and_harmless(name: str, phase: str, campaign: Campaign) -> None:
    run_virtual(_trial(CASES[name], phase, campaign.rng()))


@asynccontextmanager
async def _robot(phase: str) -> AsyncIterator[Rig]:
    start = StartPose(1.0, 1.5, 1.6) if phase == "in homing" else StartPose(*HERE)
    async with rig(SELDOM_BEATING, start=start, live=True) as bench:
        if phase != "in homing":
            await take_over(bench.controller, bench.virtual, HERE)
        yield bench


def _say(bench: Rig, *commands: str) -> bytes:
    """Say commands as another program does, through a connection of its own; return the answers."""
    machine = bench.virtual.machine
    handle = machine.connect()
    assert handle is not None
    answers = b"".join(machine.receive(handle, f"{command}\r".encode(), machine.now) for command in commands)
    machine.disconnect(handle)
    return answers


async def _begun(bench: Rig, phase: str, rng: Random) -> asyncio.Task[None] | None:
    """Begin what the phase is about, and wait until it is under way."""
    controller = bench.controller
    if phase == "at rest":
        await elapse(rng.uniform(0.0, 1.0))
        return None
    if phase == "in homing":
        moving = asyncio.create_task(controller.home())
        await elapse(rng.uniform(1.0, 180.0))
        return moving
    moving = asyncio.create_task(controller.move(FAR if phase == "in motion" else HERE._replace(a=1.2)))
    await elapse(rng.uniform(2.0, 7.0))
    return moving


async def _trial(case: Case, phase: str, rng: Random) -> None:
    async with _robot(phase) as bench:
        moving = await _begun(bench, phase, rng)
        where = f"{case.name} {phase} at {bench.virtual.machine.now:.3f} s"
        mark = bench.mechanics.record.mark()
        homed = bench.controller.state.homed
        answers = _say(bench, *case.commands)
        taken = b"?" not in answers
        await elapse(3.0)
        code = 0
        if moving is not None:
            try:
                await moving
            except MayaError as error:
                code = error.code
        if bench.controller.state.fault is not None:
            code = bench.controller.state.fault.code
        if taken:
            assert code in case.codes, f"{where}: {code} {bench.controller.state.fault}"
            assert bench.controller.state.mode is Mode.FAULT, where
            if code in NAMED:
                named = str(bench.controller.state.fault)
                registers = {"SP" if command[:2] == "JG" else command[:2] for command in case.commands}
                assert any(register in named for register in registers), f"{where}: {named}"
            if case.void and homed:
                assert not bench.controller.state.homed, where
            with pytest.raises((Faulted, NotHomed)):
                await bench.controller.move(HERE)
        with suppress(MayaError):
            await bench.controller.recover()
        await elapse(2.0)
        seen = bench.mechanics.record.since(mark)
        assert seen.tension <= LOADS, f"{where}: {seen.tension:.2f} loads"
        # Before the boom is homed only its switch and ER bound what it does: it may touch its end until ER trips
        touch = (TOUCH if phase == "in homing" else 0.0, 0.0, 0.0)
        assert all(map(le, seen.stalled, touch)), f"{where}: stalled {seen.stalled}"
        assert not bench.controller.state.moving, where
