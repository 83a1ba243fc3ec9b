"""The figure of docs that shows a calibration; `draw_docs.py` writes it."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from maya_un.config import Config, Units
from maya_un.kinematics import Workspace
from maya_un.kinematics.calibration import Calibration, FittedConstants, Observations, calibrate, model
from maya_un.plots.calibration import residuals_figure
from maya_un.values import Joints

POINTS, NOISE, SEED = 24, 3e-4, 4133
MISREAD, BY = 17, 0.05
"""One point is written down 50 mm too high, as happens with a ruler."""


def example() -> Calibration:
    """Return the calibration of a machine that is millimetres off its configuration, measured to 0.3 mm."""
    config = Config()
    told = FittedConstants.of(config)
    true = told._replace(
        height=told.height + 0.004, length=told.length - 0.006, delta=told.delta + 0.003, zero_b=0.005, zero_c=-0.003
    )
    rng = np.random.default_rng(SEED)
    counts = _poses(config, rng) * np.array(Units.of(config).per_unit)
    points = model.points(true, counts) + rng.normal(0.0, NOISE, (POINTS, 3))
    points[MISREAD, 2] += BY
    return calibrate(Observations(counts, points), told)


def _poses(config: Config, rng: np.random.Generator) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    workspace = Workspace.of(config)
    found: list[Joints] = []
    while len(found) < POINTS:
        pose = Joints(*(float(rng.uniform(*stroke)) for stroke in (workspace.boom, workspace.line_b, workspace.line_c)))
        if workspace.contains(pose):
            found.append(pose)
    return np.array(found)


def residuals() -> Figure:
    return residuals_figure(example())
