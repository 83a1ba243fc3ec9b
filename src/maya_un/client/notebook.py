"""HTML representations of messages in notebooks: angles in degrees, lengths in mm."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Sequence
from html import escape
from math import degrees
from typing import Any

from maya_un.schema.jobs import JobLine, JobReport, QueueView
from maya_un.schema.previews import JobPreview, Reach
from maya_un.schema.robot import Status
from maya_un.values import Joints, Point, State


def state(state: State) -> str:
    """Return the state of the machine as a table of two columns."""
    rows = [("mode", state.mode.replace("_", " ")), ("homed", _yes(yes=state.homed))]
    rows += [("joints", joints(state.joints))] if state.joints is not None else [("joints", "unknown until homed")]
    rows += [("gripper point", point(state.point))] if state.point is not None else []
    rows.append(("gripper", "closed" if state.gripper_closed else "open"))
    if state.override != 1.0:
        rows.append(("speed", f"{state.override:.0%}"))
    if state.fault is not None:
        rows.append((f"fault {state.fault.code}", state.fault.message))
    return _pairs(rows)


def status(status: Status) -> str:
    """Return the state of the machine and its current work."""
    rows = [("robot", "the twin" if status.address == "sim" else status.address)]
    if status.progress is not None:
        rows.append(("under way", f"{status.progress.phase}, {status.progress.fraction:.0%}"))
    rows += [(f"job {job.id}", f"{job.name}, {job.state}, {job.done} of {job.steps} steps") for job in status.jobs]
    return state(status.state) + _pairs(rows)


def report(report: JobReport) -> str:
    """Return the report of a job as a table of its steps."""
    head = f"Job {report.id}, {report.name}: {report.state}{_code(report.code)}"
    rows = [
        (str(step.index), step.step, f"{step.state}{_code(step.code)}", _time(step.predicted), _time(step.duration))
        for step in report.steps
    ]
    table = _table(("", "step", "result", "predicted [s]", "took [s]"), rows, right=(0, 3, 4))
    return _titled(head, table) + (f"<p>{escape(report.message)}</p>" if report.message else "")


def preview(preview: JobPreview) -> str:
    """Return the preview of a job as a table of its steps, and the reason for a refusal."""
    rows = [(str(step.index), step.step, _time(step.duration), _height(step.lowest)) for step in preview.steps]
    table = _table(("", "step", "takes [s]", "lowest [m]"), rows, right=(0, 2, 3))
    refusal = preview.refusal
    if refusal is None:
        return _titled(f"{preview.duration:.1f} s", table)
    words = f"Step {refusal.index}, {refusal.step}: {refusal.notice.message}{_code(refusal.notice.code)}"
    return _titled("It would be refused", table) + f"<p>{escape(words)}</p>"


def queue(queue: QueueView) -> str:
    """Return the queue: the running job, then the waiting jobs."""
    head = f"The queue is {queue.mode}" + (f" ({queue.reason}, by {queue.by})" if queue.reason else "")
    under_way = () if queue.running is None else (queue.running,)
    return _titled(head, lines((*under_way, *queue.waiting)))


def lines(lines: Iterable[JobLine]) -> str:
    """Return a table with one job per line."""
    rows = [
        (str(job.id), job.name, f"{job.state}{_code(job.code)}", job.owner, f"{job.done}/{job.steps}", _time(job.eta))
        for job in lines
    ]
    return _table(("", "job", "state", "owner", "steps", "ends in [s]"), rows, right=(0, 4, 5))


def reach(reach: Reach) -> str:
    """Return whether a point is reachable, and its margin to every limit."""
    if reach.joints is None:
        nearest = "nothing" if reach.nearest is None else point(reach.nearest)
        return _pairs([("reachable", "no"), ("because", reach.reason or ""), ("nearest", nearest)])
    margins = [(f"{one.limit} {one.zone}".strip(), _margin(one.margin, one.unit)) for one in reach.margins]
    return _pairs([("reachable", "yes"), ("joints", joints(reach.joints)), *margins])


def joints(joints: Joints) -> str:
    """Return joints as text in degrees and mm."""
    return f"a {degrees(joints.a):.2f}°, b {joints.b * 1e3:.1f} mm, c {joints.c * 1e3:.1f} mm"


def point(point: Point) -> str:
    """Return a point as text in mm."""
    return ", ".join(f"{name} {value * 1e3:.1f} mm" for name, value in zip("xyz", point, strict=True))


def _margin(value: float, unit: str) -> str:
    match unit:
        case "rad":
            return f"{degrees(value):.1f}°"
        case "load":
            return f"{value:.2f} × load"
        case _:
            return f"{value * 1e3:.0f} mm"


def _yes(*, yes: bool) -> str:
    return "yes" if yes else "no"


def _code(code: int) -> str:
    return f" ({code})" if code else ""


def _time(seconds: float | None) -> str:
    return "–" if seconds is None else f"{seconds:.1f}"


def _height(metres: float | None) -> str:
    return "–" if metres is None else f"{metres:.3f}"


def _titled(title: str, table: str) -> str:
    return f"<b>{escape(title)}</b>{table}"


def _pairs(rows: Iterable[tuple[str, str]]) -> str:
    cells = (f"<tr><th style='text-align:left'>{escape(a)}</th><td>{escape(b)}</td></tr>" for a, b in rows)
    return f"<table>{''.join(cells)}</table>"


def _table(head: Sequence[str], rows: Iterable[Sequence[str]], right: Sequence[int] = ()) -> str:
    top = "".join(f"<th>{escape(name)}</th>" for name in head)
    body = "".join(f"<tr>{_cells(row, right)}</tr>" for row in rows)
    return f"<table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"


def _cells(row: Sequence[str], right: Sequence[int]) -> str:
    return "".join(
        f"<td style='text-align:{'right' if column in right else 'left'}'>{escape(text)}</td>"
        for column, text in enumerate(row)
    )


LOOKS: dict[type, Callable[[Any], str]] = {
    State: state,
    Status: status,
    JobReport: report,
    JobPreview: preview,
    QueueView: queue,
    Reach: reach,
}
"""The function that returns the HTML of each type of message."""


def register() -> None:
    """Register the HTML tables in the IPython shell that this runs in, if any."""
    shells = sys.modules.get("IPython")
    shell = None if shells is None else shells.get_ipython()
    if shell is None:
        return
    html = shell.display_formatter.formatters["text/html"]
    for kind, look in LOOKS.items():
        html.for_type(kind, look)
