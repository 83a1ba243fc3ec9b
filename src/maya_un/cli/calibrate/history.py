"""Calibrations applied to the configuration file, and reverted: every step is stored.

The folder `config.calibrations` beside `config.toml` contains one numbered JSON file per step. A step is first written
as `next.json`, then the configuration changes, then the step gets its number. A command that is killed in between
leaves a `next.json`. It counts as a step if the configuration has its values, else it is ignored.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from math import nan
from pathlib import Path
from typing import Any, Literal, cast

from pydantic import BaseModel, ConfigDict, ValidationError

from dmc41x3.files import read_bytes, unwritable
from dmc41x3.i18n import phrase
from maya_un.config import Config
from maya_un.config.files import alone, edited, parse, replace, text_of, written
from maya_un.errors import FileUnreadable, FileUnwritable, NothingToRevert
from maya_un.validation import reason_of

Values = dict[str, float | None]
"""Dotted keys of the configuration file and their values, None for a missing key."""


class HistoryStep(BaseModel):
    """One step: a calibration "applied", or the calibration numbered `reverts` "reverted".

    `date` is ISO 8601 in UTC, `points` the file of measured points and `digest` its SHA-256. The fit used `used` of
    `measured` points, with root mean square errors [m] before and after. `before` and `after` are the values in the
    configuration file.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, strict=True)

    number: int
    action: Literal["applied", "reverted"]
    date: str
    author: str
    points: str
    digest: str
    measured: int
    used: int
    rms_before: float
    rms_after: float
    before: Values
    after: Values
    reverts: int | None = None


def folder(config_file: Path) -> Path:
    """Return the folder with the steps of a configuration file."""
    return config_file.with_name(f"{config_file.stem}.calibrations")


def steps(config_file: Path) -> list[HistoryStep]:
    """Return all steps, oldest first; raises `FileUnreadable` for a damaged one."""
    begun = _begun(config_file)
    found = [_read(path) for path in folder(config_file).glob("[0-9]*.json")]
    if begun is not None and begun.number not in {step.number for step in found} and _is_done(config_file, begun):
        found.append(begun)
    return sorted(found, key=lambda step: step.number)


def apply(config_file: Path, keys: Mapping[str, float], about: HistoryStep) -> HistoryStep:
    """Write `keys` into the configuration file, and store the step, described by `about`; return the step.

    Raises `InvalidConfig` if the result would be invalid, `FileUnreadable` and `FileUnwritable`; nothing is written
    then.
    """
    with alone(config_file):
        _settle(config_file)
        before = _standing(config_file, keys)
        return _change(config_file, _numbered(config_file, about, before, dict(keys)))


def revert(config_file: Path, date: str, author: str) -> HistoryStep:
    """Restore the values of the configuration file before the last calibration; return the step.

    Raises `NothingToRevert` if there is no calibration, or if its values were changed since, and the errors of `apply`.
    """
    with alone(config_file):
        _settle(config_file)
        last = _last(config_file)
        told = last.model_copy(update={"action": "reverted", "date": date, "author": author, "reverts": last.number})
        return _change(config_file, _numbered(config_file, told, last.after, last.before))


def _last(config_file: Path) -> HistoryStep:
    """Return the current calibration; raises `NothingToRevert`."""
    applied = in_force(steps(config_file))
    if not applied:
        raise NothingToRevert(path=config_file, reason="none is in force")
    last = applied[-1]
    now = _standing(config_file, last.after)
    changed = [key for key in last.after if now[key] != last.after[key]]
    if changed:
        reason = phrase(
            "{names} was changed after calibration {number}; correct it by hand",
            names=", ".join(changed),
            number=last.number,
        )
        raise NothingToRevert(path=config_file, reason=reason)
    return last


def _numbered(config_file: Path, about: HistoryStep, before: Values, after: Values) -> HistoryStep:
    numbers = [step.number for step in steps(config_file)]
    return about.model_copy(update={"number": max(numbers, default=0) + 1, "before": before, "after": after})


def _change(config_file: Path, step: HistoryStep) -> HistoryStep:
    text = _edited(text_of(config_file), step.after, config_file)
    checked(text)
    replace(_next(config_file), step.model_dump_json(indent=2) + "\n")
    try:
        replace(config_file, text)
    finally:
        with suppress(FileUnwritable):  # the next command does it
            _settle(config_file)
    return step


def _next(config_file: Path) -> Path:
    return folder(config_file) / "next.json"


def _begun(config_file: Path) -> HistoryStep | None:
    """Return the step without a number, None if there is none; raises `FileUnreadable`."""
    text_of(config_file)  # a path without a file has no steps beside it
    path = _next(config_file)
    return _read(path) if path.exists() else None


def _is_done(config_file: Path, step: HistoryStep) -> bool:
    return _standing(config_file, step.after) == step.after


def _settle(config_file: Path) -> None:
    """Number the unfinished step if the configuration has its values, else delete it; raises `FileUnwritable`."""
    begun = _begun(config_file)
    if begun is None:
        return
    try:
        if _is_done(config_file, begun):
            _next(config_file).replace(folder(config_file) / f"{begun.number:04d}.json")
        else:
            _next(config_file).unlink()
    except OSError as error:
        raise unwritable(_next(config_file), error) from error


def _edited(text: str, values: Values, config_file: Path) -> str:
    try:
        return edited(text, values)
    except ValueError as error:
        raise FileUnreadable(path=config_file, reason=phrase("it is not TOML: {error}", error=error)) from error


def checked(text: str) -> Config:
    """Return the configuration in a text; its workspace is not empty.

    Raises `InvalidConfig`.
    """
    import tomllib

    from maya_un.kinematics.workspace import Workspace

    config = parse(tomllib.loads(text))
    Workspace.of(config)
    return config


def _standing(config_file: Path, keys: Mapping[str, object]) -> Values:
    said = written(config_file)
    return {key: _at(said, key) for key in keys}


def _at(said: Mapping[str, Any], key: str) -> float | None:
    found: Any = said
    for part in key.split("."):
        if not isinstance(found, Mapping) or part not in found:
            return None
        found = cast("Mapping[str, Any]", found)[part]
    return float(found) if isinstance(found, int | float) else nan  # an applied value is always a number


def _read(path: Path) -> HistoryStep:
    try:
        return HistoryStep.model_validate_json(read_bytes(path))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(str(part) for part in first["loc"])
        raise FileUnreadable(
            path=path,
            reason=phrase("it is no step of a calibration: {key}: {message}", key=key, message=reason_of(first)),
        ) from error


def in_force(history: list[HistoryStep]) -> list[HistoryStep]:
    """Return the calibrations that were not reverted, oldest first."""
    back = {step.reverts for step in history}
    return [step for step in history if step.action == "applied" and step.number not in back]


def before(config_file: Path, digest: str) -> Config | None:
    """Return the configuration with which the points of this SHA-256 were measured.

    It is the configuration before the calibration that applied the points; None if no calibration did, or it was
    reverted. Raises `FileUnreadable` and `InvalidConfig`.
    """
    applied = in_force(steps(config_file))
    first = next((place for place, step in enumerate(applied) if step.digest == digest), None)
    if first is None:
        return None
    text = text_of(config_file)
    for step in reversed(applied[first:]):
        text = _edited(text, step.before, config_file)
    return checked(text)
