"""A controller layer alone, on a twin with given true constants and start."""

from __future__ import annotations

from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass, field

from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.wire.server import VirtualController
from dmc41x3.wire.transport import Transport
from maya_un.assembly.controller import machine_of
from maya_un.config import Config
from maya_un.controller.controller import GalilController
from maya_un.machine.mechanics import MayaMechanics
from maya_un.machine.miswired import built
from maya_un.machine.truth import StartPose, TrueConstants
from maya_un.values import Point


@dataclass(frozen=True, slots=True)
class Rig:
    """A controller layer, the virtual controller on the other end of its wire, and the mechanics behind that.

    `sent` holds every byte that went to the controller, in order.
    """

    controller: GalilController
    virtual: VirtualController
    mechanics: MayaMechanics
    sent: bytearray = field(default_factory=bytearray)


@asynccontextmanager
async def rig(
    config: Config | None = None,
    *,
    truth: TrueConstants | None = None,
    start: StartPose | None = None,
    parts: Mapping[str, Point] | None = None,
    live: bool = False,
    trace: bool = False,
) -> AsyncIterator[Rig]:
    """Open a controller layer on a twin for the length of the block; with `trace` its mechanics store samples.

    Raises the errors of `GalilController.open`. Use it in virtual time (`run_virtual`), where it takes no real time.
    """
    chosen = Config() if config is None else config
    mechanics, plant = built(
        machine_of(chosen) if truth is None else truth,
        StartPose() if start is None else start,
        parts,
        trace=trace,
    )
    virtual = VirtualController(VirtualDmc(plant))

    async def dial() -> Transport:
        return virtual.loopback()

    sent = bytearray()

    def note(direction: str, data: bytes) -> None:
        if direction == "tx":
            sent.extend(data)

    controller = GalilController(dial, "twin", chosen, live=live)
    controller.tap(note)
    try:
        await controller.open()
        yield Rig(controller, virtual, mechanics, sent)
    finally:
        await controller.close()
        await virtual.close()
