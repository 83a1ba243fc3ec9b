"""A machine that differs from its configuration, and points measured on it."""

from __future__ import annotations

from random import Random

import numpy as np

from maya_un.config import Config, Units
from maya_un.kinematics import Floats, Workspace
from maya_un.kinematics.calibration import Calibration, FittedConstants, Observations, model

CONFIG = Config()
NOW = FittedConstants.of(CONFIG)
SIGMA = 1e-3
"""Noise of a measured coordinate [m]."""

TRUTH = NOW._replace(
    height=2.362,
    length=2.290,
    delta=0.306,
    pulses_per_metre=1.003e6,
    pulses_per_degree=370.5,
    zero_a=0.010,
    zero_b=0.006,
    zero_c=-0.004,
)
"""A machine some plausible errors away from its configuration."""


def drawn(rng: np.random.Generator) -> FittedConstants:
    """Return a machine somewhere near its configuration, Φ as configured."""
    spread = (0.01, 0.01, 0.01, 0.0, 5e3, 2.0, 0.01, 0.005, 0.005, 0.0)
    return FittedConstants(*(now + float(rng.uniform(-1.0, 1.0)) * by for now, by in zip(NOW, spread, strict=True)))


def generator(random: Random) -> np.random.Generator:
    """Return numpy's generator for a campaign's."""
    return np.random.default_rng(random.getrandbits(64))


def counts_of(joints: Floats) -> Floats:
    """Return the whole counts of joints as the configuration reads them."""
    return np.round(joints * np.array(Units.of(CONFIG).per_unit))


def random_counts(rng: np.random.Generator, number: int) -> Floats:
    """Return counts of poses all over the workspace, deep enough that the lines meet on every machine drawn here."""
    workspace = Workspace.of(CONFIG)
    low, high = np.array([workspace.boom, workspace.line_b, workspace.line_c]).T
    joints = rng.uniform(low, high, (4 * number + 50, 3))
    deep = workspace.mechanism.fk_many(joints)[:, 2] < workspace.mechanism.reach_down - 0.3
    return counts_of(joints[workspace.contains_many(joints) & deep][:number])


def measured(
    truth: FittedConstants, counts: Floats, rng: np.random.Generator, noise: float = SIGMA, *, known: bool = False
) -> Observations:
    """Return measurements of a machine by a person; `known` is whether the noise is."""
    points = model.points(truth, counts) + rng.normal(0.0, noise, (len(counts), 3))
    return Observations(counts, points, np.full(len(counts), noise) if known else None)


def distance(found: Calibration, truth: FittedConstants) -> float:
    """Return (θ − truth)ᵀ C⁻¹ (θ − truth) over what was fitted."""
    off = np.array([getattr(found.fitted, name) - getattr(truth, name) for name in found.free])
    return float(off @ np.linalg.solve(found.covariance, off))
