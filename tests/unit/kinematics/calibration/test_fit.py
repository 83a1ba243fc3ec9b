from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import stats

from maya_un.errors import InvalidValue, NotIdentifiable
from maya_un.kinematics import Workspace
from maya_un.kinematics.calibration import FITTED, Observations, calibrate, model
from maya_un.kinematics.calibration.parameters import TYPICAL
from tests.campaign import Campaign
from tests.unit.kinematics.calibration.bench import (
    CONFIG,
    NOW,
    SIGMA,
    TRUTH,
    counts_of,
    distance,
    drawn,
    generator,
    measured,
    random_counts,
)

FREE = tuple(name for name in FITTED if name != "gripper_height")


def a_set(number: int = 30, seed: int = 3, **how: Any) -> Observations:
    rng = np.random.default_rng(seed)
    return measured(TRUTH, random_counts(rng, number), rng, **how)


def kolmogorov_smirnov(drawn_from: list[float], law: Any) -> float:
    """Return the probability that draws of `law` lie as far from it as these."""
    return float(stats.kstest(drawn_from, law.cdf).pvalue)


def test_points_without_noise_give_the_machine_back() -> None:
    found = calibrate(a_set(12, noise=0.0), NOW)
    for name in FREE:
        off = (getattr(found.fitted, name) - getattr(TRUTH, name)) / getattr(TYPICAL, name)
        assert abs(off) < 1e-5, name
    assert found.rms_after < 1e-9
    assert found.rms_before > 1e-3
    assert found.outliers == ()


@pytest.mark.parametrize("name", FREE)
@pytest.mark.parametrize("share", [1.0, 1e-3])
def test_one_wrong_constant_is_found(name: str, share: float) -> None:
    """Then most coordinates of the points may be right, and the bearing of the points may differ by rounding only."""
    wrong = TRUTH._replace(**{name: getattr(TRUTH, name) + share * getattr(TYPICAL, name)})
    found = calibrate(a_set(16, noise=0.0), wrong)
    for each in FREE:
        off = (getattr(found.fitted, each) - getattr(TRUTH, each)) / getattr(TYPICAL, each)
        assert abs(off) < 1e-5, each
    assert found.outliers == ()


def test_result_lies_about_the_truth_as_the_covariance_predicts(campaign: Campaign) -> None:
    """Over many machines, (θ − truth)ᵀ C⁻¹ (θ − truth) follows χ² with as many degrees as constants."""
    squares: list[float] = []
    for case in range(campaign.size(ci=200, long=2_000)):
        rng = generator(campaign.rng(case))
        truth = drawn(rng)
        squares.append(distance(calibrate(measured(truth, random_counts(rng, 24), rng, known=True), NOW), truth))
    law = stats.chi2(len(FREE))
    assert kolmogorov_smirnov(squares, law) > 1e-3
    assert np.mean(squares) == pytest.approx(len(FREE), abs=4.0 * law.std() / np.sqrt(len(squares)))
    for share in (0.5, 0.9, 0.99):
        error = 4.0 * np.sqrt(share * (1.0 - share) / len(squares))
        assert np.mean(np.array(squares) <= law.ppf(share)) == pytest.approx(share, abs=error)


def test_with_unknown_noise_it_follows_fishers_law(campaign: Campaign) -> None:
    """The covariance is then estimated with 3n − p degrees of freedom: the square over p follows F(p, 3n − p)."""
    squares: list[float] = []
    for case in range(campaign.size(ci=60, long=2_000)):
        rng = generator(campaign.rng(case))
        truth = drawn(rng)
        squares.append(distance(calibrate(measured(truth, random_counts(rng, 16), rng), NOW), truth) / len(FREE))
    assert kolmogorov_smirnov(squares, stats.f(len(FREE), 3 * 16 - len(FREE))) > 1e-3


def test_one_gross_error_in_twenty_is_found_and_does_no_harm(campaign: Campaign) -> None:
    squares: list[float] = []
    wronged = 0
    for case in range(campaign.size(ci=30, long=1_000)):
        rng = generator(campaign.rng(case))
        truth = drawn(rng)
        good = measured(truth, random_counts(rng, 40), rng, known=True)
        points = good.points.copy()
        gross = np.sort(rng.choice(40, 2, replace=False))
        points[gross] += rng.choice([-1.0, 1.0], (2, 3)) * rng.uniform(0.02, 0.5, (2, 3))
        found = calibrate(Observations(good.counts, points, good.sigma), NOW)
        assert set(gross + 1) <= set(found.outliers)
        wronged += len(found.outliers) - 2
        squares.append(distance(found, truth))
    assert wronged <= len(squares) * 40 / 500
    assert kolmogorov_smirnov(squares, stats.chi2(len(FREE))) > 1e-3


def test_an_outlier_keeps_its_residual_for_all_to_see() -> None:
    good = a_set()
    points = good.points.copy()
    points[4, 1] += 0.1
    found = calibrate(Observations(good.counts, points, rows=tuple(range(101, 131))), NOW)
    assert found.outliers == (105,)
    assert found.residuals_after[4, 1] == pytest.approx(-0.1, abs=0.01)
    assert found.rms_after == pytest.approx(np.sqrt(3.0) * SIGMA, rel=0.3)


def test_the_noise_is_estimated() -> None:
    found = calibrate(a_set(200), NOW)
    assert found.noise == pytest.approx(SIGMA, rel=0.1)
    assert found.freedom == 3 * (200 - len(found.outliers)) - len(FREE)


def test_a_row_with_a_small_sigma_counts_more() -> None:
    rng = np.random.default_rng(5)
    counts = random_counts(rng, 60)
    points = model.points(TRUTH, counts)
    points[30:] += np.array([0.0, 0.0, 0.01])
    trusted = np.r_[np.full(30, 1e-4), np.full(30, 1e-2)]
    found = calibrate(Observations(counts, points, trusted), NOW)
    assert found.fitted.height == pytest.approx(TRUTH.height, abs=1e-4)


def test_correlations_have_ones_on_their_diagonal_and_errors_are_roots_of_the_covariance() -> None:
    found = calibrate(a_set(), NOW)
    assert np.diag(found.correlations) == pytest.approx(np.ones(len(FREE)))
    assert np.max(np.abs(found.correlations)) <= 1.0 + 1e-12
    assert found.errors["delta"] ** 2 == pytest.approx(found.covariance[2, 2])


def test_phi_is_held_by_default_and_the_text_mentions_it() -> None:
    found = calibrate(a_set(), NOW, hold=())
    assert found.held == ("gripper_height",)
    assert "gripper_height (Φ) is held" in found.words[0]


def test_with_h_held_phi_takes_its_place() -> None:
    found = calibrate(a_set(noise=0.0), NOW, hold=("height",))
    assert found.held == ("height",)
    assert found.fitted.gripper_height == pytest.approx(0.2 - 0.012, abs=1e-6)
    assert found.words[0].startswith("height (H) is held")


@pytest.mark.parametrize("zero", [-3.0, -1.5, 2.0, 3.1])
def test_a_frame_with_another_north_is_found(zero: float) -> None:
    rng = np.random.default_rng(4)
    turned = TRUTH._replace(zero_a=zero)
    assert distance(calibrate(measured(turned, random_counts(rng, 30), rng), NOW), turned) < 40.0


def test_held_parameter_is_unchanged() -> None:
    found = calibrate(a_set(), NOW, hold=("zero_b", "length"))
    assert found.held == ("length", "gripper_height", "zero_b")
    assert (found.fitted.length, found.fitted.zero_b) == (NOW.length, 0.0)
    assert found.covariance.shape == (6, 6)


def test_with_h_and_phi_both_held_there_is_nothing_to_say_about_them() -> None:
    assert calibrate(a_set(), NOW, hold=("height", "gripper_height")).words == ()


def test_with_everything_held_there_is_nothing_to_fit() -> None:
    with pytest.raises(InvalidValue, match="nothing is left"):
        calibrate(a_set(), NOW, hold=FITTED)


@pytest.mark.parametrize("wrong", ["mirrored", "stretched", "noise", "one place", "a grid of nothing", "anywhere"])
def test_points_of_no_such_machine_give_a_result_or_a_refusal(campaign: Campaign, wrong: str) -> None:
    """For any measurements and held parameters: the result is numbers or `NotIdentifiable`."""
    for case in range(campaign.size(ci=20, long=1_000)):
        rng = generator(campaign.rng(case))
        number = int(rng.integers(1, 25))
        counts = random_counts(rng, number)
        points = model.points(TRUTH, counts)
        match wrong:
            case "mirrored":
                points *= np.array([1.0, -1.0, 1.0])
            case "stretched":
                points *= 1.1
            case "noise":
                points = rng.uniform(-2.0, 2.0, points.shape)
            case "one place":
                counts, points = np.tile(counts[:1], (number, 1)), np.tile(points[:1], (number, 1))
            case "a grid of nothing":
                counts, points = rng.choice([1.0, 1e6, 2e6], counts.shape), rng.choice([-1.0, 0.0, 1.0], counts.shape)
            case _:
                counts, points = rng.uniform(0.0, 9.9e6, counts.shape), rng.uniform(-10.0, 10.0, counts.shape)
        sigma = np.full(number, 10.0 ** rng.uniform(-6.0, -0.1)) if case % 2 else None
        held = tuple(rng.choice(FITTED, int(rng.integers(0, 8)), replace=False))
        try:
            found = calibrate(Observations(counts, points, sigma), NOW, held)
        except NotIdentifiable:
            continue
        assert np.all(np.isfinite(found.fitted))
        assert np.all(np.linalg.eigvalsh(found.correlations) > -1e-9)


def test_lines_that_differ_are_noticed() -> None:
    rng = np.random.default_rng(6)
    differing = TRUTH._replace(line_difference=0.01)
    found = calibrate(measured(differing, random_counts(rng, 60), rng), NOW)
    assert found.line_difference is not None
    assert found.line_difference.is_significant
    assert found.line_difference.value == pytest.approx(0.01, abs=5.0 * found.line_difference.error)
    assert "differ in counts per metre" in found.words[-1]


def test_lines_that_do_not_differ_are_left_in_peace() -> None:
    found = calibrate(a_set(60), NOW).line_difference
    assert found is not None
    assert not found.is_significant


def test_a_sigma_that_is_too_small_is_called_so() -> None:
    good = a_set(40)
    found = calibrate(Observations(good.counts, good.points, np.full(40, SIGMA / 3.0)), NOW)
    assert found.outliers == ()
    assert found.noise == pytest.approx(3.0, rel=0.2)
    assert any("times their sigma" in sentence for sentence in found.words)


@pytest.mark.parametrize("known", [False, True])
def test_mirrored_frame_is_not_taken_for_a_machine(known: bool) -> None:
    good = a_set(40, known=known)
    with pytest.raises(NotIdentifiable, match="the coordinates are in Maya's frame"):
        calibrate(Observations(good.counts, good.points * np.array([1.0, -1.0, 1.0]), good.sigma), NOW)


def test_points_that_the_constants_do_not_explain_are_called_so() -> None:
    rng = np.random.default_rng(13)
    found = calibrate(measured(TRUTH, random_counts(rng, 200), rng, noise=0.05), NOW)
    assert any("do not apply this" in sentence for sentence in found.words)


def test_constants_that_are_known_only_together_are_named() -> None:
    """On a circle at many heights each length of the lines makes up for another, nearly."""
    rng = np.random.default_rng(14)
    angles, heights = rng.uniform(0.1, 1.9, 60), rng.uniform(0.3, 1.5, 60)
    places = np.stack([0.8 * np.sin(angles), 0.8 * np.cos(angles), heights], axis=1)
    counts = counts_of(Workspace.of(CONFIG).mechanism.ik_many(places))
    found = calibrate(measured(TRUTH, counts, rng), NOW)
    assert any("zero of b and zero of c are known well only together" in sentence for sentence in found.words)


def test_many_outliers_are_called_too_many_for_chance() -> None:
    good = a_set(40)
    points = good.points.copy()
    points[::4] += np.array([0.2, -0.3, 0.1])
    found = calibrate(Observations(good.counts, points), NOW)
    assert len(found.outliers) == 10
    assert any("for chance" in sentence for sentence in found.words)
