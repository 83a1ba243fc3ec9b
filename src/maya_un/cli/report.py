"""The report of a job: as data with stable keys, and as a table."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from math import dist
from typing import Any

from dmc41x3.i18n import marked, translate, translate_phrase
from maya_un.cli.units import MILLIMETRES, OutputUnits
from maya_un.vocabulary import STATES, worded

STEP_KEYS = (
    "index", "step", "state", "code", "message", "predicted", "duration", "end_counts", "end_point", "phase"
)  # fmt: skip
_CHOOSING = frozenset({"ask", "if"})
"""The steps whose phase is a choice: an answer, or a branch."""

_JOB_KEYS = ("state", "code", "message", "predicted", "duration", "lowest", "highest", "remarks")


def as_data(report: Mapping[str, Any], places: Mapping[str, Sequence[float]] | None) -> dict[str, Any]:
    """Return the report of a job with the final places of the parts.

    `report` is a JobReport as JSON data; `places` contains the actual positions of the parts on the twin's table [m],
    None on a real machine. `error` is the distance between `place` and `commanded` [m].
    """
    data: dict[str, Any] = {"job": report["name"], **{key: report[key] for key in _JOB_KEYS}}
    data["steps"] = [{key: step[key] for key in STEP_KEYS} for step in report["steps"]]
    data["parts"] = {
        name: _part(commanded, None if places is None else places.get(name))
        for name, commanded in report["parts"].items()
    }
    return data


def _part(commanded: Sequence[float] | None, place: Sequence[float] | None) -> dict[str, Any]:
    error = None if commanded is None or place is None else dist(commanded, place)
    return {"place": None if place is None else list(place), "commanded": commanded, "error": error}


def as_text(data: Mapping[str, Any], language: str, units: OutputUnits = MILLIMETRES) -> str:
    """Return the report as text: a headline, the steps, the parts, and deviations of the pallets."""
    blocks = [_headline(data, language, units), _steps(data["steps"], language)]
    if data["parts"]:
        blocks.append(_parts(data["parts"], language, units))
    notes = [*(translate_phrase(remark, language) for remark in data["remarks"]), *_unknown(data, language)]
    if notes:
        shape = translate("note", language)
        blocks.append("\n".join(f"{shape}: {note}" for note in notes))
    return "\n\n".join(blocks)


def _unknown(data: Mapping[str, Any], language: str) -> Iterator[str]:
    """Yield why deviations are unknown on the twin after a job with branches."""
    branches = any(step["step"].partition(" ")[0] == "if" for step in data["steps"])
    for name, part in data["parts"].items():
        if branches and data["state"] == "done" and part["place"] is not None and part["commanded"] is None:
            text = marked("the deviation of {part} is unknown: a branch decides whether and where the job puts it down")
            yield translate(text, language, part=name)


def _headline(data: Mapping[str, Any], language: str, units: OutputUnits) -> str:
    line = translate(
        "{name}: {state} in {duration:.1f} s",
        language,
        name=data["job"],
        state=worded(STATES, data["state"], language),
        duration=data["duration"] or 0.0,
    )
    if data["lowest"] is None:
        return line
    ends = {key: units.length(data[key]) for key in ("lowest", "highest")}
    return f"{line}; {translate('gripper between {lowest} and {highest}', language, **ends)}"


def _steps(steps: Iterable[Mapping[str, Any]], language: str) -> str:
    head = (
        "",
        *(
            translate(text, language)
            for text in (marked("step"), marked("result"), marked("predicted [s]"), marked("took [s]"))
        ),
    )
    return table(head, [_step_row(step, language) for step in steps], right=(0, 3, 4))


def _step_row(step: Mapping[str, Any], language: str) -> tuple[str, ...]:
    state = worded(STATES, step["state"], language)
    result = f"{state} ({step['code']})" if step["code"] else state
    if step["state"] == "done" and step["step"].partition(" ")[0] in _CHOOSING:
        result = f"{result}: {step['phase']}"
    return (str(step["index"]), step["step"], result, _seconds(step["predicted"]), _seconds(step["duration"]))


def _seconds(value: float | None) -> str:
    return "–" if value is None else f"{value:.1f}"


def _parts(parts: Mapping[str, Mapping[str, Any]], language: str, units: OutputUnits) -> str:
    head = tuple(
        translate(text, language, unit=units.of_length)
        for text in (marked("part"), marked("place [{unit}]"), marked("off by [{unit}]"))
    )
    rows = [
        (name, units.place(part["place"]), "–" if part["error"] is None else units.bare_length(part["error"], finer=2))
        for name, part in parts.items()
    ]
    return table(head, rows, right=(2,))


def table(head: Sequence[str], rows: Sequence[Sequence[str]], right: Sequence[int] = ()) -> str:
    """Return rows of text under a header, in columns; columns with a number in `right` are right-aligned."""
    widths = [max(len(row[column]) for row in (head, *rows)) for column in range(len(head))]
    return "\n".join(_row(row, widths, right) for row in (head, *rows))


def _row(row: Sequence[str], widths: Sequence[int], right: Sequence[int]) -> str:
    cells = (
        text.rjust(width) if column in right else text.ljust(width)
        for column, (text, width) in enumerate(zip(row, widths, strict=True))
    )
    return "   ".join(cells).rstrip()
