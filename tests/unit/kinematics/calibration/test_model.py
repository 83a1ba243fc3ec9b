from __future__ import annotations

from math import pi

import numpy as np
import pytest

from maya_un.config import Units
from maya_un.kinematics import Mechanism
from maya_un.kinematics.calibration import FittedConstants, model
from maya_un.kinematics.calibration.parameters import TYPICAL
from tests.unit.kinematics.calibration.bench import CONFIG, NOW, TRUTH, random_counts

COUNTS = random_counts(np.random.default_rng(1), 40)
BENT = TRUTH._replace(line_difference=0.004)


def test_without_errors_the_model_is_the_mechanism() -> None:
    joints = COUNTS / np.array(Units.of(CONFIG).per_unit)
    assert np.allclose(model.joints(NOW, COUNTS), joints, rtol=0.0, atol=1e-12)
    assert np.allclose(model.points(NOW, COUNTS), Mechanism.of(CONFIG).fk_many(joints), rtol=0.0, atol=1e-12)


def test_a_case_worked_by_hand() -> None:
    # Triangle 3-4-5 twice: W = 2, b = c = 1.25, so u = 1, h = 0.75; the boom at 90 degrees.
    machine = FittedConstants(
        height=2.5,
        length=2.4,
        delta=0.4,
        gripper_height=0.15,
        pulses_per_metre=1e6,
        pulses_per_degree=100.0,
        zero_a=pi / 6,
        zero_b=0.05,
        zero_c=-0.05,
    )
    found = model.points(machine, np.array([[6_000.0, 1_200_000.0, 1_300_000.0]]))
    assert found == pytest.approx(np.array([[1.4, 0.0, 1.6]]), abs=1e-12)


def test_one_line_with_more_counts_per_metre_is_shorter_by_that_share() -> None:
    _, b, c = model.joints(NOW._replace(line_difference=0.002), np.array([[0.0, 1e6, 1e6]]))[0]
    assert (b, c) == (pytest.approx(1 / 1.001), pytest.approx(1 / 0.999))


@pytest.mark.parametrize("name", FittedConstants._fields)
def test_the_jacobian_is_the_slope(name: str) -> None:
    step = 1e-4 * getattr(TYPICAL, name)
    more = model.points(BENT._replace(**{name: getattr(BENT, name) + step}), COUNTS)
    less = model.points(BENT._replace(**{name: getattr(BENT, name) - step}), COUNTS)
    slope = model.jacobian(BENT, COUNTS)[:, :, FittedConstants._fields.index(name)]
    assert np.max(np.abs((more - less) / (2.0 * step) - slope)) < 1e-8 * np.max(np.abs(slope))


def test_lines_that_cannot_meet_hang_a_millimetre_deep() -> None:
    impossible = np.array([[0.0, 600_000.0, 600_000.0]])
    assert model.points(NOW, impossible)[0, 2] == pytest.approx(2.15 - 1e-3)
    assert np.all(np.isfinite(model.jacobian(NOW, impossible)))
