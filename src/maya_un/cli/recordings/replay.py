"""`maya replay`: the recorded commands said to a fresh twin, and what is another there than it was."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from dmc41x3.i18n import marked, translate
from dmc41x3.language.hardware import LETTERS
from dmc41x3.loops import run_virtual
from maya_un.cli import output
from maya_un.cli.recordings.recordings import found
from maya_un.cli.recordings.twin import Replayed
from maya_un.cli.recordings.twin import replay as say_again
from maya_un.cli.report import table
from maya_un.cli.settings import OutputSettings
from maya_un.config import Units
from maya_un.config.files import parse
from maya_un.errors import FileUnreadable, InvalidValue
from maya_un.kinematics import Floats
from maya_un.recorder import mcap_file
from maya_un.recorder.compare import Comparison, RecordSample, ReplayDifference, Tolerances, compare, samples
from maya_un.recorder.recording import Recording

HORIZON = 1e9
"""Longest recording that is replayed [s]."""

OF_A_TWIN = Tolerances(counts=2.0, seconds=0.02)
"""How much a twin's own recording may differ from its replay; by as much more as its clock ran faster."""

OF_A_LATER_TWIN = Tolerances(counts=50.0, seconds=0.02)
"""The same where the replay does not begin at the power-up: the guard may act a sample earlier or later (44 counts)."""

OF_A_MACHINE = Tolerances(counts=50.0, seconds=0.1)
"""How much a machine may differ from a twin before that is said: 50 µm of a line, a tenth of a second."""

MOST_SHOWN = 40
"""Rows of differences on a screen; --json has all."""

_LEFT_OUT = marked("Not compared: jobs, steps and the queue, because the controller does not know them.")


class ReplayOptions(NamedTuple):
    """What `maya replay` was asked for; None stands for the tolerance that belongs to the recording."""

    counts: float | None = None
    seconds: float | None = None
    plot: str | None = None


def replay(file: str, options: ReplayOptions, settings: OutputSettings) -> int:
    """Replay a recording and print what differs; return 0 where nothing does, else 1.

    Raises `FileUnreadable`, `NotFound`, `InvalidValue`, and `FileUnwritable` for the picture.
    """
    for key, value in (("--counts", options.counts), ("--seconds", options.seconds)):
        if value is not None and not value >= 0.0:
            raise InvalidValue(key=key, value=value, reason="it is 0 or more")
    if options.plot is not None:
        _require_format(Path(options.plot))
    path = found(file)
    recording = mcap_file.read(path)
    try:
        runs = run_virtual(say_again(recording), HORIZON)
    except ValueError as error:
        raise FileUnreadable(path=path, reason=str(error)) from error
    tolerances = tolerated(recording, options)
    comparison = compare(runs.recorded, runs.replayed, tolerances)
    if options.plot is not None:
        _draw(recording, runs, Path(options.plot))
    data = _as_data(path, recording, comparison, tolerances, runs)
    output.answer(data, _as_text(comparison, runs, options, settings), settings)
    return output.FAILED if comparison.differences else output.DONE


def tolerated(recording: Recording, options: ReplayOptions) -> Tolerances:
    """Return what may differ: as asked, else what belongs to a twin or to a machine."""
    header = recording.header
    of_twin = OF_A_TWIN if header.complete else OF_A_LATER_TWIN
    least = OF_A_MACHINE if header.origin.twin is None else of_twin
    counts, seconds = (max(1.0, header.origin.speed) * most for most in least)
    return Tolerances(
        counts if options.counts is None else options.counts, seconds if options.seconds is None else options.seconds
    )


def _as_data(
    path: Path, recording: Recording, comparison: Comparison, tolerances: Tolerances, runs: Replayed
) -> dict[str, Any]:
    header = recording.header
    return {
        "file": str(path),
        "reason": header.reason,
        "date": header.date,
        "begin": runs.begin,
        "same": not comparison.differences,
        "tolerances": tolerances._asdict(),
        "commands": comparison.commands,
        "compared": comparison.compared,
        "differences": [one._asdict() for one in comparison.differences],
        "motions": [one._asdict() for one in comparison.motions],
        "ends": [one._asdict() for one in comparison.ends],
        "not_compared": [*runs.lacks, _LEFT_OUT],
    }


def _as_text(comparison: Comparison, runs: Replayed, options: ReplayOptions, settings: OutputSettings) -> str:
    language = settings.language
    lines: list[str] = []
    if comparison.differences:
        head = tuple(translate(text, language) for text in (marked("time [s]"), marked("what"), marked("how")))
        shown = comparison.differences[:MOST_SHOWN]
        lines.append(table(head, [_row(one) for one in shown], right=(0,)))
        if len(comparison.differences) > len(shown):
            lines.append(
                translate("and {count} more; --json has all.", language, count=len(comparison.differences) - len(shown))
            )
        lines.append("")
    if comparison.ends:
        head = tuple(
            translate(text, language)
            for text in (marked("axis"), marked("recorded, at its end [counts]"), marked("replayed"))
        )
        lines += [table(head, [(end.axis, f"{end.recorded}", f"{end.replayed}") for end in comparison.ends]), ""]
    took = [one.recorded for one in comparison.motions if one.recorded is not None]
    lines.append(
        translate(
            "{count} motions, {seconds:.1f} s in all.", language, count=len(comparison.motions), seconds=sum(took)
        )
    )
    lines += [translate(text, language) for text in (*runs.lacks, _LEFT_OUT)]
    count = len(comparison.differences)
    lines.append(
        translate(
            "{compared} answers compared; {differences} differences.",
            language,
            compared=comparison.compared,
            differences=count,
        )
    )
    if options.plot is not None:
        lines.append(translate("Picture: {path}", language, path=options.plot))
    return "\n".join(lines)


def _row(one: ReplayDifference) -> tuple[str, str, str]:
    many = f" (× {one.times})" if one.times > 1 else ""
    return f"{one.time:.3f}", f"{one.what}{many}", one.how


def _require_format(path: Path) -> None:
    from maya_un.plots import style

    style.kind_of(path)


def _draw(recording: Recording, runs: Replayed, path: Path) -> None:
    from maya_un.plots import style
    from maya_un.plots.recording import replay_figure

    config = parse(recording.header.origin.config)
    order = [LETTERS.index(config.axes[axis].letter) for axis in range(3)]
    scale = np.array(Units.of(config).per_unit) * np.array([np.pi / 180.0, 1.0, 1.0])
    recorded, replayed = samples(runs.recorded.exchanges), samples(runs.replayed.exchanges)
    commanded = _course(recorded, "reference", order, scale, runs.begin)
    before, after = (_course(records, "position", order, scale, runs.begin) for records in (recorded, replayed))
    common, here, there = np.intersect1d(before[0], after[0], return_indices=True)
    apart = (after[1][there] - before[1][here]) * np.array([1.0, 1e3, 1e3])
    header = recording.header
    style.save(replay_figure(commanded, before, after, (common, apart), f"{header.reason}, {header.date}"), path)


def _course(
    records: list[RecordSample], what: str, order: list[int], scale: Floats, begin: float
) -> tuple[Floats, Floats]:
    """Return times (n,) [s] since `begin`, and what records say of the axes, in °, m, m (n, 3)."""
    times = np.array([time - begin for time, _ in records])
    counts = [[getattr(record.axes[place], what) for place in order] for _, record in records]
    return times, np.array(counts, dtype=float).reshape(len(records), 3) / scale
