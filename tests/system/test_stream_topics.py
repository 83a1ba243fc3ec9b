"""The topics of the stream, on a whole robot with its twin and its workers."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from functools import partial
from math import dist
from typing import Any

import pytest

from dmc41x3.loops import ScaledLoop, run
from maya_un.assembly.stack import stack
from maya_un.assembly.staff import staffed
from maya_un.config import Config
from maya_un.errors import Busy
from maya_un.http.app import create_app
from maya_un.http.bridge import Bridge
from maya_un.http.sockets import bound_socket
from maya_un.http.stream.topics import TOPICS
from maya_un.http.thread import served
from maya_un.values import Point
from tests.streaming import Client, connected

pytestmark = pytest.mark.system

SPEED = 20.0
CUBE, TRAY = Point(0.5, 1.1, 0.4), Point(1.1, 0.5, 0.4)
JOB = {
    "parts": {"cube": list(CUBE)},
    "places": {"tray": list(TRAY)},
    "steps": ["home", {"pick": "cube"}, {"place": "tray"}],
}


@asynccontextmanager
async def streaming() -> AsyncIterator[Client]:
    """Yield a client of a robot on whose table a cube stands."""
    config = Config()
    with staffed(config) as staff, bound_socket(0) as listener:
        async with stack(config, speed=SPEED, parts={"cube": CUBE}, staff=staff) as robot:
            loop = asyncio.get_running_loop()
            bridge = Bridge(loop, robot.service, gate=robot.gate, callers=robot.access.callers)
            async with (
                served(create_app(bridge), listener) as url,
                connected(f"{url.replace('http', 'ws', 1)}/v1/stream") as client,
            ):
                yield client


async def until(client: Client, topic: str, holds: Callable[[Any], bool] = lambda value: True) -> Any:
    """Return the value of a topic once something holds for it."""
    latest = next((message for message in reversed(client.got) if message["type"] == topic), None)
    while latest is None or not holds(latest[topic]):
        latest = await client.until(topic)
    return latest[topic]


def has_path(motion: Any) -> bool:
    return motion["next"] is not None and len(motion["next"]["points"]) > 1


def test_every_topic_follows_a_job_from_its_start_to_its_end() -> None:
    async def main() -> None:
        async with streaming() as client:
            await client.ask("subscribe", **dict.fromkeys(TOPICS, True))
            first = {topic: await until(client, topic) for topic in ("table", "can")}
            assert first["table"]["source"] == "twin"
            assert first["table"]["parts"] == {"cube": list(CUBE)}
            assert first["can"]["actions"]["home"] is None
            await client.say("request", path="/v1/jobs", body=JOB)
            busy = await until(client, "can", lambda can: can["actions"]["home"] is not None)
            assert busy["actions"]["home"] == {"code": Busy.code, "message": str(Busy(doing="job 1"))}
            ahead = (await until(client, "motion", has_path))["next"]
            assert (ahead["job"], ahead["step"], ahead["primitive"], ahead["target"]) == (1, 2, "pick", list(CUBE))
            assert min(dist(point, CUBE) for point in ahead["points"]) < 1e-3
            taken = await until(client, "table", lambda table: table["carried"] is not None and table["holding"])
            assert (taken["carried"], taken["parts"]) == ("cube", {"cube": None})
            put = await until(client, "table", lambda table: table["carried"] is None and table["holding"] is False)
            assert put["parts"]["cube"] == pytest.approx(list(TRAY), abs=2e-3)
            await until(client, "can", lambda can: can["actions"]["home"] is None)
            assert (await until(client, "motion", lambda motion: not motion["path"]))["next"] is None
            nearest = (await until(client, "margins", lambda margins: margins["nearest"]))["nearest"]
            assert {one["unit"] for one in nearest} == {"m", "rad", "load"}

    run(main(), partial(ScaledLoop, SPEED))
