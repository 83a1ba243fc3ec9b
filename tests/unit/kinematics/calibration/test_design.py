from __future__ import annotations

from itertools import combinations, permutations

import numpy as np
import pytest

from maya_un.config import Config
from maya_un.kinematics import Floats, Workspace
from maya_un.kinematics.calibration import FITTED, FittedConstants, calibrate, design
from maya_un.values import Joints
from tests.campaign import Campaign
from tests.unit.kinematics.calibration.bench import CONFIG, NOW, TRUTH, counts_of, generator, measured

FREE = tuple(name for name in FITTED if name != "gripper_height")
GRID = design.grid(CONFIG)
ROWS = design.information(CONFIG, GRID, FREE)
START = Joints(0.035, 1.5, 1.3)


def test_every_pose_lies_inside_with_a_margin() -> None:
    workspace = Workspace.of(CONFIG)
    assert len(GRID) > 1_000
    for pose in GRID:
        margins = workspace.margins(Joints(*map(float, pose)))
        assert min(margins.line_b, margins.line_c, margins.inner, margins.outer) >= 0.02
        assert margins.boom >= 0.03 - 1e-9
        assert max(workspace.tension_limit - margins.tension_b, workspace.tension_limit - margins.tension_c) <= 3.5
    assert np.min(workspace.mechanism.fk_many(GRID)[:, 2]) >= 0.25 - 1e-9


def test_a_machine_too_small_for_the_margins_has_no_poses() -> None:
    raised = CONFIG.geometry.model_copy(update={"height": 0.46})
    cell = CONFIG.cell.model_copy(update={"grasp_height": 0.1, "clearance": 0.05})
    assert len(design.grid(CONFIG.model_copy(update={"geometry": raised, "cell": cell}))) == 0


def test_information_is_the_slope_of_the_points_in_plausible_errors() -> None:
    higher = FittedConstants.of(CONFIG)._replace(height=2.36)
    assert higher.height - 2.35 == pytest.approx(0.01)
    assert ROWS[:, :, 0] == pytest.approx(np.tile([0.0, 0.0, 10.0], (len(GRID), 1)))


@pytest.mark.parametrize("number", [8, 20])
def test_chosen_poses_are_better_than_any_of_a_thousand_random_sets(campaign: Campaign, number: int) -> None:
    chosen = design.chosen(ROWS, number, ROWS[:0])
    rng = generator(campaign.rng())
    best = max(
        design.log_determinant(ROWS[rng.choice(len(GRID), number, replace=False)])
        for _ in range(campaign.size(ci=1_000, long=20_000))
    )
    assert len(set(chosen)) == number
    assert design.log_determinant(ROWS[chosen]) > best + 1.5


def test_of_few_candidates_the_best_set_is_nearly_found(campaign: Campaign) -> None:
    """All 495 ways of taking 4 of 12 are looked at; greedy exchange comes within a tenth of the best log det."""
    for case in range(campaign.size(ci=20, long=500)):
        rng = generator(campaign.rng(case))
        few = ROWS[rng.choice(len(GRID), 12, replace=False)]
        best = max(design.log_determinant(few[list(some)]) for some in combinations(range(12), 4))
        assert design.log_determinant(few[design.chosen(few, 4, few[:0])]) > best - 0.1 * abs(best)


def test_measured_pose_is_not_measured_again() -> None:
    first = design.chosen(ROWS, 10, ROWS[:0])
    second = design.chosen(ROWS, 10, ROWS[first])
    fresh = design.log_determinant(ROWS[first + second])
    assert fresh > design.log_determinant(ROWS[first + first])
    assert fresh == pytest.approx(design.log_determinant(ROWS[design.chosen(ROWS, 20, ROWS[:0])]), abs=1.0)


def test_measured_poses_are_excluded_whatever_the_rounding() -> None:
    left = design.apart(GRID, GRID[[3, 700]] + np.array([1e-4, -1e-6, 1e-6]))
    assert len(left) == len(GRID) - 2
    assert not np.any(np.all(left == GRID[3], axis=1))
    assert len(design.apart(GRID, GRID[:0])) == len(GRID)


def test_no_more_poses_are_chosen_than_there_are() -> None:
    assert sorted(design.chosen(ROWS[:5], 9, ROWS[:0])) == [0, 1, 2, 3, 4]


def test_poses_that_leave_a_direction_unknown_have_no_determinant() -> None:
    assert design.log_determinant(ROWS[:2]) == -np.inf


def test_twelve_chosen_poses_are_enough_to_calibrate() -> None:
    rng = np.random.default_rng(12)
    counts = counts_of(GRID[design.chosen(ROWS, 12, ROWS[:0])])
    found = calibrate(measured(TRUTH, counts, rng), NOW)
    assert max(found.errors["delta"], found.errors["zero_b"], found.errors["zero_c"]) < 3e-3


def way_time(poses: Floats, order: list[int]) -> float:
    speeds = np.array([1000 / 371.06 * np.pi / 180, 0.045, 0.045])
    way = np.vstack([np.array(START), poses[order]])
    return float(np.sum(np.max(np.abs(np.diff(way, axis=0)) / speeds, axis=1)))


def test_time_of_travel_is_that_of_the_slowest_axis() -> None:
    poses = np.array([[0.0, 1.0, 1.5], [0.1, 1.45, 1.5]])
    assert design.travel_time(CONFIG, poses)[0, 1] == pytest.approx(10.0)


def test_every_pose_is_visited_once_and_few_by_the_shortest_way(campaign: Campaign) -> None:
    for case in range(campaign.size(ci=10, long=200)):
        rng = generator(campaign.rng(case))
        poses = GRID[rng.choice(len(GRID), 6, replace=False)]
        order = design.ordered(CONFIG, poses, START)
        assert sorted(order) == list(range(6))
        assert way_time(poses, order) <= 1.25 * min(way_time(poses, list(other)) for other in permutations(range(6)))


def test_thirty_poses_are_travelled_in_a_quarter_of_the_time() -> None:
    poses = GRID[design.chosen(ROWS, 30, ROWS[:0])]
    assert way_time(poses, design.ordered(CONFIG, poses, START)) < 0.25 * way_time(poses, list(range(30)))


def test_nothing_to_visit_has_an_empty_order() -> None:
    assert design.ordered(Config(), GRID[:0], START) == []
