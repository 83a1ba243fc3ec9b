"""Operations by name on a graph, while the application that answers them is loaded."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from maya_ros.graph.bus import Bus
from maya_ros.graph.servers.operations import OperationServer
from maya_ros.graph.table import CALL_OPERATION
from maya_un.client.request import Request
from maya_un.service.access.operations import Caller
from tests.virtual_time import elapse


class App:
    """An application that is loaded as long as a test wants."""

    def __init__(self) -> None:
        self.loaded = asyncio.Event()
        self.asked: list[str] = []
        self.stops = 0

    async def ready(self) -> None:
        await self.loaded.wait()

    async def ask(self, request: Request[Any], caller: Caller) -> str:
        del caller
        self.asked.append(request.path)
        return "{}"


@pytest.mark.parametrize(
    ("operation", "code", "asked"), [("jog_by", "2201", []), ("stop", "", ["/v1/stop"]), ("abort", "", ["/v1/abort"])]
)
async def test_stop_while_the_application_is_loaded_ends_all_but_stops(
    operation: str, code: str, asked: list[str]
) -> None:
    app, bus = App(), Bus()
    async with OperationServer(app, lambda: app.stops).open(bus.node("process_controller")):
        arguments = '{"axis": "a", "distance": 0.1}' if code else ""
        request = {"operation": operation, "arguments": arguments}
        answer = asyncio.ensure_future(bus.node("somebody").call(CALL_OPERATION.name, request))
        await elapse(0.1)
        app.stops += 1
        app.loaded.set()
        assert ((await answer)["code"], app.asked) == (code, asked)
