"""A host that races for a controller, run to be killed: it connects, moves, leaves, and comes again, for ever.

It tells its parent what it is about to do: connect, own, move, grip, leave; and what it met: refused, or error CODE
and its sentence.
"""

from __future__ import annotations

import asyncio
from multiprocessing.connection import Connection
from random import Random

from dmc41x3.address import split
from dmc41x3.wire.transport import TcpTransport, Transport
from maya_un.config import Config
from maya_un.controller.controller import GalilController
from maya_un.errors import ControllerMoves, ControllerOwned, MayaError
from maya_un.values import Joints

PLACES = (Joints(0.30, 1.50, 1.30), Joints(0.32, 1.49, 1.31), Joints(0.34, 1.50, 1.32), Joints(0.31, 1.48, 1.32))
"""A move between two of them takes a second or two."""


def host(address: str, seed: str, pipe: Connection) -> None:
    """Race until killed; `seed` draws what is done."""
    asyncio.run(_race(address, Random(seed), pipe))


async def _race(address: str, rng: Random, pipe: Connection) -> None:
    config = Config()

    async def dial() -> Transport:
        return await TcpTransport.connect(*split(address), config.controller.timeout)

    while True:
        controller = GalilController(dial, address, config, live=True)
        pipe.send("connect")
        try:
            await controller.open()
            pipe.send("own")
            await controller.skip_home()
            await _work(controller, rng, pipe)
            pipe.send("leave")
        except (ControllerOwned, ControllerMoves):
            pipe.send("refused")
        except MayaError as error:
            pipe.send(f"error {error.code} {error}")
        await controller.close()


async def _work(controller: GalilController, rng: Random, pipe: Connection) -> None:
    for _ in range(rng.randint(1, 2)):
        if rng.random() < 0.3:
            pipe.send("grip")
            await controller.gripper(rng.random() < 0.5)
        else:
            pipe.send("move")
            await controller.move(rng.choice(PLACES))
