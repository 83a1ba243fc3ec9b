"""The agent of one robot: forwards commands of supervisors to the robot, and its reports to them.

The agent sends commands in the order of their arrival, each one after the robot has accepted the previous one. After a
lost connection on either side, it connects again and repeats the messages that were not answered. The robot's journal
recognises ids, so no command runs twice.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from random import Random
from typing import Any

from dmc41x3.i18n import phrase
from maya_un.coms.robot import Rosbridge, RosbridgeLink
from maya_un.coms.transport import (
    Report,
    ReportKind,
    SupervisorChannel,
    SupervisorCommand,
    SupervisorTransport,
    first_to_end,
    keep,
)
from maya_un.errors import InvalidMessage, InvalidRequest, KeyReused, MayaError, SessionTakenOver, WrongRobot
from maya_un.steps.text import RobotIdentity, StepEnd, as_id, content_of, id_of, read

LONGEST = 65_536
"""Maximum length of a command [bytes]; the agent refuses a longer one unread."""

_PATIENCE = 0.25
"""The agent repeats a command that the robot has not accepted within this time [s]; each further wait is twice as long.
"""

_LONGEST_PATIENCE = 5.0

_REMEMBERED = 1000
"""Maximum number of sent results that the agent recognises if the robot repeats them, and of results of unknown steps.
"""


@dataclass(slots=True)
class _Pending:
    """A command whose result was not sent: `report` is the robot's latest, `sent` is True if it was forwarded.

    `keys` are those of its deliveries in this connection: a command may arrive several times, and each delivery gets
    the result. `content` is the part that the journal compares, as JSON text. `text` and `content` are "" while only
    the robot knows the command.
    """

    text: str
    content: str
    keys: list[str] = field(default_factory=list)
    report: Report | None = None
    sent: bool = True

    @property
    def ended(self) -> bool:
        return self.report is not None and self.report.kind is ReportKind.RESULT


class Agent:
    """Agent that carries commands and reports between robot `name` and its supervisors while `run` runs.

    `date` returns the date (ISO 8601, UTC); `rng` draws the pauses between attempts.
    """

    def __init__(
        self,
        name: str,
        robot: Rosbridge,
        transport: SupervisorTransport,
        date: Callable[[], str],
        rng: Random | None = None,
    ) -> None:
        self._name = name
        self._robot = robot
        self._transport = transport
        self._date = date
        self._rng = rng or Random()
        self._pending: dict[str, _Pending] = {}
        self._refused: dict[str, Report] = {}
        self._sent: dict[str, str] = {}
        self._accepted = asyncio.Event()
        self._commands = asyncio.Event()
        self._reports = asyncio.Event()
        self._journal = ""
        self._met = asyncio.Event()
        self._replaced = asyncio.Event()
        self._troubles: dict[str, MayaError | str | None] = {"robot": "connecting", "supervisors": "connecting"}

    async def run(self) -> None:
        """Keep both connections until cancelled."""
        async with asyncio.TaskGroup() as group:
            group.create_task(keep(self._serve_robot, self._failed("robot"), self._rng))
            group.create_task(keep(self._serve_supervisors, self._failed("supervisors"), self._rng))

    def status(self) -> dict[str, Any]:
        """Return the state of both connections, and what they wait for, as JSON data."""
        sides = {
            side: {"url": url, **_waiting(self._troubles[side])}
            for side, url in (("robot", self._robot.where), ("supervisors", self._transport.where))
        }
        return {"name": self._name, **sides, "steps": {id_: _state(one) for id_, one in self._pending.items()}}

    def _failed(self, side: str) -> Callable[[MayaError], None]:
        def failed(error: MayaError) -> None:
            self._troubles[side] = error
            if isinstance(error, SessionTakenOver):  # the other robot gets the commands that this one has not accepted
                self._forget(lambda one: one.report is None)

        return failed

    def _forget(self, those: Callable[[_Pending], bool]) -> None:
        self._pending = {id_: one for id_, one in self._pending.items() if not those(one)}

    async def _serve_supervisors(self) -> None:
        if self._transport.needs_journal and not self._met.is_set():
            self._troubles["supervisors"] = "the robot"
            await self._met.wait()
        self._replaced.clear()
        async with self._transport.connected(self._name, self._journal) as channel:
            self._troubles["supervisors"] = None
            self._refused.clear()  # these commands arrive again, under other keys
            for one in self._pending.values():
                one.keys.clear()
                one.sent = one.report is None
            self._reports.set()
            await first_to_end(self._take_commands(channel), self._send_reports(channel), self._replaced.wait())

    async def _take_commands(self, channel: SupervisorChannel) -> None:
        while True:
            self._take(await channel.receive())

    def _take(self, command: SupervisorCommand) -> None:
        """Register a command for the robot; refuse an unreadable one, or one with the id of another pending command."""
        try:
            id_, data = self._understood(command)
        except MayaError as error:
            self._refuse(command, as_id(command.id), error, {})
            return
        known, content = self._pending.get(id_), _compared(data)
        if known is not None and known.content not in {"", content}:
            self._refuse(command, id_, KeyReused(key=id_), data)
        elif known is None or not known.text:  # the robot's journal knows whether it answered this content
            self._pending[id_] = _Pending(json.dumps(data), content, [command.key])
            self._commands.set()
        else:
            known.keys.append(command.key)
            known.sent = known.report is None
            self._reports.set()

    def _refuse(self, command: SupervisorCommand, id_: str | None, error: MayaError, data: dict[str, Any]) -> None:
        """Refuse a command without the robot; the refusal must not look like the result of a pending command."""
        if id_ in self._pending:
            result = StepEnd.refused(id_, KeyReused(key=id_), self._date(), content=content_of(data))
        else:
            result = StepEnd.refused(id_, error, self._date())
        self._refused[command.key] = Report(id_, ReportKind.RESULT, result.text, command.key)
        self._reports.set()

    def _understood(self, command: SupervisorCommand) -> tuple[str, dict[str, Any]]:
        """Return the id of a command and its data as sent to the robot; raises the `MayaError` that refuses it."""
        if len(command.text) > LONGEST:
            raise InvalidMessage(name=phrase("the step"), reason=phrase("it has more than {most} bytes", most=LONGEST))
        try:
            data = read(command.text.decode())
        except UnicodeDecodeError as error:
            raise InvalidMessage(name=phrase("the step"), reason="it is not UTF-8") from error
        if data.get("id") is None:
            data["id"] = command.id
        id_ = id_of(data)  # the robot reports no step under an invalid id, so the agent would wait for ever
        if id_ is None:
            raise InvalidRequest(key="id", reason="it is missing; without one a command could run twice")
        if data.get("robot") is None:
            data["robot"] = self._name  # the robot itself refuses a step for another robot
        if "command" not in data and self._transport.default_command is not None:
            data["command"] = self._transport.default_command
        return id_, data

    async def _send_reports(self, channel: SupervisorChannel) -> None:
        while True:
            await self._reports.wait()
            self._reports.clear()
            for key, refusal in tuple(self._refused.items()):
                await channel.send(refusal)
                del self._refused[key]
            for id_, one in tuple(self._pending.items()):
                await self._send_report(channel, id_, one)

    async def _send_report(self, channel: SupervisorChannel, id_: str, one: _Pending) -> None:
        """Send the latest report of a command, if it was not sent."""
        report = one.report
        if one.sent or report is None:
            return
        ended = report.kind is ReportKind.RESULT
        keys: tuple[str | None, ...] = tuple(one.keys) or (None,)
        for key in keys if ended else keys[-1:]:
            await channel.send(replace(report, key=key))
        if ended:
            one.keys = [key for key in one.keys if key not in keys]
        if one.report is not report or (ended and one.keys):
            return  # a newer report, or the same command again, arrived meanwhile
        one.sent = True
        if ended and self._pending.get(id_) is one:
            self._remember(id_, report.text)

    def _remember(self, id_: str, text: str) -> None:
        """Forget a command whose result was sent."""
        del self._pending[id_]
        self._sent[id_] = text
        if len(self._sent) > _REMEMBERED:
            del self._sent[next(iter(self._sent))]

    async def _serve_robot(self) -> None:
        async with self._robot.connected() as link:
            self._troubles["robot"] = "firebase_bridge, which does not publish the name of the robot on /step_robot"
            here = asyncio.Event()
            for one in self._pending.values():
                if not one.ended:
                    one.report = None  # its result may have been lost with the connection
            await first_to_end(self._hear_robot(link, here), self._send_commands(link, here))

    async def _send_commands(self, link: RosbridgeLink, here: asyncio.Event) -> None:
        await here.wait()
        while True:
            self._commands.clear()
            waiting = [id_ for id_, one in self._pending.items() if one.report is None]
            for id_ in waiting:
                await self._hand_over(link, id_)
            if not waiting:
                await self._commands.wait()

    async def _hand_over(self, link: RosbridgeLink, id_: str) -> None:
        """Send a command until the robot accepts or answers it, or it is no longer pending for this robot."""
        patience = _PATIENCE
        while (one := self._pending.get(id_)) is not None and one.report is None:
            await link.send(one.text)
            try:
                async with asyncio.timeout(patience):
                    while one.report is None:
                        self._accepted.clear()
                        await self._accepted.wait()
            except TimeoutError:
                self._troubles["robot"] = "firebase_bridge, which does not answer on /step_status"
                patience = min(2.0 * patience, _LONGEST_PATIENCE)
        self._troubles["robot"] = None

    async def _hear_robot(self, link: RosbridgeLink, here: asyncio.Event) -> None:
        while True:
            heard = await link.receive()
            if isinstance(heard, str):
                self._troubles["robot"] = heard
            elif isinstance(heard, Report):
                self._note(heard)
            else:
                self._meet(heard)
                if not here.is_set():
                    await link.prepare()
                    self._troubles["robot"] = None
                    here.set()

    def _meet(self, robot: RobotIdentity) -> None:
        """Record the identity of the robot; raises `WrongRobot` for another name than this agent's.

        A new journal does not know the steps of the previous one. Their commands arrive again, and the transport
        decides whether they run.
        """
        if robot.name != self._name:
            raise WrongRobot(url=self._robot.where, found=robot.name, name=self._name)
        if self._journal not in {"", robot.journal}:
            self._forget(lambda one: not one.ended)
            self._replaced.set()
        self._journal = robot.journal
        self._met.set()

    def _note(self, report: Report) -> None:
        """Record a report of the robot about a step."""
        assert report.id is not None
        one = self._pending.get(report.id)
        if _of_other_content(report, one):
            return
        if one is None:
            if report.kind is not ReportKind.RESULT or self._sent.get(report.id) == report.text:
                return
            one = self._pending[report.id] = _Pending("", "")  # from an earlier run, or from no supervisor
            self._forget_unknown()
        if not one.ended:
            one.report, one.sent = report, False
            self._reports.set()
        self._accepted.set()

    def _forget_unknown(self) -> None:
        """Forget the oldest results of steps that no supervisor sent to this program, if there are too many.

        If a supervisor did send such a step, its command arrives again, and the robot's journal has its result.
        """
        unknown = [id_ for id_, one in self._pending.items() if not one.text]
        for id_ in unknown[:-_REMEMBERED]:
            del self._pending[id_]


def _waiting(trouble: MayaError | str | None) -> dict[str, object]:
    code = trouble.code if isinstance(trouble, MayaError) else None
    return {"connected": trouble is None, "waits_for": None if trouble is None else str(trouble), "code": code}


def _compared(data: dict[str, Any]) -> str:
    """Return the content of a command as text, so that contents can be compared."""
    return json.dumps(content_of(data), sort_keys=True)


def _of_other_content(report: Report, one: _Pending | None) -> bool:
    """Return whether a report refuses a command of another program that used the id of this command."""
    content = json.loads(report.text).get("content") if report.kind is ReportKind.RESULT else None
    return content is not None and (one is None or json.dumps(content, sort_keys=True) != one.content)


def _state(one: _Pending) -> str:
    return "sending" if one.report is None else one.report.kind.value
