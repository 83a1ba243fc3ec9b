"""The guard in the controller against hosts that die, hang, or are merely slow; the mechanics say what happened."""

from __future__ import annotations

import asyncio
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from random import Random

import pytest

from dmc41x3.loops import run_virtual
from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.wire.server import VirtualController
from dmc41x3.wire.transport import Transport
from maya_un.assembly.controller import Twin, make_twin
from maya_un.config import Config, Units
from maya_un.controller.controller import GalilController
from maya_un.controller.watchdog import BEATS
from maya_un.errors import HostSilent
from maya_un.machine.mechanics import MayaMechanics
from maya_un.machine.truth import StartPose
from maya_un.values import Joints
from tests.campaign import Campaign
from tests.system.processes import Wire, done, running
from tests.virtual_time import elapse

GUARD_TIME = Config().safety.guard_time
LATEST = 0.010
"""The guard may take so much longer than its time until the axes brake [s]."""
SAMPLES = 1024.0
HERE = Joints(0.3, 1.5, 1.3)
PLACES = (Joints(0.35, 1.45, 1.35), Joints(0.5, 1.52, 1.36), Joints(0.32, 1.4, 1.42))


@contextmanager
def served(seed: int) -> Iterator[tuple[Twin, str]]:
    """Serve a twin on TCP in real time, in a thread of its own."""
    ready = threading.Event()
    found: list[object] = []

    async def serve() -> None:
        twin = make_twin(seed=seed)
        host, port = await twin.controller.serve()
        over = asyncio.Event()
        found.extend((twin, f"{host}:{port}", asyncio.get_running_loop(), over))
        ready.set()
        await over.wait()
        await twin.controller.close()

    thread = threading.Thread(target=lambda: asyncio.run(serve()))
    thread.start()
    assert ready.wait(10.0)
    twin, address, loop, over = found
    assert isinstance(twin, Twin)
    assert isinstance(loop, asyncio.AbstractEventLoop)
    assert isinstance(over, asyncio.Event)
    try:
        yield twin, str(address)
    finally:
        loop.call_soon_threadsafe(over.set)
        thread.join()


def off_the_line(start: list[float], end: list[float], segment: list[float]) -> float:
    """Return how far `end` lies off the line from `start` along `segment` [counts]."""
    way = [there - here for here, there in zip(start, end, strict=True)]
    length = sum(delta * delta for delta in segment)
    share = sum(one * delta for one, delta in zip(way, segment, strict=True)) / length
    return max(abs(one - share * delta) for one, delta in zip(way, segment, strict=True))


@pytest.mark.system
@pytest.mark.parametrize("death", [signal.SIGKILL, signal.SIGSTOP], ids=["killed", "stopped"])
def test_axes_brake_on_their_path_when_the_host_is_gone(death: signal.Signals) -> None:
    """The controller's own clock tells when, so it does not matter how busy this machine is."""
    with served(seed=5) as (twin, address), Wire(address) as wire:
        segments: list[str] = []
        twin.controller.tap = lambda _, way, data: segments.extend(_segments(data) if way == "rx" else ())
        with running(f"up --port 0 --address {address}") as up:
            up.until("maya home")
            with running("home"):
                wait_for(wire, "_BGS", 1.0)
                segment = [float(part or 0) for part in (segments[-1] + ",,").split(",")[:3]]
                start = wire.numbers("_RPA,_RPB,_RPC")
                outputs, motors = wire.numbers("_OP0"), wire.numbers("_MOA,_MOB,_MOC")
                gripper = twin.mechanics.record.gripper_closed
                gone = wire.numbers("TIME")[0]
                up.send(death)
                beat, braked = _braking(wire, twin)
                assert beat <= gone + 2.0 * GUARD_TIME / BEATS * SAMPLES
                assert (braked - beat) / SAMPLES <= GUARD_TIME + LATEST
                assert (braked - beat) / SAMPLES >= GUARD_TIME - 1.0 / SAMPLES
                wait_for(wire, "_BGS", 0.0)
                assert wire.numbers("_SCB") == [4.0]
                assert off_the_line(start, wire.numbers("_RPA,_RPB,_RPC"), segment) <= 2.0
                assert (wire.numbers("_OP0"), wire.numbers("_MOA,_MOB,_MOC")) == (outputs, motors)
                assert twin.mechanics.record.gripper_closed is gripper
                assert not twin.mechanics.record.drops


@pytest.mark.waits("1.5 s: 0.5 s until the guard stops the axes, and 1 s until the killed owner counts as dead")
@pytest.mark.system
def test_pause_of_a_dead_host_does_not_resume_under_another() -> None:
    with served(seed=5) as (twin, address), Wire(address) as wire:
        mark(twin, wire)
        with running(f"up --port 0 --skip-home --address {address}") as up:
            up.until("maya home")
            with running("jog r -500mm"):
                wait_for(wire, "_BGS", 1.0)
                code, said = done("pause")
                assert (code, "maya resume" in said) == (0, True)
                wait_for(wire, "_VMS", 0.0)
                assert wire.numbers("_BGS") == [1.0]
                stands = wire.numbers("_RPA,_RPB,_RPC")
                up.send(signal.SIGKILL)
                wait_for(wire, "_BGS", 0.0)
                assert wire.numbers("_SCB") == [4.0]
        with running(f"up --port 0 --skip-home --address {address}") as up:
            up.until("maya home")
            begun = wire.time
            while wire.time < begun + 1.5:
                assert wire.numbers("_RPA,_RPB,_RPC,_BGS") == [*stands, 0.0]
            assert done("resume")[0] == 1
            assert wire.numbers("_RPA,_RPB,_RPC") == stands
            assert not twin.mechanics.record.drops


def mark(twin: Twin, wire: Wire) -> None:
    """Leave the mark of a homing, with counts that are true."""
    a, b, c = Units.of(Config()).to_counts(Joints(*twin.mechanics.true_joints()))
    for command in (f"DP {a},{b},{c}", "mayaendb=2260000", "mayaendc=2300000", "ZAA=7", "mayahome=7"):
        wire.say(command)


def _segments(data: bytes) -> list[str]:
    words = data.decode("ascii", "replace").replace(";", "\r").split("\r")
    return [word.removeprefix("LI ") for word in words if word.startswith("LI ")]


def wait_for(wire: Wire, operand: str, value: float) -> None:
    """Wait until an operand has a value, by the controller's own clock."""
    latest = wire.time + 20.0
    while wire.numbers(operand) != [value]:
        assert wire.time < latest, f"{operand} never was {value}"


def _braking(wire: Wire, twin: Twin) -> tuple[float, float]:
    """Return TIME of the host's last beat and of the instant at which the sequence began to brake."""
    latest = wire.time + 5.0
    while True:
        beat, code = wire.numbers("mayabeat,_SCB")
        if code == 4.0:
            pieces = [piece for line in twin.mechanics.timelines for piece in line.pieces]
            return beat, max(piece.t for piece in pieces if piece.v * piece.a < 0.0) * SAMPLES
        assert wire.time < latest, "the axes never braked"


class Stalling:
    """A transport whose writer is blocked at times; delayed bytes go out afterwards."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport
        self._held: list[bytes] | None = None

    @property
    def peer(self) -> str:
        return self._transport.peer

    async def read(self) -> bytes:
        return await self._transport.read()

    def write(self, data: bytes) -> None:
        if self._held is None:
            self._transport.write(data)
        else:
            self._held.append(data)

    async def close(self) -> None:
        await self._transport.close()

    async def stall(self, seconds: float) -> None:
        self._held = []
        await elapse(seconds)
        held, self._held = self._held, None
        for data in held:
            self._transport.write(data)


async def _trial(rng: Random, silence: float) -> tuple[BaseException | None, MayaMechanics]:
    """Move while the host is held up now and then, never longer than `silence` [s]; return how it ended.

    A host held up for longer than a reply may take (2 s) would find its link lost instead.
    """
    mechanics = MayaMechanics(start=StartPose(*HERE))
    virtual = VirtualController(VirtualDmc(mechanics))
    lines: list[Stalling] = []

    async def dial() -> Transport:
        lines.append(Stalling(virtual.loopback()))
        return lines[-1]

    controller = GalilController(dial, "twin", Config(), live=True)
    await controller.open()
    a, b, c = controller.units.to_counts(HERE)
    handle = virtual.machine.connect()
    assert handle is not None
    mark = f"DP {a},{b},{c};mayaendb=2260000;mayaendc=2300000;ZAA=7;mayahome=7\r"
    virtual.machine.receive(handle, mark.encode(), virtual.machine.now)
    await controller.skip_home()
    move = asyncio.create_task(controller.move(rng.choice(PLACES), speed=rng.uniform(0.3, 1.0)))
    await elapse(rng.uniform(0.1, 0.6))
    while not move.done():
        await lines[-1].stall(rng.uniform(0.2, 1.0) * silence)
        await elapse(rng.uniform(0.03, 0.6))
    error = move.exception()
    await controller.close()
    await virtual.close()
    return error, mechanics


def test_a_host_that_is_merely_slow_is_never_stopped(campaign: Campaign) -> None:
    """The beat before a stall is at most a period old, so a stall may last the guard's time but a period."""
    longest = GUARD_TIME * (1.0 - 1.0 / BEATS) - 2.0 / SAMPLES
    for case in range(campaign.size(ci=15, long=300)):
        error, mechanics = run_virtual(_trial(campaign.rng(case), longest))
        assert error is None, f"case {case}: {error}"
        assert not mechanics.record.drops


def test_a_host_that_is_too_slow_is_stopped(campaign: Campaign) -> None:
    for case in range(campaign.size(ci=10, long=100)):
        rng = campaign.rng(case)
        error, mechanics = run_virtual(_trial(rng, 3.0 * GUARD_TIME))
        assert isinstance(error, HostSilent), f"case {case}: {error}"
        assert not mechanics.record.drops
