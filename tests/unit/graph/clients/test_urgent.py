"""A stop that its service cannot be found for: without a master, connections that stand still carry a cancel."""

from __future__ import annotations

import asyncio

import pytest

from maya_un.config import Config
from maya_un.errors import NotConnected
from maya_un.graph.bus import Bus
from maya_un.graph.clients.controller import GraphController
from maya_un.graph.protocol import Feedback, Message
from maya_un.graph.table import FOLLOW, HOME, MOVE, Row
from tests.virtual_time import elapse


@pytest.mark.parametrize("row", [HOME, MOVE, FOLLOW], ids=lambda row: row.name)
async def test_what_moves_is_cancelled_where_nobody_answers_a_stop(row: Row) -> None:
    bus, stopped = Bus(), asyncio.Event()

    async def act(_: Message, feedback: Feedback) -> Message:
        feedback({})
        try:
            await asyncio.Event().wait()
        finally:
            stopped.set()
        return {}

    served = bus.node("hw_simulator").act(row.name, row.type, act)
    goal = asyncio.create_task(bus.node("somebody").do(row.name, row.type, {}))
    await elapse(0.1)
    async with GraphController.on(bus.node("process_controller"), Config()) as controller:
        assert not stopped.is_set()
        await controller.stop()
        await elapse(0.1)
        assert stopped.is_set()
        await goal
        served.close()
        await elapse(0.1)
        with pytest.raises(NotConnected):
            await controller.stop()
    await elapse(5.0)
