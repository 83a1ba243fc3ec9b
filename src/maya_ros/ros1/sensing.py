"""Sensor values for sensor_converter: read from the controller, published, received again and converted."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace
from typing import TypeVar

from dmc41x3.address import parse
from dmc41x3.driver import Driver
from dmc41x3.wire.transport import Transport, connect
from maya_ros.graph.events import ControllerCondition, read
from maya_ros.graph.protocol import Graph, Message
from maya_ros.graph.servers.sensors import raw_message
from maya_ros.graph.servers.tasks import Clock
from maya_ros.graph.table import EVENT, SENSORS
from maya_ros.graph.types import default
from maya_un.config import Config, Units
from maya_un.controller.monitor import StateBroadcaster
from maya_un.controller.registers import DriverLink
from maya_un.errors import InvalidMessage, MachineError, NotConnected, Unreachable
from maya_un.kinematics.workspace import Workspace
from maya_un.values import Joints, Mode, Point, State

T = TypeVar("T")


class Probe:
    """A separate connection to the controller at `address`, which only requests data records.

    `clock` returns the time for message stamps [s].
    """

    def __init__(self, config: Config, address: str, clock: Clock) -> None:
        self._config = config
        self._address = address
        self._clock = clock

    async def tell(self, graph: Graph) -> None:
        """Publish measurements until cancelled; reconnect after a loss. Raises `ConnectFailed` and related errors."""
        publisher = graph.advertise(SENSORS.name, SENSORS.type, queue_size=SENSORS.queue_size)
        link = DriverLink(self._dial, self._address, self._config.controller.timeout, _nothing, _nothing_else)
        try:
            await link.open()
            now = asyncio.get_running_loop().time
            due = now()
            while True:
                message = await self._measured(link)
                if message is not None:
                    publisher.publish(message)
                due = max(due + 1.0 / SENSORS.rate, now())
                await asyncio.sleep(due - now())
        finally:
            await link.close()
            publisher.close()

    async def _dial(self) -> Transport:
        return await connect(parse(self._address), self._config.controller.timeout)

    async def _measured(self, link: DriverLink) -> Message | None:
        """Return a record as a message, None if none is available."""
        try:
            return raw_message(await link.driver.record(), self._config, self._clock())
        except (NotConnected, MachineError):
            return None


def _nothing(_: MachineError) -> None:
    pass


async def _nothing_else(_: Driver) -> None:
    pass


class SensedController:
    """The state from /hardware_sensor and /maya_event, as `servers.sensors.SensorServer` publishes it."""

    def __init__(self, config: Config) -> None:
        self._config = config
        self._units = Units.of(config)
        self._standing = ControllerCondition(Mode.DISCONNECTED, homed=False, moving=False, gripper_closed=False)
        self.workspace = Workspace.of(config)
        self._latest = StateBroadcaster(self._seen(default(SENSORS.type)))

    @asynccontextmanager
    async def listening(self, graph: Graph) -> AsyncGenerator[None]:
        """Subscribe to both topics while the block runs."""
        held = (
            graph.subscribe(EVENT.name, EVENT.type, self.hear_event, queue_size=EVENT.queue_size),
            graph.subscribe(SENSORS.name, SENSORS.type, self.hear_sensors, queue_size=SENSORS.queue_size),
        )
        try:
            yield
        finally:
            for one in held:
                one.close()

    @property
    def state(self) -> State:
        """Latest state."""
        return self._latest.state

    def watch(self) -> AsyncIterator[State]:
        """Yield every state received from now on; a slow reader skips to the newest."""
        return self._latest.watch(self.state)

    def hear_event(self, message: Message) -> None:
        """Take an event; ignore an invalid message."""
        try:
            self._standing = read(message["data"]).standing
        except InvalidMessage:
            return
        if self._standing.strokes is not None:
            a, b, c = self._standing.strokes
            self.workspace = replace(self.workspace, boom=a, line_b=b, line_c=c)

    def hear_sensors(self, message: Message) -> None:
        """Take a measurement; before homing, counts do not give lengths."""
        self._latest.show(self._seen(message))

    def _seen(self, message: Message) -> State:
        standing = self._standing
        a, b, c = message["position"]
        va, vb, vc = (speed / unit for speed, unit in zip(message["velocity"], self._units.per_unit, strict=True))
        off_a, off_b, off_c = message["motor_off"]
        joints = self._units.to_joints((a, b, c)) if standing.homed else None
        return State(
            time=asyncio.get_running_loop().time(),
            mode=standing.mode,
            homed=standing.homed,
            counts=(a, b, c),
            joints=joints,
            point=None if joints is None else self._point(joints),
            velocity=(va, vb, vc),
            moving=any(message["moving"]),
            motors_on=(not off_a, not off_b, not off_c),
            forward_limit=_three(message["forward_limit"]),
            reverse_limit=_three(message["reverse_limit"]),
            stop_code=_three(message["stop_code"]),
            gripper_closed=message["gripper_closed"],
            progress=None,
            fault=standing.fault,
            override=standing.override,
        )

    def _point(self, joints: Joints) -> Point | None:
        """Return the gripper point, None if lines of these lengths cannot meet."""
        try:
            return self.workspace.mechanism.fk(joints)
        except Unreachable:
            return None


def _three(values: list[T]) -> tuple[T, T, T]:
    a, b, c = values
    return a, b, c
