"""Run a commissioning: connect it with a controller or a twin, keep its progress, and write the configuration."""

from __future__ import annotations

import asyncio
import signal
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from dmc41x3.address import SIM
from dmc41x3.cli.signals import on_end
from dmc41x3.files import write
from dmc41x3.i18n import marked, phrase, translate, translate_phrase
from dmc41x3.loops import ScaledLoop, run
from dmc41x3.wire.transport import Transport
from maya_un.assembly.controller import make_twin, patient, to_controller
from maya_un.cli import output
from maya_un.cli.addresses import clock_factor, target_address
from maya_un.cli.commission.people import ScriptedPerson, TerminalPerson, answers_of
from maya_un.cli.commission.rehearsal import TwinPerson
from maya_un.cli.configure import config_file, configuration, require_twin, truth_of_twin
from maya_un.cli.settings import OutputSettings
from maya_un.commission.procedure import Commissioning
from maya_un.commission.progress import FILE, CommissioningProgress, report
from maya_un.commission.questions import NO, YES, Person, PossibleAnswer, Question, QuestionKind
from maya_un.commission.steps import STEPS
from maya_un.config import Config
from maya_un.config.settings import nested
from maya_un.config.state_folder import own_state_folder
from maya_un.controller.registers import Dial
from maya_un.schema.configuration import SettingDifference
from maya_un.service import configuring


class CommissionOptions(NamedTuple):
    """The options of `maya commission`."""

    address: str
    restart: bool = False
    answers: str | None = None
    report: str | None = None
    seed: int | None = None
    truth: str | None = None
    speed: float | None = None
    take_over: bool = False


def commission(options: CommissionOptions, settings: OutputSettings) -> int:
    """Commission a machine; return 0 only if all steps have passed.

    Raises the errors of files and of the connection.
    """
    config = configuration(settings)
    address = target_address(options.address, config.controller.address)
    require_twin(
        address, "maya commission", seed=options.seed, truth=options.truth, answers=options.answers, speed=options.speed
    )
    factor = clock_factor(options.speed, address)
    progress = _progress(options, address, config)
    work = _carried_out(options, config, address, progress, settings)
    ended = run(work, (lambda: ScaledLoop(factor)) if address == SIM else None)
    return _concluded(ended, progress, options, config, settings)


def _progress(options: CommissionOptions, address: str, config: Config) -> CommissioningProgress:
    """Return the results so far; those of a rehearsal are not stored."""
    if address == SIM:
        return CommissioningProgress(address)
    path = own_state_folder() / FILE
    if options.restart:
        return CommissioningProgress(address, path)
    return CommissioningProgress.stored(path, address, config)


class _Ended(NamedTuple):
    """How a commissioning ended; `write` if the person wants the configuration to be written."""

    complete: bool
    interrupted: bool
    write: bool = False


async def _carried_out(
    options: CommissionOptions,
    config: Config,
    address: str,
    progress: CommissioningProgress,
    settings: OutputSettings,
) -> _Ended:
    shown = TerminalPerson(settings)
    if progress.damaged:
        shown.tell(
            phrase(
                "The stored progress in {path} is damaged, or does not fit the configuration. The commissioning begins "
                "with the first step.",
                path=progress.path,
            )
        )
    async with _machine(options, config, address, shown) as (dial, person):
        waiting = partial(patient, speed=(options.speed or 1.0) if address == SIM else 1.0)
        procedure = Commissioning(dial, address, config, person, progress, waiting, take_over=options.take_over)
        task = asyncio.ensure_future(procedure.run(STEPS))
        with on_end(task.cancel, signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            try:
                complete = await task
            except asyncio.CancelledError:
                shown.tell(
                    phrase("Stopped. Run `maya commission` again to continue.")
                    if progress.kept
                    else phrase("Stopped. A rehearsal always begins with the first step.")
                )
                return _Ended(complete=False, interrupted=True)
        if not progress.changes:
            return _Ended(complete, interrupted=False)
        return _Ended(complete, interrupted=False, write=await _confirmed(person, progress, config, settings))


async def _confirmed(person: Person, progress: CommissioningProgress, config: Config, settings: OutputSettings) -> bool:
    """Show the changes of the configuration, and return whether the person wants to write them."""
    for one in _differences(progress, config, settings):
        person.tell(phrase("{name}: {old} → {new}", name=one.name, old=one.before, new=one.after))
    text = phrase("Write these changes into {path}?", path=config_file(settings))
    choices = (PossibleAnswer(YES, phrase("y: yes")), PossibleAnswer(NO, phrase("n: no")))
    return await person.ask(Question("configuration.write", QuestionKind.CONFIRM, text, choices)) == YES


def _differences(
    progress: CommissioningProgress, config: Config, settings: OutputSettings
) -> tuple[SettingDifference, ...]:
    """Return the differences of the new configuration from the present one, checked as by `PUT /v1/config`."""
    if not progress.changes:
        return ()
    request = {"settings": nested(progress.changes)}
    return _result(configuring.check(request, config_file(settings), config)).from_now


def _result(work: Any) -> Any:
    """Return the result of a computation for a worker."""
    while True:
        try:
            next(work)
        except StopIteration as ended:
            return ended.value


def _concluded(
    ended: _Ended, progress: CommissioningProgress, options: CommissionOptions, config: Config, settings: OutputSettings
) -> int:
    language = settings.language
    differences = _differences(progress, config, settings)
    if ended.write:
        _result(configuring.write({"settings": nested(progress.changes)}, config_file(settings), config))
    titles = {step.key: translate_phrase(step.title, language) for step in STEPS}
    text = report(progress, titles, [(one.name, one.before, one.after) for one in differences], language)
    if options.report is not None:
        write(Path(options.report), text)
    changes = [{"name": one.name, "before": one.before, "after": one.after} for one in differences]
    value = {**progress.data(), "complete": ended.complete, "changes": changes, "written": ended.write}
    output.answer(value, text.rstrip(), settings)
    if ended.interrupted:
        return output.INTERRUPTED
    if not ended.complete and not settings.json:
        output.say(translate(_missing(progress), language))
    return output.DONE if ended.complete else output.FAILED


def _missing(progress: CommissioningProgress) -> str:
    """Return the advice after a commissioning that is not complete, in English."""
    if progress.has_mistakes:
        return marked("Not complete. Remove the mistakes, then run `maya commission` again.")
    if progress.kept:
        return marked("Not complete. Run `maya commission` again to continue.")
    return marked("Not complete. A rehearsal always begins with the first step.")


@asynccontextmanager
async def _machine(
    options: CommissionOptions, config: Config, address: str, shown: TerminalPerson
) -> AsyncIterator[tuple[Dial, Person]]:
    """Yield what reaches the controller, and the person at it."""
    if address != SIM:
        yield to_controller(address, config), shown
        return
    seed = options.seed or 0
    twin = make_twin(config, seed=seed, truth=truth_of_twin(options.truth, config, seed))

    async def to_twin() -> Transport:
        return twin.controller.loopback()

    answers = {} if options.answers is None else answers_of(options.answers)
    try:
        yield to_twin, ScriptedPerson(answers, TwinPerson(twin), shown, ready=sys.stdin.isatty() and not answers)
    finally:
        await twin.controller.close()
