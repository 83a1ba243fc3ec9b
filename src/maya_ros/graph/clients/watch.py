"""Watch a controller layer over a graph: its state, its events in order, and whether its nodes are alive.

The last event gives the condition of the layer (`graph.events`), /joint_states the position of the axes, /maya_position
the gripper point. A robot at rest counts as homed once its position is known. No topic reports limit switches, motors
and stop codes: they count as in order while there is no fault. Events and joints may come from two nodes; if one of
them is gone or hangs, the layer counts as disconnected.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator, Callable
from contextlib import suppress
from math import inf, isfinite

from maya_ros.graph.diagnostics import CONTROLLER
from maya_ros.graph.events import REFUSED, ControllerCondition, ReportedEvent, Strokes, read
from maya_ros.graph.protocol import Graph, Message
from maya_ros.graph.table import DIAGNOSTICS, EVENT, JOINTS, POSITION
from maya_un.axes import AXES
from maya_un.config import Config, Units
from maya_un.controller.monitor import StateBroadcaster
from maya_un.errors import MayaError, NodeGone
from maya_un.events import Connected, Disconnected, EventLog, event_of
from maya_un.kinematics.mechanism import Mechanism
from maya_un.kinematics.workspace import Workspace
from maya_un.values import Joints, Mode, Point, Progress, State

LOOK = 0.1
"""Period of the check whether the layer's nodes exist [s, real time]."""

SETTLES = 0.5
"""Longest time until the topics show the end of a command [s, real time]."""

SILENT = 5.0
"""A layer's node publishes its status every second; a node without one for this time hangs [s, real time]."""

UNDER_WAY = frozenset({Mode.MOVING, Mode.HOMING, Mode.STOPPING})
"""Modes that end by themselves."""

_AWAY = ControllerCondition(Mode.DISCONNECTED, homed=False, moving=False, gripper_closed=False)
_FRESH = 2
"""After this number of messages, the joints were measured after the call: one message may have been on its way."""

_BLANK = (False, False, False)

log = logging.getLogger("maya_ros.graph")


class ControllerWatch:
    """Listens to a controller layer on `graph`; `speed` is how fast the loop's clock runs.

    `progress` is that of the motion under way; the client that started the motion sets it.
    """

    def __init__(self, graph: Graph, config: Config, speed: float) -> None:
        self._loop = asyncio.get_running_loop()
        self._speed = max(1.0, speed)
        self._units = Units.of(config)
        self._config = config
        self.mechanism = Mechanism.of(config)
        self.workspace = Workspace.of(config)
        self.events = EventLog(self._loop.time)
        self.progress: Progress | None = None
        self.node, self._sensor = EVENT.sources[0], JOINTS.sources[0]
        self._standing = _AWAY
        self._sensing = self._missed = False
        self._silence = -inf
        self._strokes: Strokes | None = None
        self._joints: Joints | None = None
        self._velocity = (0.0, 0.0, 0.0)
        self._point: Point | None = None
        self._measured = 0
        self._latest = StateBroadcaster(self._compose())
        self._told = graph.subscribe(EVENT.name, EVENT.type, self._hear_event, queue_size=EVENT.queue_size)
        self._sensed = graph.subscribe(JOINTS.name, JOINTS.type, self._hear_joints, queue_size=JOINTS.queue_size)
        self._placed = graph.subscribe(POSITION.name, POSITION.type, self._hear_point, queue_size=POSITION.queue_size)
        self._diagnosed = graph.subscribe(
            DIAGNOSTICS.name, DIAGNOSTICS.type, self._hear_health, queue_size=DIAGNOSTICS.queue_size
        )
        self._looking = self._loop.create_task(self._keep_looking(), name="look at the controller's node")

    async def close(self) -> None:
        """Listen no more."""
        for held in (self._told, self._sensed, self._placed, self._diagnosed):
            held.close()
        self._looking.cancel()
        await asyncio.wait({self._looking})

    @property
    def there(self) -> bool:
        """Whether the layer's nodes are alive and have reported their state."""
        return self._standing is not _AWAY and self._sensing

    @property
    def hangs(self) -> bool:
        """Whether the layer's node has stopped publishing its status."""
        return self._silence > SILENT

    @property
    def state(self) -> State:
        """Latest state, as far as topics report it."""
        return self._latest.state

    def watch(self) -> AsyncIterator[State]:
        """Yield the state now and every newer one; a slow reader skips to the newest."""
        return self._latest.watch()

    async def until(self, shown: Callable[[], bool], patience: float | None = None) -> bool:
        """Wait until `shown` is true, for `patience` [s, real time] at most; return whether it is."""
        with suppress(TimeoutError):
            async with asyncio.timeout(None if patience is None else patience * self._speed):
                await self._latest.until(shown)
        return shown()

    async def settled(self) -> None:
        """Wait until the topics show the end of a finished command: the robot at rest, and its position."""
        fresh = self._measured + _FRESH
        await self.until(lambda: not self.there or (self._at_rest and self._known(fresh)), SETTLES)

    def renew(self) -> None:
        """Compose the state again, and wake all watchers."""
        self._latest.show(self._compose())

    @property
    def _at_rest(self) -> bool:
        return self._standing.mode not in UNDER_WAY

    def _known(self, fresh: int) -> bool:
        """Return whether the joints are up to date; before homing they are unknown, and no topic reports them."""
        return self._measured >= fresh or not self._standing.homed

    def _hear_event(self, message: Message) -> None:
        try:
            told = read(message["data"])
            new = self._standing is _AWAY
            self._sensing = self._sensing or (bool(self._sensed.writers) and not self.hangs)
            self._stand(told.standing)
        except MayaError as error:
            log.warning("%s", error)
            return
        self.node = next(iter(self._told.writers), self.node)
        if new and told.word != Connected.word:
            self.events.emit(Connected(self.node))
        self._emit(told)

    def _emit(self, told: ReportedEvent) -> None:
        if told.word != REFUSED:
            self.events.emit(event_of(told.word, told.detail, told.code))

    def _stand(self, standing: ControllerCondition) -> None:
        """Apply a reported condition; raises `InvalidConfig` for strokes with which nothing can be reached."""
        if standing.strokes is not None and standing.strokes != self._strokes:
            self.workspace = Workspace.of(self._config, standing.strokes).with_zones(self.workspace.zones)
            self._strokes = standing.strokes
        self._standing = standing
        if not standing.homed:
            self._joints = self._point = None
        self.renew()

    def _hear_joints(self, message: Message) -> None:
        places = dict(zip(message["name"], message["position"], strict=False))
        if not all(isfinite(places.get(axis, inf)) for axis in AXES):
            return  # joints of another robot, or no position
        rates = dict(zip(message["name"], message["velocity"], strict=False))
        self._joints = Joints(*(places[axis] for axis in AXES))
        a, b, c = (rates.get(axis, 0.0) for axis in AXES)
        self._velocity = (a, b, c)
        self._measured += 1
        self.renew()

    def _hear_point(self, message: Message) -> None:
        point = Point(message["x"], message["y"], message["z"])
        if point != self._point and all(map(isfinite, point)):  # at rest, it is published 50 times a second, unchanged
            self._point = point
            self.renew()

    def _hear_health(self, message: Message) -> None:
        if any(status["name"] == CONTROLLER for status in message["status"]):
            self._silence = 0.0

    async def _keep_looking(self) -> None:
        while True:
            await asyncio.sleep(LOOK * self._speed)
            self._silence += LOOK  # counted, not measured: while this process hangs, no node counts as silent
            self._look()

    def _look(self) -> None:
        """Detect nodes that are gone or back."""
        sensors = self._sensed.writers
        self._sensor = next(iter(sensors), self._sensor)
        if self._standing is not _AWAY and not self._told.writers:
            self._sensing = self._missed = False
            self._silence = -inf
            self._lose(self.node, _AWAY)
        elif self.there and (self.hangs or not sensors):
            self._sensing, self._missed = False, True
            self._lose(self._sensor if not sensors else self.node, self._standing)
        elif sensors and not self._sensing and not self.hangs:
            self._sensing, missed, self._missed = True, self._missed, False
            self.renew()
            if missed:
                self.events.emit(Connected(self._sensor))

    def _lose(self, node: str, standing: ControllerCondition) -> None:
        """Report that a node is gone, and discard what it reported."""
        gone = NodeGone(node=node)
        self._joints = self._point = None
        self._stand(standing)
        self.events.emit(Disconnected(str(gone), code=gone.code))

    def _compose(self) -> State:
        standing = self._standing
        joints = self._joints if standing.homed else None
        powered = self.there and standing.fault is None
        mode = standing.mode if self._sensing else Mode.DISCONNECTED
        if unlocated := mode is Mode.IDLE and joints is None:  # the event of a homing may come before the position
            mode = Mode.NOT_HOMED
        return State(
            time=self._loop.time(),
            mode=mode,
            homed=standing.homed and not unlocated,
            counts=(0, 0, 0) if joints is None else self._units.to_counts(joints),
            joints=joints,
            point=None if joints is None else self._point,
            velocity=self._velocity,
            moving=standing.moving,
            motors_on=(powered, powered, powered),
            forward_limit=_BLANK,
            reverse_limit=_BLANK,
            stop_code=(0, 0, 0),
            gripper_closed=standing.gripper_closed,
            progress=self.progress,
            fault=standing.fault,
            override=standing.override,
        )
