"""The fit of the constants to the points of a file, and its result as a message."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from pathlib import Path

import numpy as np

from maya_un.config import Config
from maya_un.config.files import edited
from maya_un.kinematics import Floats
from maya_un.kinematics.calibration import FITTED, Calibration, FittedConstants, calibrate
from maya_un.schema.calibration import CalibrationFit, FittedConstant, LineDifferenceView, PointResidual
from maya_un.service.calibration.points import parsed
from maya_un.values import Point


def fit_points(data: bytes, path: Path, config: Config, hold: Sequence[str]) -> Generator[None, None, CalibrationFit]:
    """Return the fit to the points in the content `data` of the file at `path`, for a worker; `hold` is kept.

    Raises `InvalidValue`, `FileUnreadable` and `NotIdentifiable`.
    """
    yield
    seen = parsed(data, path, config).observations
    return message_of(calibrate(seen, FittedConstants.of(config), hold), config)


def message_of(found: Calibration, config: Config) -> CalibrationFit:
    """Return the result of a fit that began at a configuration as a message."""
    errors, difference, keys = found.errors, found.line_difference, found.fitted.keys(config)
    constants = (
        FittedConstant(
            name, getattr(found.now, name), getattr(found.fitted, name), errors.get(name), name in found.held
        )
        for name in FITTED
    )
    return CalibrationFit(
        constants=tuple(constants),
        correlations=tuple(tuple(row) for row in found.correlations.tolist()),
        noise=found.noise,
        rms_before=found.rms_before,
        rms_after=found.rms_after,
        measured=len(found.observations),
        used=int(np.count_nonzero(found.inliers)),
        outliers=found.outliers,
        line_difference=None if difference is None else LineDifferenceView(*difference),
        words=found.words,
        residuals=tuple(_residuals(found)),
        keys=keys,
        toml=edited("", keys),
    )


def _residuals(found: Calibration) -> Generator[PointResidual, None, None]:
    rows = zip(
        found.observations.rows,
        _points(found.residuals_before),
        _points(found.residuals_after),
        found.inliers.tolist(),
        strict=True,
    )
    for row, before, after, used in rows:
        yield PointResidual(row, before, after, used)


def _points(values: Floats) -> list[Point]:
    return [Point(*row) for row in values.tolist()]
