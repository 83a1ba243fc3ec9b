"""A controller on a twin, with the flight recorder."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.wire.server import VirtualController
from dmc41x3.wire.transport import Transport
from maya_un.config import Config, RecorderConfig, Units
from maya_un.controller.controller import GalilController
from maya_un.machine.mechanics import MayaMechanics
from maya_un.machine.truth import StartPose, TrueConstants
from maya_un.recorder.recorder import Recorder
from maya_un.recorder.recording import RecordingOrigin, TwinSource
from maya_un.recorder.store import RecordingStore
from maya_un.values import Joints
from tests.calm import SELDOM_BEATING

HERE = Joints(0.3, 1.5, 1.3)
"""Position of the homed robot when a test begins."""

UTC = 1_795_289_120_339_000_000
"""Time of the tests' clock: 2026-11-21T19:25:20.339Z, in ns."""


def recording_store(folder: Path) -> RecordingStore:
    """Return the recordings in a folder."""
    return RecordingStore(folder, 50, 500_000_000, lambda: UTC)


@dataclass(frozen=True, slots=True)
class Recorded:
    """A homed robot, its twin, and the recorder."""

    controller: GalilController
    virtual: VirtualController
    recorder: Recorder


@asynccontextmanager
async def recorded(
    folder: Path | None = None,
    *,
    settings: RecorderConfig | None = None,
    known: bool = True,
    config: Config | None = None,
) -> AsyncIterator[Recorded]:
    """Give a homed robot that is recorded; with a `folder` recordings are saved there.

    Unless its twin is `known`, the recording takes it for a machine.
    """
    chosen = SELDOM_BEATING if config is None else config
    truth, start = TrueConstants(), StartPose(*HERE)
    born = asyncio.get_running_loop().time()
    virtual = VirtualController(VirtualDmc(MayaMechanics(truth, start)))
    source = TwinSource(0, asdict(truth), (start.a, start.b, start.c), {}, born) if known else None
    origin = RecordingOrigin.of(chosen, "sim" if known else "10.0.0.5:23", twin=source)
    recorder = Recorder(settings or RecorderConfig(), origin, None if folder is None else recording_store(folder))

    async def dial() -> Transport:
        return recorder.recorded(virtual.loopback())

    controller = GalilController(dial, "twin", chosen)
    try:
        async with recorder.watching(controller):
            await _mark(await dial(), Units.of(chosen).to_counts(HERE))
            await controller.open()
            await controller.skip_home()
            try:
                yield Recorded(controller, virtual, recorder)
            finally:
                await controller.close()
    finally:
        await virtual.close()


async def _mark(transport: Transport, counts: tuple[int, int, int]) -> None:
    """Leave the mark of a homing, over a recorded connection, so that a replay has it too."""
    a, b, c = counts
    commands = [f"DP {a},{b},{c}", "mayaendb=2260000", "mayaendc=2300000", "ZAA=7", "mayahome=7", "SB1"]
    transport.write("".join(f"{command}\r" for command in commands).encode())
    heard = b""
    while heard.count(b":") < len(commands):
        heard += await transport.read()
    await transport.close()
