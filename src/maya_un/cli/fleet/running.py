"""`maya fleet run`: carry out a process file, continue an interrupted process, record decisions."""

from __future__ import annotations

import asyncio
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from dmc41x3.i18n import translate, visible
from maya_un.cli import output
from maya_un.cli.fleet.robots import end_text, progress_text, waiting_text
from maya_un.cli.settings import OutputSettings
from maya_un.errors import DecisionNeeded, InvalidCommandLine, MayaError, ProcessAborted, UnknownName
from maya_un.steps.text import StepEnd, StepProgress
from maya_un.supervisor import Supervisor
from maya_un.supervisor.lab import ONLINE
from maya_un.supervisor.process import (
    FailureDecision,
    FleetProcess,
    FleetProcessRunner,
    ProcessRecord,
    ProcessStep,
    ProcessStepState,
    load_process,
    recorded,
)


class FleetRunOptions(NamedTuple):
    """Options of `maya fleet run`; `state` is the file of finished steps, None for the default file."""

    file: str
    url: str | None = None
    state: str | None = None
    check: bool = False
    again: bool = False
    retry: tuple[str, ...] = ()
    skip: tuple[str, ...] = ()
    abort: bool = False


def run(options: FleetRunOptions, settings: OutputSettings) -> int:
    """Carry out a process and return the exit code; raises the errors of its parts."""
    path = Path(options.file)
    process = load_process(path)
    if options.check:
        plan = {"process": process.name, "steps": len(process.steps)}
        return output.answer(plan, translate("{path} is a valid process.", settings.language, path=path), settings)
    state = Path(options.state) if options.state else path.with_name(f"{path.name}.state")
    with recorded(state, process, again=options.again) as record:
        _decide(record, options)
        _greet(record, settings)
        before = record.finished
        error = None if before else _carried_out(record, options, settings)
        return _concluded(record, error, settings, before=before)


def _decide(record: ProcessRecord, options: FleetRunOptions) -> None:
    """Record the decisions in the command line; raises `UnknownName` for a step that has not failed."""
    for name in (*options.retry, *options.skip):
        if name not in record.failed():
            raise UnknownName(name=name, known=", ".join(record.failed()) or "no failed step")
    if set(options.retry) & set(options.skip):
        raise InvalidCommandLine(reason="the same step is given to --retry and to --skip", command="maya fleet run")
    for name in options.retry:
        record.decided(name, FailureDecision.RETRY)
    for name in options.skip:
        record.decided(name, FailureDecision.SKIP)
    if options.abort:
        record.abort()


def _greet(record: ProcessRecord, settings: OutputSettings) -> None:
    if settings.json:
        return
    process = record.process
    robots = ", ".join(dict.fromkeys(step.robot for step in process.steps.values()))
    output.say(
        translate(
            "{name}: {steps} steps for {robots}.",
            settings.language,
            name=process.name,
            steps=len(process.steps),
            robots=robots,
        )
    )
    over = sum(entry.state in {ProcessStepState.DONE, ProcessStepState.SKIPPED} for entry in record.entries.values())
    if 0 < over < len(process.steps):
        output.say(
            translate(
                "{over} of {steps} steps have ended; the process continues.",
                settings.language,
                over=over,
                steps=len(process.steps),
            )
        )


def _carried_out(record: ProcessRecord, options: FleetRunOptions, settings: OutputSettings) -> MayaError | None:
    """Carry out the remaining steps, with prompts on a terminal; return the error that ended it early, or None."""
    while True:
        try:
            record.require_not_aborted()
            asyncio.run(_run(record, options.url, settings))
        except DecisionNeeded as error:
            if settings.json or not sys.stdin.isatty():
                return error
            output.say(visible(error.text(settings.language)))
            _ask(record, str(error.details["step"]), settings.language)
        except ProcessAborted as error:
            return error
        except KeyboardInterrupt:
            if not settings.json:
                output.say(
                    translate(
                        "Interrupted. Running steps continue; the same command continues with the rest.",
                        settings.language,
                    )
                )
            raise
        else:
            return None


async def _run(record: ProcessRecord, url: str | None, settings: OutputSettings) -> None:
    async with Supervisor(url) as lab:
        _tell_absent(record.process, lab, settings)
        await FleetProcessRunner(record, lab, lambda step, report: _tell(step, report, settings)).run()


def _tell_absent(process: FleetProcess, lab: Supervisor, settings: OutputSettings) -> None:
    """Print the robots that are not connected; their steps wait for them."""
    for robot in dict.fromkeys(step.robot for step in process.steps.values()):
        state = lab.robots.get(robot, "unknown")
        if state != ONLINE and not settings.json:
            output.say(visible(waiting_text(robot, state, settings.language)))


def _tell(step: ProcessStep, report: StepProgress | StepEnd, settings: OutputSettings) -> None:
    if settings.json:
        return
    if isinstance(report, StepProgress):
        output.say(visible(progress_text(step.robot, report, settings.language)))
    else:
        output.say(visible(end_text(step.robot, step.id, report, settings.language)))


def _ask(record: ProcessRecord, step: str, language: str) -> None:
    """Prompt for the decision about a failed step; raises `InvalidCommandLine` at the end of the input."""
    while True:
        try:
            said = (
                input(translate("Choose what to do with step {step} (retry, skip, abort): ", language, step=step))
                .strip()
                .lower()
            )
        except EOFError:
            raise InvalidCommandLine(reason="no choice was given", command="maya fleet run") from None
        with suppress(ValueError):
            return record.decided(step, FailureDecision(said))
        output.say(translate("One of: retry, skip, abort", language))


def _concluded(record: ProcessRecord, error: MayaError | None, settings: OutputSettings, *, before: bool) -> int:
    """Report the state of the process, and return the exit code."""
    if settings.json:
        output.emit(_report(record.process, record, error))
    elif error is not None:
        output.complain(error, settings)
    else:
        states = [entry.state for entry in record.entries.values()]
        counts = {
            "steps": len(states),
            "done": states.count(ProcessStepState.DONE),
            "skipped": states.count(ProcessStepState.SKIPPED),
        }
        output.say(
            translate(
                "All {steps} steps had ended before, so nothing was sent. --again starts over."
                if before
                else "All {steps} steps have ended: {done} done, {skipped} skipped.",
                settings.language,
                **counts,
            )
        )
    return output.DONE if error is None else output.FAILED


def _report(process: FleetProcess, record: ProcessRecord, error: MayaError | None) -> dict[str, Any]:
    state = "done" if error is None else "aborted" if record.aborted else "waiting"
    return {"process": process.name, "state": state, "steps": [_step(record, id_) for id_ in process.steps]}


def _step(record: ProcessRecord, id_: str) -> dict[str, Any]:
    entry, step = record.entries[id_], record.process.steps[id_]
    found = entry.result
    result = {} if found is None else {"code": found.code, "error": found.error}
    return {"id": id_, "robot": step.robot, "command": step.command, "state": entry.state.value, **result}
