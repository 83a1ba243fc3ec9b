"""Client of the controller layer over a graph, with the protocol of the layer.

The speed override may change during a motion, so time alone does not give the position. But the robot stays on the
planned path and is never faster than planned. So of the positions that the robot may have reached since the last
feedback, the nearest to the reported joints is taken.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Iterator, Sequence
from contextlib import asynccontextmanager, contextmanager
from math import isclose
from typing import Any

import numpy as np

from maya_ros.graph.clients.watch import SETTLES, ControllerWatch
from maya_ros.graph.conversions import path_to_message
from maya_ros.graph.outcome import call_service, cancel_on_event, run_action
from maya_ros.graph.protocol import Feedback, Graph, Message
from maya_ros.graph.table import ABORT, FOLLOW, GRIPPER, HOME, MOVE, OUTPUT, PAUSE, RECOVER, RESUME, SPEED, STOP, Row
from maya_un.cancellation import is_cancelling
from maya_un.config import Config, Units
from maya_un.controller.datum import GivenDatum
from maya_un.controller.planner import Jogging, MotionPlan, Planner, name_of
from maya_un.controller.protocol import (
    PLACES,
    Inspection,
    OnVia,
    Preview,
    homing_progress,
    require_output,
    require_ratio,
)
from maya_un.errors import CannotPause, MayaError, NodeGone, NotConnected, NotHomed, NotOverRos
from maya_un.events import Connected, Disconnected, Event, EventLog, HomingBegun, MotionStopped, PhaseBegun
from maya_un.kinematics.mechanism import Mechanism
from maya_un.kinematics.workspace import Workspace
from maya_un.kinematics.zones import Zone
from maya_un.motion.path import Path, Route
from maya_un.schema.robot import Jogged, LinkView
from maya_un.values import JogDirection, Joints, Mode, Progress, State, StopReport

_SLACK = 0.5
"""Longest transport time of a message [s]."""

_ROUNDING = 0.5
"""Greatest error of a way that is found from whole counts [counts]."""


class Vias:
    """Calls `on_via` for each waypoint between the ends of `plan` as the robot passes it, in order, once each.

    `began` is the start of the motion [s, loop time].
    """

    def __init__(self, plan: MotionPlan, units: Units, on_via: OnVia, began: float) -> None:
        self._move = plan.move
        self._ways = () if plan.move is None else plan.move.via_ways
        self._scale = units.per_unit
        self._on_via = on_via
        self._way = 0.0
        self._looked = began
        self._passed = 0

    def at(self, joints: Joints, now: float) -> None:
        """Take the position of the robot (rad, m, m) at loop time `now` [s]."""
        if self._move is None or self._passed >= len(self._ways):
            return
        latest = self._move.profile.when(self._way) + (now - self._looked) + _SLACK
        here = np.array([value * scale for value, scale in zip(joints, self._scale, strict=True)])
        self._way = self._move.nearest_way(here, self._way, self._move.profile.at(latest)[0])
        self._looked = now
        while self._passed < len(self._ways) and self._ways[self._passed] <= self._way + _ROUNDING:
            self._tell()

    def finish(self) -> None:
        """Report the remaining waypoints: the robot has reached the end."""
        while self._passed < len(self._ways):
            self._tell()

    def _tell(self) -> None:
        self._passed += 1
        self._on_via(self._passed - 1)


HEARD = 1.0
"""A node that does not answer a stop within this time hangs [s, real time]; `maya stop` waits for twice as long."""


class StopSender:
    """Sends stops to the controller layer that `watch` observes; `speed` is how fast the loop's clock runs."""

    def __init__(self, graph: Graph, watch: ControllerWatch, speed: float) -> None:
        self._graph = graph
        self._watch = watch
        self._patience = HEARD * max(1.0, speed)
        self._cancels = [graph.advertise(f"{row.name}/cancel", "actionlib_msgs/GoalID") for row in (HOME, MOVE, FOLLOW)]
        self._saying: set[asyncio.Task[Message]] = set()

    async def say(self, row: Row) -> Message:
        """Return the answer of a stop service; the call continues if the caller is cancelled.

        Without an answer, cancel all goals, which needs no master. Raises `NotConnected` if no node receives the
        cancels either, and `NodeGone` if the node hangs: the node stops when it runs again.
        """
        saying = asyncio.create_task(call_service(self._graph, row, {}), name=row.name)
        self._saying.add(saying)
        saying.add_done_callback(self._said)
        answered, _ = await asyncio.wait({saying}, timeout=self._patience)
        try:
            if answered:
                return saying.result()
        except NodeGone:
            if not any(cancel.readers for cancel in self._cancels):
                raise NotConnected from None
        moving = self._watch.state.moving
        for cancel in self._cancels:
            cancel.publish({})
        rests = await self._watch.until(lambda: not self._watch.state.moving, SETTLES)
        if not answered and not (moving and rests):
            raise NodeGone(node=self._watch.node)
        return {"message": json.dumps({"was_moving": moving, "duration": 0.0, "distance": (0.0, 0.0, 0.0)})}

    async def close(self) -> None:
        """Cancel all calls, and close the publishers."""
        for saying in self._saying:
            saying.cancel()
        if self._saying:
            await asyncio.wait(self._saying)
        for cancel in self._cancels:
            cancel.close()

    def _said(self, saying: asyncio.Task[Message]) -> None:
        self._saying.discard(saying)
        if not saying.cancelled():
            saying.exception()


AHEAD = 2.0
"""Longest wait of `pause` with `ahead` for a motion, and of `override` for its effect [s, real time]."""

_AGAIN = 0.05
_NOTHING = StopReport(False, 0.0, (0.0, 0.0, 0.0))


class GraphController:
    """Joint-space control of Maya through the controller layer of a graph; see `controller.protocol.Controller`.

    Topics provide its state (`clients.watch`). Computations without the machine, such as previews, run here. Commands
    go to the layer, and refusals come from the layer. If the node is missing or gone, the controller is disconnected
    and raises `NotConnected`, or `NodeGone` during a command.
    """

    def __init__(self, graph: Graph, config: Config, *, speed: float = 1.0) -> None:
        self._loop = asyncio.get_running_loop()
        self._graph = graph
        self._speed = max(1.0, speed)
        self._watch = ControllerWatch(graph, config, speed)
        self._units = Units.of(config)
        self._planner = Planner(config, self._watch.mechanism)
        self._jogging = Jogging(self._planner, self._watch.mechanism)
        self._ratio = graph.advertise(SPEED.name, SPEED.type, queue_size=SPEED.queue_size)
        self._urgent = StopSender(graph, self._watch, speed)
        self.config = config
        self.stops = 0
        self._motions: dict[asyncio.Task[Any] | None, bool] = {}  # whether the end of a cancelled one was reported
        self.events.heard_by(self._hear)

    @classmethod
    @asynccontextmanager
    async def on(cls, graph: Graph, config: Config, *, speed: float = 1.0) -> AsyncIterator[GraphController]:
        """Yield the controller layer of `graph` while the block runs; `speed` is how fast the loop's clock runs.

        The controller is disconnected until `connected` returns.
        """
        controller = cls(graph, config, speed=speed)
        try:
            yield controller
        finally:
            await controller.close()

    async def close(self) -> None:
        """Stop listening."""
        self._ratio.close()
        await self._urgent.close()
        await self._watch.close()

    async def connected(self) -> None:
        """Wait until the layer's node has reported its state."""
        await self._watch.until(lambda: self._watch.there)

    async def settled(self) -> None:
        """Wait until the state shows the end of a finished command: the robot at rest, and its position."""
        await self._watch.settled()

    @property
    def mechanism(self) -> Mechanism:
        """Geometry of the machine."""
        return self._watch.mechanism

    @property
    def workspace(self) -> Workspace:
        """The workspace; its strokes are the measured ones once the robot is homed."""
        return self._watch.workspace

    @property
    def zones(self) -> tuple[Zone, ...]:
        """The zones that the robot keeps out of: those of the configuration."""
        return self._watch.workspace.zones

    def set_zones(self, zones: Sequence[Zone]) -> None:
        """Raise `NotOverRos`: no message of the graph sets zones."""
        raise NotOverRos(request="zones")

    @property
    def events(self) -> EventLog:
        """Events of the layer, in order."""
        return self._watch.events

    @property
    def state(self) -> State:
        """Latest state, as far as topics report it."""
        return self._watch.state

    def watch(self) -> AsyncIterator[State]:
        """Yield the state now and every newer one; a slow reader skips to the newest."""
        return self._watch.watch()

    def progress(self) -> Progress | None:
        """Progress of the motion that this client started, None if none is under way."""
        return self._watch.progress

    def signals(self) -> None:
        """Nothing: another node has them."""

    async def input(self, number: int) -> bool:
        """Raise `NotOverRos`: another node has the controller."""
        raise NotOverRos(request="digital inputs")

    async def interrogate(self, command: str) -> str:
        """Raise `NotOverRos`: another node has the controller."""
        raise NotOverRos(request="terminal")

    def link(self, speed: float) -> LinkView:
        """Return whether the controller is connected; the quality of the link is known to its node alone."""
        return LinkView(self.state.mode is not Mode.DISCONNECTED)

    @property
    def run(self) -> None:
        """Nothing: the motion under way is another node's."""

    def preview(self, path: Route, *, speed: float = 1.0) -> Preview:
        """Check and time `path` as the layer does; raises what the motion would raise, sends nothing."""
        return self._planner.preview(self.workspace, path, speed)

    def allowed(self, speed: float) -> float:
        """Return `speed`: no topic reports that the robot may only move slowly."""
        return speed

    def inspect(self, path: Route, *, speed: float = 1.0, samples: int = 200) -> Inspection | None:
        """Return the details of the motion along `path`, None if nothing moves; raises as `preview` does."""
        return self._planner.inspect(self.workspace, path, speed, samples)

    async def home(self) -> None:
        """Find the switches, define the counts, measure the strokes; every phase is an event."""
        phase, since = "", self._loop.time()

        def heard(feedback: Message) -> None:
            nonlocal phase, since
            if feedback["phase"] not in {phase, HomingBegun.word}:  # an event already reports the start
                phase, since = feedback["phase"], self._loop.time()
                self.events.emit(PhaseBegun(phase))
            self._show(homing_progress(phase, self._loop.time() - since))

        await self._do(HOME, {}, heard)

    async def move(self, target: Joints, *, speed: float = 1.0) -> None:
        """Go to `target` (rad, m, m), straight in joint space; `speed` scales the limits."""
        if speed != 1.0:
            await self.follow([self._here(), target], speed=speed)
            return
        self._require_there()
        duration = self._duration([self._here(), target]) if self.state.homed else 0.0
        await self._do(MOVE, target._asdict(), self._moving("move", duration))

    async def follow(self, path: Route, *, speed: float = 1.0, on_via: OnVia | None = None) -> None:
        """Follow `path`; raises `TrajectoryRefused` unless it starts at the robot's position.

        `on_via` is called with the number, from 0, of each waypoint between the ends as the robot passes it.
        """
        self._require_there()
        least = 0.0 if speed == 1.0 else self.preview(path, speed=speed).duration
        vias = None if on_via is None else self._vias(path, speed, on_via)
        duration = self._duration(path, speed) if self.state.homed else 0.0
        goal: Message = {"trajectory": path_to_message(path, least)}
        await self._do(FOLLOW, goal, self._moving("follow", duration, vias))
        if vias is not None:
            vias.finish()

    async def jog(self, axis: JogDirection, distance: float, *, speed: float = 1.0, clip: bool = False) -> Jogged:
        """Move along one of `axes.JOG_AXES` by `distance` (rad or m), or with `clip` as far as the workspace allows.

        Returns the distance of the motion and what limited it. Raises `UnknownName` for another axis.
        """
        self._require_there()
        here, gone = self._here(), Jogged(name_of(axis), distance)
        if clip:
            gone = self._jogging.within(self.workspace, axis, here, distance)
        await self.follow(self._jogging.path(axis, here, gone.distance), speed=speed)
        return gone

    async def jog_speed(self, speed: float) -> bool:
        """Return False: the speed of a motion is part of its path, which the other node has."""
        del speed
        return False

    async def gripper(self, open_: bool) -> None:
        """Open or close the gripper and wait until it has moved."""
        await self._call(GRIPPER, {"data": open_})
        await self._watch.until(lambda: self.state.gripper_closed is not open_, SETTLES)

    async def output(self, number: int, *, on: bool) -> None:
        """Switch a digital output that `controller.outputs` lists; raises `InvalidValue` for others."""
        require_output(self.config, number)
        await self._call(OUTPUT, {"number": number, "on": on})

    async def stop(self) -> StopReport:
        """Begin to brake at once, on the path; return how long and how far the braking takes.

        The stop is sent in every state of the layer; raises `NotConnected` if no node receives it. If the service
        cannot be found, as without a master, all goals are cancelled, which needs no master. If the layer's node hangs,
        this raises `NodeGone`, and the node stops when it runs again.
        """
        self.stops += 1
        return _report(await self._urgent.say(STOP))

    async def override(self, ratio: float) -> None:
        """Scale the speed of the motion under way and of all later ones by `ratio`, from 0.01 to 1."""
        require_ratio("ratio", ratio)
        self._require_there()
        wanted = round(ratio, PLACES)
        self._ratio.publish({"data": wanted})
        if not await self._watch.until(lambda: isclose(self.state.override, wanted), AHEAD):
            raise NodeGone(node=self._watch.node)

    async def pause(self, *, ahead: bool = False) -> StopReport:
        """Brake on the path and hold all motion until `resume`; return how long and how far the braking takes.

        With `ahead`, also pause a motion that begins within `AHEAD`. Raises `CannotPause` if no motion is under way,
        and during a homing.
        """
        until = self._loop.time() + AHEAD * self._speed
        while True:
            try:
                report = _report(await self._call(PAUSE, {}))
            except CannotPause:
                if not ahead or self.state.mode is Mode.HOMING or self._loop.time() >= until:
                    raise
                await asyncio.sleep(_AGAIN * self._speed)
            else:
                await self._watch.until(lambda: self.state.mode is Mode.PAUSED, SETTLES)
                return report

    async def resume(self) -> None:
        """Continue motion after a pause; raises `NotPaused`."""
        await self._call(RESUME, {})
        await self._watch.until(lambda: self.state.mode is not Mode.PAUSED, SETTLES)

    async def abort(self) -> None:
        """Stop without deceleration; sent in the same way as `stop`."""
        self.stops += 1
        await self._urgent.say(ABORT)

    async def recover(self, *, take_over: bool = False) -> None:
        """Clear a fault, once its cause is gone; moves nothing. Raises `NotOverRos` for `take_over`."""
        if take_over:
            raise NotOverRos(request="recover with take_over")
        await self._call(RECOVER, {})
        await self._watch.until(lambda: self.state.mode is not Mode.FAULT, SETTLES)

    @property
    def datum(self) -> GivenDatum | None:
        """None: the datum stays in the process of the controller."""
        return None

    async def give_datum(self, joints: Joints, *, by: str) -> None:
        """Raise `NotOverRos`."""
        raise NotOverRos(request="a datum")

    async def confirm_datum(self, joints: Joints, *, by: str) -> None:
        """Raise `NotOverRos`."""
        raise NotOverRos(request="a datum")

    async def guarded_move(self, axis: str, distance: float) -> Jogged:
        """Raise `NotOverRos`."""
        raise NotOverRos(request="a guarded move")

    async def _do(self, row: Row, goal: Message, feedback: Feedback) -> None:
        """Carry out a motion, and return when the topics show its end."""
        self._require_there()
        motion = asyncio.current_task()
        self._motions[motion] = False
        with self._shown():
            try:
                await run_action(self._graph, row, goal, feedback)
            finally:
                await self._watch.settled()
                del self._motions[motion]

    async def _call(self, row: Row, request: Message) -> Message:
        """Call a service; raises `NodeGone` also if the layer's node hangs meanwhile."""
        self._require_there()

        def hangs(event: Event) -> NodeGone | None:
            lost = isinstance(event, Disconnected) and self._watch.hangs
            return NodeGone(node=self._watch.node) if lost else None

        return await cancel_on_event(self.events, hangs, call_service(self._graph, row, request))

    def _hear(self, event: Event) -> None:
        """Count stops; when a node connects, look up its services while the master is available."""
        if isinstance(event, MotionStopped) and not self._is_own_end():
            self.stops += 1
        if isinstance(event, Connected):
            self._graph.expect(*(row.name for row in (STOP, ABORT, PAUSE, RESUME, RECOVER, GRIPPER, OUTPUT)))

    def _is_own_end(self) -> bool:
        """Return whether a reported stop is the end of a motion that this client cancels; there is one for each."""
        for motion, reported in self._motions.items():
            if motion is not None and is_cancelling(motion) and not reported:
                self._motions[motion] = True
                return True
        return False

    def _require_there(self) -> None:
        if not self._watch.there:
            raise NotConnected

    def _here(self) -> Joints:
        """Return where the robot is (rad, m, m); raises `NotHomed`."""
        if self.state.joints is None:
            raise NotHomed(command=self.config.homing_command)
        return self.state.joints

    def _moving(self, name: str, duration: float, vias: Vias | None = None) -> Feedback:
        """Return the receiver of a motion's feedback; `duration` is that of the motion [s], 0 if unknown."""

        def heard(feedback: Message) -> None:
            self._show(Progress(name, feedback["progress"] * duration, duration))
            if vias is not None:
                vias.at(Joints(feedback["a"], feedback["b"], feedback["c"]), self._loop.time())

        return heard

    def _vias(self, path: Route, speed: float, on_via: OnVia) -> Vias | None:
        """Return the tracker of a path's waypoints, None for a path that will be refused."""
        try:
            begun: Path = self._planner.begun_at(path, self._here())
            plan = self._planner.plan(self.workspace, begun, speed)
        except MayaError:
            return None
        return Vias(plan, self._units, on_via, self._loop.time())

    def _duration(self, path: Route, speed: float = 1.0) -> float:
        """Return how long the motion along a path takes [s], 0 for one that will be refused."""
        try:
            return self.preview(path, speed=speed).duration
        except MayaError:
            return 0.0

    def _show(self, progress: Progress | None) -> None:
        self._watch.progress = progress
        self._watch.renew()

    @contextmanager
    def _shown(self) -> Iterator[None]:
        try:
            yield
        finally:
            self._show(None)


def _report(response: Message) -> StopReport:
    """Return the report of a stop from the message of the layer's response."""
    try:
        data = json.loads(response["message"])
        a, b, c = (float(value) for value in data["distance"])
        return StopReport(bool(data["was_moving"]), float(data["duration"]), (a, b, c))
    except (ValueError, KeyError, TypeError):
        return _NOTHING
