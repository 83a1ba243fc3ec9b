"""A fresh twin in the place of the controller that was recorded, and the recorded commands said to it again."""

from __future__ import annotations

import asyncio
from typing import NamedTuple

from pydantic import TypeAdapter

from dmc41x3.language.hardware import LETTERS
from dmc41x3.language.record import AxisRecord
from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.wire.server import VirtualController
from dmc41x3.wire.transcript import WirePiece
from dmc41x3.wire.transport import LoopbackTransport
from maya_un.cli.recordings.scene import ReplayScene, commands_before, forget_stop_codes, scene_of
from maya_un.config import Config, Units
from maya_un.config.files import parse
from maya_un.machine.mechanics import MayaMechanics
from maya_un.machine.truth import StartPose, TrueConstants
from maya_un.recorder.exchanges import RecordedTalk, talk
from maya_un.recorder.recording import Recording, TwinSource

_PAST = 1e-5
"""A switch is tripped, or not, by so much [rad, m]."""

_SETTLE = 0.01
"""So long is waited for what the twin has to say [s, virtual]."""


class Replayed(NamedTuple):
    """Both runs, taken apart, with the same times; `lacks` as in `ReplayScene`."""

    recorded: RecordedTalk
    replayed: RecordedTalk
    begin: float
    lacks: tuple[str, ...]


async def replay(recording: Recording) -> Replayed:
    """Say the recorded commands to a fresh twin, each at its time; raises `ValueError` where there is no beginning.

    For a loop whose clock jumps.
    """
    scene = scene_of(recording)
    twin = _twin(recording, scene)
    try:
        pieces = await _Player(twin, scene, parse(recording.header.origin.config)).play()
    finally:
        await twin.close()
    recorded = talk(scene.pieces)
    if scene.record is not None:
        forget_stop_codes(recorded.exchanges)
    return Replayed(recorded, talk(pieces), scene.begin, scene.lacks)


def _twin(recording: Recording, scene: ReplayScene) -> VirtualController:
    header = recording.header
    config, source = parse(header.origin.config), header.origin.twin
    truth = _truth(source, config)
    start = _start(source, scene, config, truth)
    parts = {} if source is None else {name: (place[0], place[1], place[2]) for name, place in source.parts.items()}
    mechanics = MayaMechanics(truth, start, parts=parts)
    machine = VirtualDmc(mechanics, firmware=header.firmware or None)
    if source is not None:
        machine.advance(scene.begin - source.born - _SETTLE)  # what its programs do depends on its clock
    return VirtualController(machine, seed=0 if source is None else source.seed)


def _truth(source: TwinSource | None, config: Config) -> TrueConstants:
    """Return what the twin is made of: what the recorded one was, else what the configuration says of the machine."""
    if source is not None:
        return TypeAdapter(TrueConstants).validate_python(source.truth)
    geometry, scale, axes = config.geometry, config.scale, config.axes
    a, b, c = ((axis.minimum, axis.maximum) for axis in (axes.a, axes.b, axes.c))
    machine = TrueConstants(
        height=geometry.height,
        length=geometry.length,
        delta=geometry.delta,
        gripper_height=geometry.gripper_height,
        counts_per_degree=scale.pulses_per_degree,
        counts_per_metre=scale.pulses_per_metre,
        switches=(a, b, c),
        torque_per_load=config.homing.torque_per_load,
        self_locking=config.safety.self_locking,
        gripper_output=config.gripper.output,
        gripper_closes_on=config.gripper.closed_by == "set",
    )
    return machine.with_wiring(config.wiring.limit_active_level == 1)


def _start(source: TwinSource | None, scene: ReplayScene, config: Config, truth: TrueConstants) -> StartPose:
    """Return where the twin stands: as its counts say once homed, on the switches that were active."""
    record = scene.record
    if source is not None and not scene.homed:
        return StartPose(*source.start)
    if record is None:
        return StartPose()
    axes = [record.axes[LETTERS.index(config.axes[axis].letter)] for axis in range(3)]
    a, b, c = (axis.reference for axis in axes)
    places = Units.of(config).to_joints((a, b, c)) if scene.homed else StartPose()
    return StartPose(*(_beside(places[i], axes[i], truth.switches[i]) for i in range(3)))


def _beside(place: float, axis: AxisRecord, switches: tuple[float, float]) -> float:
    """Return a place [rad or m] at which the limit switches read as the record says, next to the one given."""
    reverse, forward = switches
    if axis.reverse_limit_active:
        return min(place, reverse - _PAST)
    if axis.forward_limit_active:
        return max(place, forward + _PAST)
    return min(max(place, reverse + _PAST), forward - _PAST)


_TURNS = 8
"""Turns of the loop in which a twin has answered what it was told at the same instant."""


class _Player:
    """Says the pieces of a scene to a twin, and keeps both sides of what is said then."""

    def __init__(self, twin: VirtualController, scene: ReplayScene, config: Config) -> None:
        self._twin = twin
        self._scene = scene
        self._config = config
        self._loop = asyncio.get_running_loop()
        self._zero = self._loop.time()
        self._links: dict[int, LoopbackTransport] = {}
        self._readers: dict[int, asyncio.Task[None]] = {}
        self._said: list[WirePiece] = []

    async def play(self) -> list[WirePiece]:
        """Return all that was said, with the times of the recording."""
        scene = self._scene
        try:
            await self._prepare()
            self._zero = self._loop.time()
            for piece in scene.pieces:
                await self._until(piece.time)
                await self._do(piece)
            await self._until(scene.pieces[-1].time if scene.pieces else scene.begin)
            await asyncio.sleep(_SETTLE)
        finally:
            for link in list(self._links):
                await self._end(link)
        return self._said

    async def _prepare(self) -> None:
        """Make the twin what the controller was: what configured it, then the state in which the scene begins.

        It is said over the connection that the scene goes on with, for that is where programs send their messages.
        """
        scene = self._scene
        if scene.record is None or not scene.pieces:
            return
        first = scene.pieces[0]
        self._open(first.link)
        end = self._links[first.link]
        end.write(commands_before(scene, self._config))
        await asyncio.sleep(_SETTLE)
        if first.event == "open":
            await self._end(first.link)
        self._said.clear()

    async def _until(self, time: float) -> None:
        left = self._zero + (time - self._scene.begin) - self._loop.time()
        if left > 0.0:
            await asyncio.sleep(left)

    async def _do(self, piece: WirePiece) -> None:
        if piece.event == "end":
            for _ in range(_TURNS):
                await asyncio.sleep(0)
            await self._end(piece.link)
            return
        if piece.event == "open":
            self._said.append(piece)
        if piece.link not in self._links:
            self._open(piece.link)
        if piece.side == "client" and piece.data:
            self._said.append(piece)
            self._links[piece.link].write(piece.data)

    def _open(self, link: int) -> None:
        self._links[link] = end = self._twin.loopback()
        self._readers[link] = self._loop.create_task(self._read(link, end))

    async def _read(self, link: int, end: LoopbackTransport) -> None:
        while data := await end.read():
            time = self._scene.begin + (self._loop.time() - self._zero)
            self._said.append(WirePiece(time, link, "controller", data))

    async def _end(self, link: int) -> None:
        end, reader = self._links.pop(link, None), self._readers.pop(link, None)
        if end is not None and reader is not None:
            reader.cancel()
            await asyncio.wait({reader})
            await end.close()
