"""`maya job`: one job, from its submission to its end."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from dmc41x3.i18n import marked, phrase, translate
from maya_un.cli import output
from maya_un.cli.client import ServiceClient, called
from maya_un.cli.progress import chosen
from maya_un.cli.queueing import text
from maya_un.cli.queueing.text import clock_text, obstacle
from maya_un.cli.report import as_data, as_text
from maya_un.cli.settings import OutputSettings
from maya_un.cli.units import units_of
from maya_un.cli.waiting import PATIENCE, follow, reason
from maya_un.client import requests
from maya_un.errors import FileUnwritable, InvalidCommandLine, InvalidValue, MayaError, WrongState
from maya_un.process.spec.documents import located
from maya_un.process.spec.job import load_job
from maya_un.vocabulary import STATES, worded

_CHANGEABLE = {"queued", "held", "paused", "interrupted"}

_OPTIONS = {
    "depends_on": "--after",
    "priority": "--priority",
    "notes": "--notes",
    "on_failure": "--on-failure",
    "retries": "--retries",
}
"""Names of the options of a job on the command line."""

_LOOKS = 5
"""After so many looks, `PATIENCE` apart, the check of a waiting job is not awaited any longer."""

_ACCEPTED = marked("Job {id}, {name}: {steps} steps.")


class QueueingOptions(NamedTuple):
    """Options of a job in the queue, or changes of them; None for options that are not given."""

    priority: int | None = None
    held: bool | None = None
    depends_on: tuple[int, ...] | None = None
    notes: str | None = None
    on_failure: str | None = None
    retries: int | None = None
    stepwise: bool | None = None

    def said(self) -> dict[str, Any]:
        """Return the given options."""
        return {key: value for key, value in self._asdict().items() if value is not None}


def submit(file: str, options: QueueingOptions, settings: OutputSettings, *, wait: bool) -> int:
    """Append the job of a file to the queue; with `wait`, follow it to its end. Return the exit code."""
    job = load_job(Path(file))
    client = ServiceClient.find()
    since = client.ask(requests.status())["last_event"]
    body = job.model_dump(mode="json", exclude_none=True, warnings=False)
    with called(_OPTIONS), located(Path(file)):
        accepted = client.ask(requests.submit(body, **options.said()))
    if not wait:
        return output.answer(accepted, _accepted(client, accepted, settings), settings)
    with chosen(settings) as display:
        display.note(translate(_ACCEPTED, settings.language, **accepted))
        report, interrupted = follow(client, accepted["id"], since, display, settings)
    _print(report, settings)
    return output.INTERRUPTED if interrupted else output.concluded(report, settings)


def _accepted(client: ServiceClient, accepted: dict[str, Any], settings: OutputSettings) -> str:
    """Return that a job was accepted, and why it waits: as a student's proposal, or in a paused queue."""
    text = translate(_ACCEPTED, settings.language, **accepted)
    if settings.json:
        return text
    line = _predicted(client, accepted["id"])
    if line is None:
        return text
    why = reason(client, line, settings.language)
    stands = obstacle(line, settings.language) if line.get("obstacle") else ""
    return "\n".join(filter(None, (text, why, stands)))


def _predicted(client: ServiceClient, job: int) -> dict[str, Any] | None:
    """Return the line of a waiting job once its steps are checked, or after a second; None if it does not wait."""
    line: dict[str, Any] | None = None
    for _ in range(_LOOKS):
        last = client.ask(requests.status())["last_event"]
        waiting = client.ask(requests.queue())["waiting"]
        line = next((line for line in waiting if line["id"] == job), None)
        if line is None or line["state"] != "queued" or line["predicted"] is not None or line.get("obstacle"):
            break
        client.ask(requests.events(since=last, wait=PATIENCE))
    return line


def show(job: int, settings: OutputSettings) -> int:
    """Print the report of a job, step by step, also of an ended job."""
    report = ServiceClient.find().ask(requests.report(job))
    _print(report, settings)
    if not settings.json:
        line = report["line"]
        output.say(
            "\n"
            + translate(
                "asked for by {owner} ({source}) at {submitted}, began {began}, ended {ended}",
                settings.language,
                **_dated(line),
            )
        )
        if line["proposal"] and line["state"] == "held":
            output.say(
                translate(
                    "An operator approves this version with: maya job release {job} --version {version}",
                    settings.language,
                    job=job,
                    version=report["version"],
                )
            )
        if line["notes"]:
            output.say(line["notes"])
    return output.DONE


def _print(report: Mapping[str, Any], settings: OutputSettings) -> None:
    if settings.json:
        output.emit(report)
    else:
        output.say(as_text(as_data(report, None), settings.language, units_of(settings)))


def _dated(line: Mapping[str, Any]) -> dict[str, Any]:
    return {**line, **{key: clock_text(line[key]) or "–" for key in ("submitted", "began", "ended")}}


def cancel(job: int, settings: OutputSettings) -> int:
    """Cancel a job; a running job stops on its path."""
    report = ServiceClient.find().ask(requests.cancel(job))
    return output.answer(report, _became(report, settings.language), settings)


def hold(job: int, settings: OutputSettings) -> int:
    """Hold a waiting job."""
    return _line(ServiceClient.find().ask(requests.hold_job(job)), settings)


def release(job: int, version: str | None, settings: OutputSettings) -> int:
    """Release a held job to the queue; approve a proposal in the shown version, or in `version`."""
    client = ServiceClient.find()
    report = client.ask(requests.report(job))
    line = client.ask(requests.release_job(job, version or report["version"]))
    if line["proposal"] and not settings.json:
        steps = [f"  {step['index']:>3}  {step['step']}" for step in report["steps"]]
        output.say("\n".join([translate("You approved this job of {owner}:", settings.language, **line), *steps]))
    return _line(line, settings)


def again(job: int, from_step: int | None, settings: OutputSettings) -> int:
    """Queue an ended job again, from a step on."""
    with called({"from_step": "--from"}):
        line = ServiceClient.find().ask(requests.repeat_job(job, from_step))
    words = translate(
        "Job {id}, {name}: {state}. It repeats job {old}.",
        settings.language,
        old=job,
        **{**line, "state": text.state(line, settings.language)},
    )
    return output.answer(line, words, settings)


def notes(job: int, said: str, settings: OutputSettings) -> int:
    """Change the notes of a waiting job."""
    return _line(ServiceClient.find().ask(requests.change_job(job, {"notes": said})), settings)


def edit(job: int, options: QueueingOptions, file: str | None, settings: OutputSettings) -> int:
    """Change the options of a job, or replace it by that of a file; without either, open it in an editor."""
    client = ServiceClient.find()
    changes = options.said()
    if file is not None:
        changes["job"] = _read(Path(file))
    if changes:
        return _changed(client, job, changes, settings)
    if settings.json or not sys.stdin.isatty():
        raise InvalidCommandLine(reason="give the options to change, or --file FILE", command="maya job edit")
    report = client.ask(requests.report(job))
    if report["state"] not in _CHANGEABLE:
        raise WrongState(number=job, state=report["state"], action="changed")
    return _edited_by_hand(client, job, report["version"], settings)


def _edited_by_hand(client: ServiceClient, job: int, version: str, settings: OutputSettings) -> int:
    """Open a job in an editor and send it; if it is refused, keep the text and name its file."""
    folder = Path(tempfile.mkdtemp(prefix="maya-"))
    path, kept = folder / f"job-{job}.yaml", False
    try:
        if not _edited(client.ask(requests.job_body(job)), path):
            return output.answer({"changed": False}, translate("Nothing was changed.", settings.language), settings)
        kept = path.exists()  # an editor may delete its file
        code = _changed(client, job, {"job": _read(path)}, settings, version)
        kept = False
    except MayaError:
        if kept:
            said = marked("Your text is kept. Correct it, then run `maya job edit {job} --file {path}`.")
            output.say(translate(said, settings.language, job=job, path=path))
        raise
    finally:
        if not kept:
            shutil.rmtree(folder, ignore_errors=True)  # an editor may delete the folder too
    return code


def _changed(
    client: ServiceClient, job: int, changes: Mapping[str, Any], settings: OutputSettings, version: str = ""
) -> int:
    with called(_OPTIONS):
        line = client.ask(requests.change_job(job, changes, version=version))
    return _line(line, settings)


def _read(path: Path) -> dict[str, Any]:
    return load_job(path).model_dump(mode="json", exclude_none=True, warnings=False)


def _edited(body: Mapping[str, Any], path: Path) -> bool:
    """Have the job edited in a file ($VISUAL, $EDITOR, vi); return whether it has changed."""
    import yaml

    written = yaml.safe_dump(dict(body), sort_keys=False, allow_unicode=True, default_flow_style=None)
    path.write_text(written, encoding="utf-8")
    editor, words = _editor()
    try:
        subprocess.run([*words, str(path)], check=True)
    except OSError as error:
        raise FileUnwritable(path=path, reason=f"{editor}: {error.strerror}") from error
    except subprocess.CalledProcessError as error:
        raise FileUnwritable(
            path=path, reason=phrase("{editor} ended with {status}", editor=editor, status=error.returncode)
        ) from None
    try:
        return path.read_bytes() != written.encode()  # the editor may save it in another encoding
    except OSError:
        return True  # `load_job` reports why it cannot be read


def _editor() -> tuple[str, list[str]]:
    """Return the command of the editor, and its words; raises `InvalidValue`."""
    name = "VISUAL" if os.environ.get("VISUAL") else "EDITOR"
    editor = os.environ.get(name) or "vi"
    try:
        return editor, shlex.split(editor)
    except ValueError as error:  # a quote is open
        raise InvalidValue(key=name, value=editor, reason=str(error)) from error


def _line(line: Mapping[str, Any], settings: OutputSettings) -> int:
    return output.answer(line, _became(line, settings.language), settings)


def _became(line: Mapping[str, Any], language: str) -> str:
    state = worded(STATES, line["state"], language)
    return translate("Job {id}, {name}: {state}.", language, id=line["id"], name=line["name"], state=state)
