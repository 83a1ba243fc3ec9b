"""A pendant without a screen: the robot that runs, asked and moved without ever waiting for it."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Coroutine
from typing import Any

from dmc41x3.i18n import marked, translate
from dmc41x3.wire import emergency
from maya_un import runtime
from maya_un.cli.client import ServiceClient
from maya_un.cli.pendant.keys import STEPS
from maya_un.cli.pendant.nearest import LimitDistance, distances
from maya_un.client import requests
from maya_un.errors import MayaError
from maya_un.kinematics.workspace import Workspace
from maya_un.values import Joints

REFRESH = 0.2
"""Time between two looks at the robot [s]."""

LONGEST_JOG = 600.0
"""Longest wait for one step [s]."""

_ANSWER = 2.0
_STOP = 0.5
_STOPPING = marked("Stopping: at rest within {seconds:.2f} s.")


class PendantSession:
    """Steps, stops and teaches; `status` is the robot's as JSON has it, `notes` what there was to say.

    `trouble` is why the robot does not answer, empty where it does.
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
        """Whether a step is under way."""
        return self._stepping is not None and not self._stepping.done()

    @property
    def joints(self) -> Joints | None:
        """Where the robot is (rad, m, m), None where nobody knows."""
        joints = self.status["state"]["joints"] if self.status else None
        return None if joints is None else Joints(*joints)

    def nearest(self) -> list[LimitDistance]:
        """Return the distances to all limits, the nearest first; none where nobody knows where the robot is."""
        return [] if self.joints is None else distances(self._workspace, self.joints)

    def say(self, text: str, **details: object) -> None:
        """Note a text, translated and with its details."""
        self.notes.append(translate(text, self._language, **details))

    def move(self, axis: str, direction: int) -> None:
        """Go one step along an axis, as far as the workspace allows; while one is under way nothing happens."""
        if not self.stepping:
            self._stepping = self._spawn(self._move(axis, direction * STEPS[self.step].of(axis)))

    def stop(self) -> None:
        """Stop the robot, whatever it does."""
        self._spawn(self._stop())

    def teach(self, name: str, *, replacing: bool = False) -> None:
        """Keep where the robot is under a name."""
        self._spawn(self._teach(name, replacing))

    async def watch(self) -> None:
        """Keep the status true; runs until it is cancelled."""
        while True:
            await self.look()
            await asyncio.sleep(REFRESH)

    async def look(self) -> None:
        """Ask for the status once."""
        try:
            self.status = await asyncio.to_thread(self._client.ask, requests.status(), _ANSWER)
            self.trouble = ""
        except MayaError as error:
            self.trouble = error.text(self._language)

    async def close(self) -> None:
        """Stop a step that is under way, and wait until all has been answered."""
        if self.stepping:
            self.stop()
        await self.settled()

    async def settled(self) -> None:
        """Wait until all that was asked for has been answered."""
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
            self.notes.append(str(done["reason"]))

    async def _stop(self) -> None:
        try:
            report = await asyncio.to_thread(self._client.ask, requests.stop(), _STOP)
        except MayaError as error:
            await self._stop_directly(error)
            return
        self.say(_STOPPING if report["was_moving"] else marked("Nothing was moving."), seconds=report["duration"])

    async def _stop_directly(self, error: MayaError) -> None:
        """Tell the controller itself, where the service does not answer and there is a controller to tell."""
        running = runtime.find()
        try:
            if running is None or running.controller is None:
                raise error
            await asyncio.to_thread(emergency.stop, *running.controller, _ANSWER)
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
