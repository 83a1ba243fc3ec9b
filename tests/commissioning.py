"""A commissioning of a twin, judged by the record of its mechanics: nothing moves more than was announced."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field
from random import Random

from dmc41x3.wire.transport import Transport
from maya_un.assembly.controller import Twin, machine_of, make_twin
from maya_un.axes import AXES
from maya_un.cli.commission.rehearsal import TwinPerson
from maya_un.commission.procedure import Commissioning
from maya_un.commission.progress import CommissioningProgress
from maya_un.commission.questions import Question, QuestionKind
from maya_un.commission.steps import STEPS
from maya_un.config import Config
from maya_un.machine.truth import TrueConstants
from maya_un.machine.wiring_faults import WiringFault, drawn

ROUNDING = 1e-5
"""An axis counts as still within this [rad or m]: ten encoder counts of a line."""


@dataclass(slots=True)
class Announced:
    """The last announcement: the key of the question, the place of the axes then, and the bounds."""

    key: str
    mark: int
    place: tuple[float, float, float]
    most: dict[int, float]


@dataclass(slots=True)
class JudgingPerson:
    """The person of a twin, who also looks at the true motion after every announcement.

    `excesses` lists motions beyond what was announced: question, axis, way, bound. `on_ask` is called with every
    question, before its answer; it may give another answer. `answers` are the last ones, by the key of the question.
    """

    twin: Twin
    on_ask: Callable[[Question], str | None] = lambda _question: None
    excesses: list[tuple[str, str, float, float]] = field(default_factory=list[tuple[str, str, float, float]])
    asked: list[str] = field(default_factory=list[str])
    answers: dict[str, str] = field(default_factory=dict[str, str])
    _person: TwinPerson = field(init=False)
    _last: Announced | None = None

    def __post_init__(self) -> None:
        self._person = TwinPerson(self.twin)

    async def ask(self, question: Question) -> str:
        """Answer, and judge what moved since the last announcement."""
        self.judge()
        self.asked.append(question.key)
        if question.ask is QuestionKind.READY:
            record = self.twin.mechanics.record
            self._last = Announced(question.key, record.mark(), self.twin.mechanics.true_joints(), dict(question.most))
        chosen = self.on_ask(question)
        answer = await self._person.ask(question)
        self.answers[question.key] = chosen or answer
        return self.answers[question.key]

    def begin(self, title: str) -> None:
        """Take note."""

    def tell(self, text: str) -> None:
        """Take note."""

    def judge(self) -> None:
        """Note every axis that moved further than announced."""
        self.twin.controller.look()
        if self._last is None:
            return
        window = self.twin.mechanics.record.since(self._last.mark)
        for axis, place in enumerate(self._last.place):
            way = max(window.high[axis] - place, place - window.low[axis])
            bound = self._last.most.get(axis, 0.0)
            if way > bound + ROUNDING:
                self.excesses.append((self._last.key, AXES[axis], way, bound))


@dataclass(slots=True)
class Bench:
    """A twin on which a commissioning runs as often as wanted, each time as a new program."""

    twin: Twin
    config: Config
    progress: CommissioningProgress
    person: JudgingPerson

    async def run(self, *, home: bool = True) -> bool:
        """Begin or continue the commissioning; return whether all steps have passed."""
        steps = STEPS if home else [step for step in STEPS if step.key not in {"home", "calibration"}]
        complete = await self.procedure().run(steps)
        self.person.judge()
        return complete

    def procedure(self) -> Commissioning:
        """Return a procedure that continues."""
        return Commissioning(self._dial, "twin", self.config, self.person, self.progress)

    async def _dial(self) -> Transport:
        return self.twin.controller.loopback()

    @property
    def codes(self) -> dict[str, list[int]]:
        """The codes of the mistakes that were found, by step."""
        return {key: [code for code, _ in one.errors] for key, one in self.progress.results.items() if one.errors}

    @property
    def motors_on(self) -> list[bool]:
        """Whether the amplifier of each controller axis is on."""
        return [axis.on for axis in self.twin.controller.machine.unit.axes]

    async def still(self, seconds: float = 1.0) -> bool:
        """Return whether no axis moves for `seconds` [s]."""
        self.twin.controller.look()
        mark, place = self.twin.mechanics.record.mark(), self.twin.mechanics.true_joints()
        over: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        asyncio.get_running_loop().call_later(seconds, over.set_result, None)
        await over
        self.twin.controller.look()
        window = self.twin.mechanics.record.since(mark)
        return all(
            window.high[axis] - place[axis] < ROUNDING and place[axis] - window.low[axis] < ROUNDING
            for axis in range(3)
        )


def bench(config: Config, truth: TrueConstants | None = None, *, seed: int = 0) -> Bench:
    """Return a bench with a twin of a machine, powered up at a place that `seed` draws; call it in a loop."""
    twin = make_twin(config, seed=seed, truth=truth)
    return Bench(twin, config, CommissioningProgress("twin"), JudgingPerson(twin))


def faulty(config: Config, seed: int, kind: str | None = None) -> WiringFault:
    """Return the machine of a configuration with a mistake in its wiring."""
    return drawn(Random(seed), machine_of(config), kind)
