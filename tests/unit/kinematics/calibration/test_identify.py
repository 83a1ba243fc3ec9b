from __future__ import annotations

import numpy as np
import pytest

from maya_un.errors import NotIdentifiable
from maya_un.kinematics import Floats, Workspace
from maya_un.kinematics.calibration import Observations, calibrate
from maya_un.kinematics.calibration.identify import refusal as refusal_of
from maya_un.kinematics.calibration.identify import unknown
from tests.unit.kinematics.calibration.bench import CONFIG, NOW, TRUTH, counts_of, measured, random_counts

RNG = np.random.default_rng(7)


def at(places: Floats) -> Observations:
    """Return points measured at some places of the workspace."""
    workspace = Workspace.of(CONFIG)
    joints = workspace.mechanism.ik_many(places)
    return measured(TRUTH, counts_of(joints[workspace.contains_many(joints)]), np.random.default_rng(8))


def cylinder(angles: Floats, distance: Floats | float, height: Floats | float) -> Floats:
    rows = np.broadcast_arrays(distance * np.sin(angles), distance * np.cos(angles), height)
    return np.stack(rows, axis=1)


ANGLES = RNG.uniform(0.1, 1.9, 40)
DISTANCES = RNG.uniform(0.6, 2.0, 40)
HEIGHTS = RNG.uniform(0.3, 1.5, 40)


def refusal(seen: Observations, hold: tuple[str, ...] = ()) -> dict[str, str]:
    with pytest.raises(NotIdentifiable) as refused:
        calibrate(seen, NOW, hold)
    return {key: str(value) for key, value in refused.value.details.items()}


def test_at_one_angle_its_zero_and_its_scale_are_one() -> None:
    said = refusal(at(cylinder(np.full(40, 1.0), DISTANCES, HEIGHTS)))
    assert said["what"] == "counts per degree and zero of a"
    assert "angles of the boom farther apart" in said["remedy"]
    assert "heights" not in said["remedy"]
    assert "--hold zero_a" in said["remedy"]


def test_at_one_angle_the_rest_is_identified_once_one_is_held() -> None:
    found = calibrate(at(cylinder(np.full(40, 1.0), DISTANCES, HEIGHTS)), NOW, hold=("pulses_per_degree",))
    assert found.fitted.delta == pytest.approx(TRUTH.delta, abs=5.0 * found.errors["delta"])


def test_at_one_height_the_lines_cannot_be_identified() -> None:
    said = refusal(at(cylinder(ANGLES, DISTANCES, 0.6)))
    assert "height (H)" in said["what"]
    assert "zero of b" in said["what"]
    assert "delta" not in said["what"]
    assert "heights farther apart" in said["remedy"]
    assert "angles" not in said["remedy"]


def test_on_one_circle_nothing_of_the_lines_can_be_identified() -> None:
    said = refusal(at(cylinder(ANGLES, 1.2, 0.6)))
    assert "length (D)" in said["what"]
    assert "distances from the axis farther apart and heights farther apart" in said["remedy"]


def test_one_place_identifies_nothing() -> None:
    said = refusal(at(cylinder(np.full(40, 1.0), 1.2, 0.6)))
    assert said["remedy"].count("farther apart") == 3


@pytest.mark.parametrize(("number", "enough"), [(0, False), (3, False), (4, True)])
def test_eight_constants_need_four_points(number: int, enough: bool) -> None:
    counts = random_counts(np.random.default_rng(9), 4)[:number]
    seen = measured(TRUTH, counts, np.random.default_rng(10), noise=1e-4)
    if enough:
        assert calibrate(seen, NOW).freedom == 4
    else:
        assert "at least 4" in refusal(seen)["remedy"]


def test_pure_noise_identifies_nothing() -> None:
    rng = np.random.default_rng(11)
    counts = random_counts(rng, 12)
    assert refusal(Observations(counts, rng.uniform(-1.0, 1.0, (12, 3))))["what"]


def test_unidentifiable_constant_is_named() -> None:
    joints, places = np.zeros((5, 3)), cylinder(ANGLES, 1.2, HEIGHTS)[:5]
    said = refusal_of(["zero_a"], joints, places, 0.001).details
    assert (said["what"], said["reason"]) == ("zero of a", "the points do not show it")


def test_a_column_of_zeros_is_named_alone() -> None:
    weighted = np.diag([10.0, 0.0, 20.0])
    assert unknown(weighted, ("height", "length", "delta")) == ("length",)


def test_two_columns_that_are_the_same_are_named_together() -> None:
    weighted = np.array([[10.0, 10.0, 0.0], [10.0, 10.0, 0.0], [0.0, 0.0, 10.0]])
    assert unknown(weighted, ("height", "length", "delta")) == ("height", "length")


def test_fewer_rows_than_columns_leave_a_direction_unknown() -> None:
    assert unknown(np.array([[10.0, 0.0]]), ("height", "length")) == ("length",)


def test_a_direction_known_to_less_than_ten_plausible_errors_is_not_known() -> None:
    assert unknown(np.diag([10.0, 0.11]), ("height", "length")) == ()
    assert unknown(np.diag([10.0, 0.09]), ("height", "length")) == ("length",)
