"""The queue, jobs and the history as text, with dates and durations as people read them."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime, timedelta
from typing import Any

from maya_un.cli import report
from maya_un.cli.queueing.words import known, word
from maya_un.cli.waiting import because

_DAY = 86_400.0


def clock_text(date: str) -> str:
    """Return a date (ISO 8601) as the clock here shows it, with the day where that is another; "" for none."""
    return _shown(datetime.fromisoformat(date)) if date else ""


def clock_in(seconds: float) -> str:
    """Return what the clock here will show in so many seconds."""
    return _shown(datetime.now(UTC) + timedelta(seconds=seconds))


def _shown(when: datetime) -> str:
    here = when.astimezone()
    today = datetime.now(UTC).astimezone().date()
    return here.strftime("%H:%M:%S" if here.date() == today else "%Y-%m-%d %H:%M")


def duration(seconds: float | None) -> str:
    """Return a duration like 45 s, 2:05 min, 1:02:05 h; a dash where nobody knows it."""
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
"""A JobLine as JSON has it."""

_COLOURS = {
    "running": "green", "paused": "yellow", "held": "yellow", "interrupted": "red", "failed": "red",
    "cancelled": "magenta", "done": "cyan"
}  # fmt: skip


def queue(view: Mapping[str, Any], status: Mapping[str, Any], lease: Mapping[str, Any], language: str) -> str:
    """Return the queue as QueueView, Status and LeaseView tell of it.

    Its mode, who drives, what is under way, what waits, what is offered.
    """
    under_way = [] if view["running"] is None else [view["running"]]
    jobs = [*under_way, *view["waiting"]]
    blocks = [mode(view, language)]
    if lease["holder"] and not lease["implicit"]:
        blocks.append(word("you_drive" if lease["yours"] else "driver", language, **lease))
    if view["recovery"] is not None:
        blocks.append(recovery(view["recovery"], language))
    if jobs:
        blocks.append(lines(jobs, float(status["speed"]), language))
    blocks.append("\n".join(_closing(view, status, len(jobs), language)))
    return "\n\n".join(block for block in blocks if block)


def _closing(view: Mapping[str, Any], status: Mapping[str, Any], shown: int, language: str) -> Iterable[str]:
    progress = status["progress"]
    if progress is not None and progress["duration"] > 0.0:
        percent = 100.0 * min(1.0, progress["elapsed"] / progress["duration"])
        yield word("under_way", language, phase=progress["phase"], percent=percent)
    more = sum(view["counts"].values()) - shown
    if more > 0:
        yield word("more_wait", language, count=more)
    if shown == 0 and more <= 0:
        yield word("nothing_waits", language)
    if view["finish_at"]:
        held = view["counts"].get("held", 0) > 0
        clock = clock_text(view["finish_at"])
        if view.get("estimated"):
            clock = word("estimated", language, clock=clock)
        yield word("finish_at_released" if held else "finish_at", language, clock=clock)


def mode(view: Mapping[str, Any], language: str) -> str:
    """Return whether the queue runs, and if not why and since when.

    `resume` would be refused while a person has to say what becomes of an interrupted job, so it is not named then.
    """
    why = because(view, language)
    asks = view["mode"] == "paused" and view["recovery"] is not None
    return word(
        "queue_asks" if asks else f"queue_{view['mode']}", language, reason=why, since=clock_text(view["since"])
    )


def lines(jobs: Sequence[Line], speed: float, language: str) -> str:
    """Return jobs of the queue, one a line; `speed` is that of the twin's clock."""
    head = tuple(
        word(key, language)
        for key in ("number", "name", "state", "steps", "ends_in", "at", "priority", "owner", "notes")
    )
    return _table(head, [_queued(job, speed, language) for job in jobs], jobs, right=(0, 3, 4, 6))


def _queued(job: Line, speed: float, language: str) -> tuple[str, ...]:
    left = None if job["eta"] is None else job["eta"] / speed
    return (
        str(job["id"]),
        job["name"],
        state(job, language),
        f"{job['done']}/{job['steps']}",
        duration(left),
        "" if left is None else clock_in(left),
        str(job["priority"] or ""),
        job["owner"],
        _notes(job, language),
    )


def past(jobs: Sequence[Line], language: str) -> str:
    """Return jobs of the history, one a line, with what they were to take and took [the robot's time].

    A homing is predicted as nothing, for no plan tells how long it takes; that is shown as not known.
    """
    head = tuple(
        word(key, language)
        for key in ("number", "name", "state", "steps", "predicted", "took", "submitted", "owner", "source", "notes")
    )
    rows = [
        (
            str(job["id"]),
            job["name"],
            state(job, language),
            f"{job['done']}/{job['steps']}",
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


def state(job: Line, language: str) -> str:
    """Return the state of a job, with its code where it has one."""
    text = word(f"state_{job['state']}", language)
    if job["proposal"] and job["state"] == "held":
        text = word("proposal", language, state=text)
    return f"{text} ({job['code']})" if job["code"] else text


def _notes(job: Line, language: str) -> str:
    waits = ", ".join(str(number) for number in job["depends_on"])
    parts = [job["notes"], word("after_jobs", language, jobs=waits) if waits else ""]
    return " ".join(part for part in parts if part)


def recovery(offer: Mapping[str, Any], language: str) -> str:
    """Return what was interrupted, where the machine is, and what may be chosen."""
    about = {**offer, "phase": offer["phase"] or word("begun", language), "since": clock_text(offer["since"])}
    head = word("interrupted" if offer["index"] else "interrupted_between", language, **about)
    holding = {None: "gripper_unknown", False: "gripper_open", True: "gripper_holds"}[offer["holding"]]
    rows = [(f"  {choice['name']}", meaning(choice, language)) for choice in offer["choices"]]
    choices = report.table(("", ""), rows).strip("\n")
    facts = (head, place(offer["state"], language), word(holding, language), word("choose", language))
    return "\n".join((*facts, choices))


def place(state: Mapping[str, Any], language: str) -> str:
    """Return where the robot is."""
    if state["point"] is None:
        return word("robot_unknown", language)
    x, y, z = state["point"]
    return word("robot_at", language, place=f"x {x:.3f}  y {y:.3f}  z {z:.3f} m")


def meaning(choice: Mapping[str, Any], language: str) -> str:
    """Return what a choice means, in our words where there are any."""
    key = f"choice_{choice['name']}"
    text = word(key, language) if known(key) else str(choice["meaning"])
    return word("with_holding", language, meaning=text) if choice["needs_answer"] else text


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
