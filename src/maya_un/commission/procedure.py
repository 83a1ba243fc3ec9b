"""Carry out the declared steps of a commissioning, and keep what they found."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping, Sequence
from contextlib import AsyncExitStack
from dataclasses import dataclass
from typing import Any

from dmc41x3.i18n import Phrase, phrase
from maya_un.axes import AXES
from maya_un.commission.guarded import Bounds, GuardedMachine, claimed
from maya_un.commission.progress import CheckResult, CheckState, CommissioningProgress
from maya_un.commission.questions import DONE, GO, QUIT, SKIP, Person, PossibleAnswer, Question, QuestionKind
from maya_un.config import Config
from maya_un.config.files import checked
from maya_un.config.settings import nested
from maya_un.controller.registers import Dial
from maya_un.errors import ConnectFailed, LinkLost, LinkTimeout, MachineError, MayaError, NotConnected

_LINK = (ConnectFailed, LinkLost, LinkTimeout, NotConnected)

_READY = (PossibleAnswer(GO, phrase("Enter: go on")), PossibleAnswer(SKIP, phrase("s: skip this step")))
_QUIT = PossibleAnswer(QUIT, phrase("q: quit"))
_QUIT_FOR_NOW = PossibleAnswer(QUIT, phrase("q: quit; a later `maya commission` continues here"))


class SkippedByPerson(Exception):
    """The person skips the step."""


class LeftToPerson(Exception):
    """The machine cannot do this step; a person does it later."""


class QuitByPerson(Exception):
    """The person ends the commissioning for now."""


@dataclass(frozen=True, slots=True)
class CommissioningStep:
    """A step: its stable `key`, its title, what it does (for people), and the steps that must have passed before.

    With `again`, every program that continues a commissioning repeats the step.
    """

    key: str
    title: Phrase
    does: Phrase
    run: Callable[[Commissioning], Awaitable[None]]
    needs: tuple[str, ...] = ()
    again: bool = False


class Commissioning:
    """One commissioning of the controller that `dial` reaches, with a person; `config` has all corrections so far.

    `waiting` lengthens the time limits of a configuration for a twin with a faster clock. `take_over` takes the
    controller from another program that owns it.
    """

    def __init__(
        self,
        dial: Dial,
        address: str,
        config: Config,
        person: Person,
        progress: CommissioningProgress,
        waiting: Callable[[Config], Config] = lambda config: config,
        *,
        take_over: bool = False,
    ) -> None:
        self.waiting = waiting
        self.dial = dial
        self.address = address
        self.person = person
        self.progress = progress
        self._take_over = take_over
        self._present = config
        self._result = CheckResult()
        self._fatal = False
        self._open = AsyncExitStack()
        self._machine: GuardedMachine | None = None
        self.config = self._corrected(progress.changes) or config

    async def run(self, steps: Sequence[CommissioningStep]) -> bool:
        """Carry out the steps that have not passed yet; return whether all have passed.

        A cancellation, a lost link and a request that is refused end it; the results stay. Raises the errors of the
        link, those of claiming the controller, and those of the person.
        """
        if not all(self.progress.done(step.key) for step in steps):
            for step in steps:
                if step.again and step.key in self.progress.results:
                    self.progress.results[step.key] = CheckResult()
        try:
            for step in steps:
                await self._step(step)
        except QuitByPerson:
            return False
        finally:
            await self.disconnect()
        return all(self.progress.done(step.key) for step in steps)

    async def _step(self, step: CommissioningStep) -> None:
        if self.progress.done(step.key):
            self.person.tell(phrase("{title}: passed before.", title=step.title))
            return
        self._result, self._fatal = CheckResult(), False
        self.progress.results[step.key] = self._result
        missing = [key for key in step.needs if not self.progress.done(key)]
        if missing:
            self._result.state = CheckState.BLOCKED
            self._result.readings["needs"] = ", ".join(missing)
            self.progress.save()
            return
        self.person.begin(step.title)
        try:
            await step.run(self)
            corrected = CheckState.CORRECTED if self._result.errors else CheckState.PASSED
            self._result.state = CheckState.FAILED if self._fatal else corrected
        except SkippedByPerson:
            await self._calm()
            self._result.state = CheckState.SKIPPED
        except LeftToPerson:
            self._result.state = CheckState.LEFT_TO_PERSON
        except _LINK as error:
            self._note(error)
            raise
        except MachineError as error:
            await self._calm()
            self.found(error)
            self._result.state = CheckState.FAILED
        finally:
            self.progress.save()

    async def _calm(self) -> None:
        if self._machine is not None:
            await self._machine.rest()

    async def machine(self) -> GuardedMachine:
        """Return the claimed controller; connects if necessary."""
        if self._machine is None:
            self._machine = await self._open.enter_async_context(
                claimed(self.dial, self.address, self.waiting(self.config), take_over=self._take_over)
            )
            await self._support(self._machine)
        return self._machine

    async def _support(self, machine: GuardedMachine) -> None:
        """Let the person support the gripper if drums do not lock, so that the motors can be switched off."""
        if machine.supported:
            return
        text = phrase("The drums do not lock. Support the gripper, so that the lines do not carry it.")
        await self.ask(Question("connection.support", QuestionKind.SUPPORT, text, DONE))
        machine.supported = True
        await machine.rest()

    async def disconnect(self) -> None:
        """Stop the axes, and release the controller."""
        self._machine = None
        await self._open.aclose()

    def found(self, error: MayaError) -> None:
        """Report a mistake that a person must remove."""
        self._fatal = True
        self._note(error)

    @property
    def has_found(self) -> bool:
        """Whether this step has found a mistake that a person must remove."""
        return self._fatal

    def _note(self, error: MayaError) -> None:
        self._result.errors.append((error.code, str(error)))
        self.person.tell(phrase("error {code}: {text}", code=error.code, text=error))

    async def correct(self, error: MachineError, changes: Mapping[str, Any]) -> None:
        """Report a mistake that a change of the configuration removes, and use that configuration from now on."""
        config = self._corrected({**self.progress.changes, **changes})
        if config is None:
            self.found(error)
            return
        self._note(error)
        self.progress.changes |= changes
        self.config = config
        self.person.tell(phrase("Corrected in the new configuration. The file is written at the end, if you confirm."))
        if self._machine is not None:
            await self._machine.configure(self.waiting(config))

    def propose(self, changes: Mapping[str, Any]) -> None:
        """Add measured values to the new configuration, unless they contradict it."""
        config = self._corrected({**self.progress.changes, **changes})
        if config is not None:
            self.progress.changes |= changes
            self.config = config

    def read(self, **values: object) -> None:
        """Add readings to the report."""
        self._result.readings |= values

    async def ready(self, key: str, text: Phrase, most: Bounds | None = None) -> None:
        """Announce what happens next, and how far axes move at most; raises `SkippedByPerson` and `QuitByPerson`."""
        part = key.split(".")[1]
        axis = AXES.index(part) if part in AXES else None
        choices = (*_READY, _QUIT_FOR_NOW if self.progress.kept else _QUIT)
        if await self.ask(Question(key, QuestionKind.READY, text, choices, axis, most=most or {})) == SKIP:
            raise SkippedByPerson

    async def ask(self, question: Question) -> str:
        """Return the answer to a question; raises `QuitByPerson`."""
        answer = await self.person.ask(question)
        if answer == QUIT:
            raise QuitByPerson
        return answer

    def _corrected(self, changes: Mapping[str, Any]) -> Config | None:
        return checked(nested(changes), self._present)[0]
