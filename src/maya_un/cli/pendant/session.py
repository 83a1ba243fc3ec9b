"""The session of the pendant, without a screen: keys, steps, distances to limits, and requests to the robot.

Requests run in the background, so the session never waits for the robot. Distances of different kinds are made
comparable to find the nearest limit.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Coroutine, Iterator
from math import hypot, radians
from typing import Any, NamedTuple

from dmc41x3.i18n import marked, translate, translate_phrase
from dmc41x3.wire import emergency
from maya_un import runtime
from maya_un.cli.client import ServiceClient
from maya_un.cli.units import OutputUnits
from maya_un.client import requests
from maya_un.errors import MayaError
from maya_un.kinematics.limits import unit
from maya_un.kinematics.workspace import Workspace
from maya_un.values import Joints

AXES = "xyzrabc"
"""Directions: the gripper along x, y, z and away from the boom's axis (r), or one of the axes a, b, c."""


class KeyStep(NamedTuple):
    """Distance of one key press: `length` [m], for the boom `angle` [rad]."""

    length: float
    angle: float

    def of(self, axis: str) -> float:
        """Return the distance along an axis (rad or m)."""
        return self.angle if axis == "a" else self.length


STEPS = {
    "1": KeyStep(0.001, radians(0.1)),
    "2": KeyStep(0.010, radians(1.0)),
    "3": KeyStep(0.050, radians(5.0)),
}
"""The steps, by the key that selects each."""

_ARROWS = {
    "right": ("x", 1),
    "left": ("x", -1),
    "up": ("y", 1),
    "down": ("y", -1),
    "pageup": ("z", 1),
    "pagedown": ("z", -1),
}

MOVES: dict[str, tuple[str, int]] = {
    **{axis: (axis, 1) for axis in AXES},
    **{axis.upper(): (axis, -1) for axis in AXES},
    **_ARROWS,
}
"""Axis and direction by the name of the key: a letter moves forward, its capital back."""


HEIGHT_OF_A_LOAD = 0.04
"""Additional height of the gripper for each multiple of the load that remains [m].

Between tension limits of 2 and 5 times the load, the ceiling in the middle of the default machine rises from 1.94 to
2.07 m. The value only ranks the limits, so it need not be exact.
"""


class LimitDistance(NamedTuple):
    """Distance to the limit or zone `name`: `margin` in its `unit` ("m", "rad" or "load"), `rank` in m."""

    name: str
    margin: float
    unit: str
    rank: float

    def text(self, units: OutputUnits) -> str:
        """Return the name and the margin."""
        if self.unit == "load":
            return f"{self.name} {self.margin:.2f} × load"
        return f"{self.name} {units.length(self.margin) if self.unit == 'm' else units.angle(self.margin)}"


def distances(workspace: Workspace, joints: Joints) -> list[LimitDistance]:
    """Return the distances of joints (rad, m, m) to every limit and zone, nearest first."""
    return sorted(_distances(workspace, joints), key=lambda distance: distance.rank)


def _distances(workspace: Workspace, joints: Joints) -> Iterator[LimitDistance]:
    margins = workspace.margins(joints)
    u, _ = workspace.mechanism.section(joints)
    metres = {"m": 1.0, "rad": hypot(workspace.mechanism.delta + u), "load": HEIGHT_OF_A_LOAD}
    for limit, margin in margins.limits.items():
        kind = unit(limit)
        yield LimitDistance(limit.value.replace("_", " "), margin, kind, margin * metres[kind])
    for zone, clearance in margins.zones:
        yield LimitDistance(f"zone {zone}", clearance, "m", clearance)


REFRESH = 0.2
"""Period of reading the robot's status [s]."""

LONGEST_JOG = 600.0
"""Longest wait for one step [s]."""

_ANSWER = 2.0
_STOP = 0.5
_STOPPING = marked("Stopping: at rest within {seconds:.2f} s.")


class PendantSession:
    """Steps, stops and teaches; `status` is the robot's Status as JSON data, `notes` are messages for the person.

    `trouble` is the reason why the robot does not answer, "" if it does.
    """

    def __init__(self, client: ServiceClient, workspace: Workspace, language: str) -> None:
        self._client = client
        self._workspace = workspace
        self._language = language
        self._stepping: asyncio.Task[None] | None = None
        self._beside: set[asyncio.Task[None]] = set()
        self.step = "2"
        self.status: dict[str, Any] = {}
        self.trouble = ""
        self.notes: deque[str] = deque(maxlen=4)

    @property
    def stepping(self) -> bool:
        """Whether a step is running."""
        return self._stepping is not None and not self._stepping.done()

    @property
    def joints(self) -> Joints | None:
        """The joints of the robot (rad, m, m), None if unknown."""
        joints = self.status["state"]["joints"] if self.status else None
        return None if joints is None else Joints(*joints)

    def nearest(self) -> list[LimitDistance]:
        """Return the distances to all limits, nearest first; none if the position is unknown."""
        return [] if self.joints is None else distances(self._workspace, self.joints)

    def say(self, text: str, **details: object) -> None:
        """Add a translated text with its details to the notes."""
        self.notes.append(translate(text, self._language, **details))

    def move(self, axis: str, direction: int) -> None:
        """Move one step along an axis, as far as the workspace allows; do nothing while a step is running."""
        if not self.stepping:
            self._stepping = self._spawn(self._move(axis, direction * STEPS[self.step].of(axis)))

    def stop(self) -> None:
        """Stop the robot in any state."""
        self._spawn(self._stop())

    def teach(self, name: str, *, replacing: bool = False) -> None:
        """Store the current position under a name."""
        self._spawn(self._teach(name, replacing))

    async def watch(self) -> None:
        """Update the status periodically until cancelled."""
        while True:
            await self.look()
            await asyncio.sleep(REFRESH)

    async def look(self) -> None:
        """Read the status once."""
        try:
            self.status = await asyncio.to_thread(self._client.ask, requests.status(), _ANSWER)
            self.trouble = ""
        except MayaError as error:
            self.trouble = error.text(self._language)

    async def close(self) -> None:
        """Stop a running step, and wait until all requests are answered."""
        if self.stepping:
            self.stop()
        await self.settled()

    async def settled(self) -> None:
        """Wait until all requests are answered."""
        while self._beside:
            await asyncio.wait(self._beside)

    async def _move(self, axis: str, distance: float) -> None:
        request = requests.jog_by(axis, distance)
        try:
            done = await asyncio.to_thread(self._client.ask, request, LONGEST_JOG)
        except MayaError as error:
            self.notes.append(error.text(self._language))
            return
        if done["limit"]:
            self.notes.append(translate_phrase(str(done["reason"]), self._language))

    async def _stop(self) -> None:
        try:
            report = await asyncio.to_thread(self._client.ask, requests.stop(), _STOP)
        except MayaError as error:
            await self._stop_directly(error)
            return
        self.say(_STOPPING if report["was_moving"] else marked("Nothing was moving."), seconds=report["duration"])

    async def _stop_directly(self, error: MayaError) -> None:
        """Stop the controller directly if the service does not answer and a controller exists."""
        running = runtime.find()
        try:
            if running is None or running.controller is None:
                raise error
            await asyncio.to_thread(emergency.stop, running.controller, _ANSWER)
            self.say(_STOPPING, seconds=0.0)
        except MayaError as worse:
            self.say(marked("NOT STOPPED: {reason} Press the emergency stop."), reason=worse.text(self._language))

    async def _teach(self, name: str, replacing: bool) -> None:
        from maya_un.cli.places.teach import keep

        try:
            text = await asyncio.to_thread(keep, self._client, name, self._language, replacing)
        except MayaError as error:
            self.notes.append(error.text(self._language))
        else:
            self.notes.append(text)

    def _spawn(self, work: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
        task = asyncio.get_running_loop().create_task(work)
        self._beside.add(task)
        task.add_done_callback(self._beside.discard)
        return task
