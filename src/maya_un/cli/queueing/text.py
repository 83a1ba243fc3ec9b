"""The queue, jobs and the history as text, with readable dates and durations."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime, timedelta
from typing import Any

from dmc41x3.i18n import marked, translate, translate_phrase
from maya_un.cli import report
from maya_un.cli.units import MILLIMETRES, OutputUnits
from maya_un.cli.waiting import answers, because
from maya_un.errors import translated
from maya_un.vocabulary import PHASES, STATES, worded


def clock_text(date: str) -> str:
    """Return a date (ISO 8601) as local time, with the day if it is not today; "" for none."""
    return _shown(datetime.fromisoformat(date)) if date else ""


def clock_in(seconds: float) -> str:
    """Return the local time in `seconds`."""
    return _shown(datetime.now(UTC) + timedelta(seconds=seconds))


def _shown(when: datetime) -> str:
    here = when.astimezone()
    today = datetime.now(UTC).astimezone().date()
    return here.strftime("%H:%M:%S" if here.date() == today else "%Y-%m-%d %H:%M")


def duration(seconds: float | None) -> str:
    """Return a duration like 45 s, 2:05 min, 1:02:05 h; a dash if it is unknown."""
    if seconds is None:
        return "–"
    whole = round(seconds)
    if whole < 60:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(whole, 60)
    if whole < 3600:
        return f"{minutes}:{rest:02d} min"
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d} h"


Line = Mapping[str, Any]
"""A JobLine as JSON data."""

_COLOURS = {
    "running": "green", "paused": "yellow", "held": "yellow", "interrupted": "red", "failed": "red",
    "cancelled": "magenta", "done": "cyan"
}  # fmt: skip


def queue(
    view: Mapping[str, Any],
    status: Mapping[str, Any],
    lease: Mapping[str, Any],
    language: str,
    units: OutputUnits = MILLIMETRES,
) -> str:
    """Return the queue as text, from QueueView, Status and LeaseView.

    It contains the mode, the driver, the running and waiting jobs, and the choices after a restart.
    """
    under_way = [] if view["running"] is None else [view["running"]]
    jobs = [*under_way, *view["waiting"]]
    blocks = [mode(view, language)]
    if lease["holder"] and not lease["implicit"]:
        blocks.append(
            translate(
                "You drive: jobs of others wait." if lease["yours"] else "{holder} drives: jobs of others wait.",
                language,
                **lease,
            )
        )
    if view["recovery"] is not None:
        blocks.append(recovery(view["recovery"], language, units))
    asked = view.get("question")
    if asked is not None and asked["open"]:
        blocks.append(question(asked, language))
    if jobs:
        blocks.append(lines(jobs, float(status["speed"]), language))
    blocks.append("\n".join(_closing(view, status, len(jobs), language)))
    return "\n\n".join(block for block in blocks if block)


def _closing(view: Mapping[str, Any], status: Mapping[str, Any], shown: int, language: str) -> Iterable[str]:
    progress = status["progress"]
    if progress is not None and progress["duration"] > 0.0:
        percent = 100.0 * min(1.0, progress["elapsed"] / progress["duration"])
        phase = worded(PHASES, progress["phase"], language)
        yield translate("under way: {phase}, {percent:.0f} %", language, phase=phase, percent=percent)
    more = sum(view["counts"].values()) - shown
    if more > 0:
        yield translate("{count} more are waiting.", language, count=more)
    if shown == 0 and more <= 0:
        yield translate("No job is waiting.", language)
    for job in view["waiting"]:
        if job.get("obstacle"):
            yield obstacle(job, language)
    if view["finish_at"]:
        held = view["counts"].get("held", 0) > 0
        clock = clock_text(view["finish_at"])
        if view.get("estimated"):
            clock = translate("about {clock} (with an estimated homing)", language, clock=clock)
        yield translate(
            "Estimated end of all jobs that are not held: {clock}." if held else "Estimated end of all jobs: {clock}.",
            language,
            clock=clock,
        )


def obstacle(job: Line, language: str) -> str:
    """Return why a waiting job would fail as things are."""
    error = job["obstacle"]
    message = translated(error["code"], error["message"], language)
    text = marked("As things are, job {id} would fail with error {code}: {message}")
    return translate(text, language, id=job["id"], code=error["code"], message=message)


_MODES = {
    "running": marked("The queue is running."),
    "pausing": marked("The queue pauses after the current step ({reason})."),
    "held": marked("The queue is paused, and the motion is held on its path ({reason})."),
    "paused": marked("The queue has been paused since {since} ({reason}). `maya queue resume` continues it."),
    "asks": marked("The queue has been paused since {since} ({reason})."),
}


def mode(view: Mapping[str, Any], language: str) -> str:
    """Return whether the queue runs; if not, the reason and the start of the pause.

    While an interrupted job waits for a decision, `resume` would be refused, so it is not mentioned.
    """
    why = because(view, language)
    asks = view["mode"] == "paused" and view["recovery"] is not None
    held = view["mode"] == "pausing" and view["running"] is not None and view["running"]["state"] == "paused"
    text = _MODES["asks" if asks else "held" if held else view["mode"]]
    return translate(text, language, reason=why, since=clock_text(view["since"]))


def lines(jobs: Sequence[Line], speed: float, language: str) -> str:
    """Return jobs of the queue, one per line; `speed` is that of the twin's clock."""
    head = tuple(
        translate(text, language)
        for text in (
            marked("job"),
            marked("name"),
            marked("state"),
            marked("steps"),
            marked("ends in"),
            marked("at"),
            marked("prio"),
            marked("owner"),
            marked("notes"),
        )
    )
    return _table(head, [_queued(job, speed, language) for job in jobs], jobs, right=(0, 3, 4, 6))


def _queued(job: Line, speed: float, language: str) -> tuple[str, ...]:
    left = None if job["eta"] is None else job["eta"] / speed
    return (
        str(job["id"]),
        job["name"],
        state(job, language),
        _progress(job, language),
        duration(left),
        "" if left is None else clock_in(left),
        str(job["priority"] or ""),
        job["owner"],
        _notes(job, language),
    )


def _progress(job: Line, language: str) -> str:
    """Return how many of its steps a job has done; those that a job leaves out until its end are skipped."""
    left = job["steps"] - job["done"]
    if job["state"] != "done" or left <= 0:
        return f"{job['done']}/{job['steps']}"
    return translate("{steps}/{steps}, {skipped} skipped", language, steps=job["steps"], skipped=left)


def past(jobs: Sequence[Line], language: str) -> str:
    """Return jobs of the history, one per line, with predicted and actual durations [the robot's time].

    The prediction of a homing is 0, because its duration is unknown; it is shown as unknown.
    """
    head = tuple(
        translate(text, language)
        for text in (
            marked("job"),
            marked("name"),
            marked("state"),
            marked("steps"),
            marked("predicted"),
            marked("took"),
            marked("submitted"),
            marked("owner"),
            marked("from"),
            marked("notes"),
        )
    )
    rows = [
        (
            str(job["id"]),
            job["name"],
            state(job, language),
            _progress(job, language),
            duration(job["predicted"] or None),
            duration(job["duration"]),
            clock_text(job["submitted"]),
            job["owner"],
            job["source"],
            _notes(job, language),
        )
        for job in jobs
    ]
    return _table(head, rows, jobs, right=(0, 3, 4, 5))


def ended(jobs: Sequence[Line], language: str) -> str:
    """Return ended jobs, one per line, and the errors of those that failed; "" without jobs."""
    if not jobs:
        return ""
    words = (marked("job"), marked("name"), marked("state"), marked("steps"), marked("took"), marked("ended"))
    rows = [
        (
            str(job["id"]),
            job["name"],
            state(job, language),
            _progress(job, language),
            duration(job["duration"]),
            clock_text(job["ended"]),
        )
        for job in jobs
    ]
    shown = _table([translate(word, language) for word in words], rows, jobs, right=(0, 3, 4))
    failures = [
        translate("Job {id} failed: {message}", language, id=job["id"], message=why)
        for job in jobs
        if job["state"] == "failed" and (why := translate_phrase(job["message"], language))
    ]
    return "\n".join((translate("Ended last:", language), shown, *failures))


def state(job: Line, language: str) -> str:
    """Return the state of a job, with its code if it has one."""
    text = worded(STATES, job["state"], language)
    if job["proposal"] and job["state"] == "held":
        text = translate("{state}, proposal", language, state=text)
    return f"{text} ({job['code']})" if job["code"] else text


def _notes(job: Line, language: str) -> str:
    waits = ", ".join(str(number) for number in job["depends_on"])
    parts = [job["notes"], translate("after {jobs}", language, jobs=waits) if waits else ""]
    return " ".join(part for part in parts if part)


_HOLDING = {
    None: marked("The gripper is closed. Only a person can see whether it holds a part."),
    False: marked("The gripper is open."),
    True: marked("The gripper holds a part."),
}
_CHOICES = {
    "resume": marked("continue safely: finished work is not repeated"),
    "redo": marked("do the interrupted step again, then the rest"),
    "skip": marked("skip the interrupted step, do the rest"),
    "abort": marked("end the job as cancelled"),
}


def recovery(offer: Mapping[str, Any], language: str, units: OutputUnits = MILLIMETRES) -> str:
    """Return a text about an interrupted job: the interruption, the robot's position, and the choices."""
    phase = worded(PHASES, offer["phase"], language) if offer["phase"] else translate("begun", language)
    about = {**offer, "phase": phase, "since": clock_text(offer["since"])}
    head = translate(
        "Job {job}, {name}, was interrupted in step {index}, {step} ({phase}). This was detected at {since}."
        if offer["index"]
        else "Job {job}, {name}, was interrupted between two steps. This was detected at {since}.",
        language,
        **about,
    )
    holding = translate(_HOLDING[offer["holding"]], language)
    rows = [(f"  {choice['name']}", meaning(choice, language)) for choice in offer["choices"]]
    choices = report.table(("", ""), rows).strip("\n")
    facts = (
        head,
        place(offer["state"], language, units),
        holding,
        translate("Nothing moves until a person chooses: maya queue recover CHOICE", language),
    )
    return "\n".join((*facts, choices))


def question(asked: Mapping[str, Any], language: str) -> str:
    """Return the question of a job, and how to answer it."""
    text = marked("Job {job}, {name}, asks: {question} Answer with {answers}.")
    return translate(text, language, **asked, answers=answers(asked["choices"], language))


def place(state: Mapping[str, Any], language: str, units: OutputUnits = MILLIMETRES) -> str:
    """Return a sentence about the position of the robot."""
    if state["point"] is None:
        return translate("The robot is not homed: run `maya home` first.", language)
    return translate("The robot is at {place}.", language, place=units.point(state["point"]))


def meaning(choice: Mapping[str, Any], language: str) -> str:
    """Return the meaning of a choice, in translated words if available."""
    text = translate(_CHOICES.get(choice["name"], str(choice["meaning"])), language)
    return translate("{meaning} (with --holding yes|no)", language, meaning=text) if choice["needs_answer"] else text


def _table(head: Sequence[str], rows: Sequence[Sequence[str]], jobs: Sequence[Line], right: Sequence[int]) -> str:
    if not sys.stdout.isatty():
        return report.table(head, rows, right)
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, pad_edge=False)
    for column, name in enumerate(head):
        table.add_column(name, justify="right" if column in right else "left", overflow="fold")
    for row, job in zip(rows, jobs, strict=True):
        table.add_row(*(Text(cell) for cell in row), style=_COLOURS.get(job["state"], ""))
    console = Console()
    with console.capture() as captured:
        console.print(table)
    return captured.get().rstrip("\n")
