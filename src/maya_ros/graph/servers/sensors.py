"""Sensors on a graph: position, joints, raw data, and the markers of rviz."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, AsyncIterator, Callable, Mapping
from contextlib import aclosing, asynccontextmanager
from typing import Protocol

from dmc41x3.language.record import DataRecord
from maya_ros.graph.events import ControllerView
from maya_ros.graph.markers import PATIENCE, MarkerCache, MarkerScene, PathMarkers
from maya_ros.graph.protocol import Graph, Message, Publisher, header
from maya_ros.graph.servers.tasks import Clock, clock_or_loop, tasks
from maya_ros.graph.table import JOINTS, MARKERS, POSITION, SENSORS, Row
from maya_ros.graph.urdf import joint_state
from maya_un.config import Config
from maya_un.controller import state_builder
from maya_un.values import Point, State

DRAWING_RATE = 10.0
"""Largest rate of publishing markers [Hz]."""


_SPARE = 0.95
"""Factor of the period: a controller sends records after whole samples, so slightly more often than requested."""


class SensorLayer(ControllerView, Protocol):
    """The part of a controller layer that this server needs; a subscriber to the layer's topics implements it too."""

    def watch(self) -> AsyncIterator[State]:
        """Yield the state now and every newer one; a slow reader skips to the newest."""
        ...


class MarkerSource(Protocol):
    """The part of the scene that is not in the state of the controller."""

    @property
    def parts(self) -> Mapping[str, Point]:
        """The grasp points of the parts, by name [m]."""
        ...

    @property
    def carried(self) -> str | None:
        """The part between the jaws, None without one."""
        ...


Raw = Callable[[], DataRecord | None]
"""Returns the controller's latest record, None before the first."""


class SensorServer:
    """Publishes what `layer` measures; `raw` provides /hardware_sensor, which is not published without it.

    `scene` provides the parts to draw. `clock` stamps messages [s]; `speed` is how fast the loop's clock runs, because
    rates are in the time of the subscribers.
    """

    def __init__(
        self,
        layer: SensorLayer,
        config: Config,
        *,
        raw: Raw | None = None,
        scene: MarkerSource | None = None,
        clock: Clock | None = None,
        speed: float = 1.0,
    ) -> None:
        self._layer = layer
        self._config = config
        self._raw = raw
        self._scene = scene
        self._clock = clock_or_loop(clock)
        self._speed = max(1.0, speed)
        self._drawing = MarkerCache(config)
        self._ways: PathMarkers | None = None
        self._drawn = 0.0
        self._readers = 0

    @asynccontextmanager
    async def open(self, graph: Graph) -> AsyncGenerator[None]:
        """Publish while the block runs."""
        rows = [POSITION, JOINTS, MARKERS, *([] if self._raw is None else [SENSORS])]
        publishers = {row.name: _advertised(graph, row) for row in rows}
        ways = self._ways = PathMarkers(
            graph, self._layer.workspace.mechanism, lambda: self._layer.state.joints, PATIENCE * self._speed
        )
        try:
            async with tasks() as working:
                working.begin(self._follow(publishers), "sensors")
                yield
        finally:
            for held in (ways, *publishers.values()):
                held.close()

    async def _follow(self, publishers: Mapping[str, Publisher]) -> None:
        """Publish every state, or as many as the rate allows, always the newest.

        No state of a stream with that rate is left out, although states do not come evenly: one may be half a period
        early.
        """
        period = _SPARE * self._speed / POSITION.rate
        now = asyncio.get_running_loop().time
        due = now()
        async with aclosing(_generated(self._layer.watch())) as states:
            async for state in states:
                self._publish(publishers, state)
                due = max(due + period, now() + 0.5 * period)
                await asyncio.sleep(due - now())

    def _publish(self, publishers: Mapping[str, Publisher], state: State) -> None:
        seconds = self._clock()
        if state.point is not None:
            publishers[POSITION.name].publish(dict(zip("xyz", state.point, strict=True)))
        holding = self._scene is not None and self._scene.carried is not None
        joints = None
        if publishers[JOINTS.name].readers:
            joints = joint_state(state, self._layer.workspace.mechanism, seconds, holding=holding)
        if joints is not None:
            publishers[JOINTS.name].publish(joints)
        record = None if self._raw is None or not publishers[SENSORS.name].readers else self._raw()
        if record is not None:
            publishers[SENSORS.name].publish(raw_message(record, self._config, seconds))
        if self._ways is not None:
            self._ways.update(state)
        self._draw(publishers[MARKERS.name], state)

    def _draw(self, markers: Publisher, state: State) -> None:
        """Publish changed markers; publish all markers for a new subscriber."""
        now, readers = asyncio.get_running_loop().time(), markers.readers
        come = readers > self._readers
        self._readers = readers
        if not readers or (not come and now - self._drawn < self._speed / DRAWING_RATE):
            return
        self._drawn = now
        workspace, scene = self._layer.workspace, self._scene
        parts, carried = ({}, None) if scene is None else (scene.parts, scene.carried)
        way = () if self._ways is None else self._ways.way
        news = self._drawing.update(MarkerScene(state, workspace, workspace.zones, parts, carried, way), whole=come)
        if news is not None:
            markers.publish(news)


def raw_message(record: DataRecord, config: Config, seconds: float) -> Message:
    """Return a record as maya_controller/RawSensorData, by axis a, b, c."""
    order = state_builder.indices(config)
    axes = [record.axes[place] for place in order]
    forward, reverse = state_builder.limits(record, config, order)
    high = record.output(config.gripper.output)
    return {
        "header": header(seconds),
        "position": [axis.position for axis in axes],
        "velocity": [float(axis.velocity) for axis in axes],
        "forward_limit": list(forward),
        "reverse_limit": list(reverse),
        "moving": [axis.moving for axis in axes],
        "motor_off": [axis.motor_off for axis in axes],
        "stop_code": [axis.stop_code for axis in axes],
        "gripper_closed": high is (config.gripper.closed_by == "set"),
        "error_code": record.error_code,
    }


def _advertised(graph: Graph, row: Row) -> Publisher:
    return graph.advertise(row.name, row.type, latch=row.latch, queue_size=row.queue_size)


async def _generated(states: AsyncIterator[State]) -> AsyncGenerator[State]:
    async for state in states:
        yield state
