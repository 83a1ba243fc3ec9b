"""`maya calibrate FILE`: fit, show, and on request write into the configuration or revert."""

from __future__ import annotations

import getpass
from collections.abc import Sequence
from datetime import UTC, datetime
from math import degrees
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dmc41x3.i18n import marked, translate, translate_phrase
from maya_un.cli import output
from maya_un.cli.calibrate import history
from maya_un.cli.configure import configuration
from maya_un.cli.report import table
from maya_un.cli.settings import OutputSettings
from maya_un.config import Config, default_path
from maya_un.kinematics.calibration import FITTED, WORDS, Calibration, FittedConstants, calibrate, named
from maya_un.schema.encoding import to_data
from maya_un.service.calibration import points
from maya_un.service.calibration.fit import message_of


class FitOptions(NamedTuple):
    """The options of a fit: constants to `hold`, whether to `apply`, a file for a picture, the author."""

    hold: Sequence[str] = ()
    apply: bool = False
    plot: str | None = None
    author: str | None = None


def fit(file: str, options: FitOptions, settings: OutputSettings) -> int:
    """Fit the constants to the points of a file and show them; return the exit code.

    With `apply` they are written into the configuration file. Raises `FileUnreadable`, `InvalidValue`,
    `UnknownName` and `NotIdentifiable`; with `apply` also `InvalidConfig` and `FileUnwritable`.
    """
    config, place = configuration(settings), config_file(settings)
    measured = _measured(Path(file), config, place)
    hold = [named(name) for name in options.hold]
    found = calibrate(measured.observations, FittedConstants.of(config), hold)
    message = message_of(found, config)
    picture = None if options.plot is None else _drawn(found, options.plot)
    step = None
    if options.apply and message.keys:
        step = history.apply(place, message.keys, _told(found, file, measured.digest, options.author))
    value = to_data(message) | {"config": str(place), "applied": None if step is None else step.number}
    text = as_text(found, settings.language)
    tail = [_outcome(step, place, settings.language, apply=options.apply)]
    if picture is not None:
        tail.append(translate("Written: {path}", settings.language, path=picture))
    return output.answer(value | {"plot": picture}, "\n\n".join([text, "\n".join(tail)]), settings)


def config_file(settings: OutputSettings) -> Path:
    """Return the path of the current configuration file, even if it does not exist."""
    return default_path() if settings.config is None else Path(settings.config)


def revert(author: str | None, settings: OutputSettings) -> int:
    """Revert the last calibration; raises `NothingToRevert`, `InvalidConfig`, `FileUnwritable`."""
    place = config_file(settings)
    step = history.revert(place, _now(), author or _user())
    text = translate(
        "Calibration {reverts} is reverted in {path}. Restart `maya up` and home.",
        settings.language,
        reverts=step.reverts,
        path=place,
    )
    return output.answer({"config": str(place), **step.model_dump()}, text, settings)


def show_history(settings: OutputSettings) -> int:
    """Print every step, oldest first; raises `FileUnreadable`."""
    place = config_file(settings)
    steps = history.steps(place)
    last = next(reversed(history.in_force(steps)), None)
    value = {"config": str(place), "steps": [step.model_dump() | {"in_force": step is last} for step in steps]}
    if not steps:
        return output.answer(
            value, translate("No calibration was ever applied to {path}.", settings.language, path=place), settings
        )
    head = [
        "",
        *(
            translate(text, settings.language)
            for text in (
                marked("date"),
                marked("step"),
                marked("by"),
                marked("points"),
                marked("rms before [mm]"),
                marked("after [mm]"),
            )
        ),
    ]
    rows = [_history_row(step, step is last, settings.language) for step in steps]
    return output.answer(value, table(head, rows, right=(0, 5, 6)), settings)


_STEPS = {"applied": marked("applied"), "reverted": marked("reverted {reverts}")}


def _history_row(step: history.HistoryStep, current: bool, language: str) -> list[str]:
    text = marked("applied, in force") if current else _STEPS[step.action]
    return [
        str(step.number),
        step.date,
        translate(text, language, reverts=step.reverts),
        step.author,
        step.points,
        f"{step.rms_before * 1e3:.2f}",
        f"{step.rms_after * 1e3:.2f}",
    ]


def _measured(path: Path, config: Config, place: Path) -> points.PointFile:
    """Return the points of a file with the counts of `config`.

    Points of an applied calibration were counted with the configuration before it; if the file does not state the
    counts of the switches, they are taken from the history.
    """
    measured = points.read(path, config)
    before = None if measured.datum is not None else history.before(place, measured.digest)
    if before is None:
        return measured
    return points.read(path, before).moved(points.between(points.datum_of(before), points.datum_of(config)))


def _told(found: Calibration, file: str, digest: str, author: str | None) -> history.HistoryStep:
    return history.HistoryStep(
        number=0,
        action="applied",
        date=_now(),
        author=author or _user(),
        points=file,
        digest=digest,
        measured=len(found.observations),
        used=int(np.count_nonzero(found.inliers)),
        rms_before=found.rms_before,
        rms_after=found.rms_after,
        before={},
        after={},
    )


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")


def _user() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError):  # the list of users does not contain this number
        return "unknown"


def _drawn(found: Calibration, file: str) -> str:
    from maya_un.plots import style
    from maya_un.plots.calibration import residuals_figure

    style.save(residuals_figure(found), Path(file))
    return file


def _outcome(step: history.HistoryStep | None, place: Path, language: str, *, apply: bool) -> str:
    if step is not None:
        return translate(
            "Calibration {number} is in {path}. Restart `maya up` and run `maya home`; new zeros apply from then on.",
            language,
            number=step.number,
            path=place,
        )
    return translate(
        "The configuration has these values already; nothing was written."
        if apply
        else "Nothing was changed; --apply writes these values into {path}.",
        language,
        path=place,
    )


class _Unit(NamedTuple):
    """The unit in which a constant is shown: its name, factor, and number of decimals."""

    name: str
    factor: float
    digits: int

    def shown(self, value: float) -> str:
        """Return a value in this unit, without its name."""
        return f"{value * self.factor:.{self.digits}f}"


_MM = _Unit("mm", 1e3, 2)
_UNITS = dict.fromkeys(FITTED, _MM) | {
    "pulses_per_metre": _Unit("counts/m", 1.0, 1),
    "pulses_per_degree": _Unit("counts/°", 1.0, 4),
    "zero_a": _Unit("°", degrees(1.0), 4),
}


def as_text(found: Calibration, language: str) -> str:
    """Return a result as text: a table in mm and degrees with ± two standard errors, and remarks."""
    head = (
        translate("constant", language),
        "",
        *(translate(text, language) for text in (marked("now"), marked("fitted"))),
        "± 2σ",
    )
    rows = [_row(found, name, language) for name in FITTED]
    lines = [
        _about_points(found, language),
        *_about_outliers(found, language),
        *(translate_phrase(note, language) for note in found.words),
    ]
    return "\n\n".join([table(head, rows, right=(2, 3, 4)), "\n".join(lines)])


def _row(found: Calibration, name: str, language: str) -> list[str]:
    unit = _UNITS[name]
    error = found.errors.get(name)
    about = translate("fixed", language, "constant") if error is None else unit.shown(2.0 * error)
    now, fitted = getattr(found.now, name), getattr(found.fitted, name)
    return [translate_phrase(WORDS[name], language), unit.name, unit.shown(now), unit.shown(fitted), about]


def _about_points(found: Calibration, language: str) -> str:
    used, measured = int(np.count_nonzero(found.inliers)), len(found.observations)
    before, after = found.rms_before * 1e3, found.rms_after * 1e3
    return translate(
        "The fit used {used} of {measured} points. The error (rms) is {before:.2f} mm now and {after:.2f} mm "
        "after the fit.",
        language,
        used=used,
        measured=measured,
        before=before,
        after=after,
    )


def _about_outliers(found: Calibration, language: str) -> list[str]:
    off = np.linalg.norm(found.residuals_after, axis=1) * 1e3
    named_rows = zip(found.observations.rows, off, found.inliers, strict=True)
    rows = [
        translate("{row} ({off:.1f} mm)", language, row=row, off=far) for row, far, inlier in named_rows if not inlier
    ]
    return (
        [translate("The fit ignored these rows as outliers: {rows}.", language, rows=", ".join(rows))] if rows else []
    )
