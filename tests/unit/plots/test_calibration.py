from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes

from maya_un.kinematics.calibration import Calibration, Observations, calibrate
from maya_un.plots import style
from maya_un.plots.calibration import residuals_figure
from tests.unit.kinematics.calibration.bench import NOW, TRUTH, measured, random_counts


@pytest.fixture(scope="module")
def result() -> Calibration:
    rng = np.random.default_rng(31)
    seen = measured(TRUTH, random_counts(rng, 20), rng)
    places = seen.points.copy()
    places[6] += np.array([0.2, 0.1, -0.1])
    return calibrate(Observations(seen.counts, places), NOW)


def panels(result: Calibration) -> tuple[list[Axes], Axes]:
    *rows, plan = residuals_figure(result).axes
    return rows, plan


def drawn(axes: Axes, label: str) -> tuple[np.ndarray, np.ndarray]:
    (line,) = (line for line in axes.lines if line.get_label() == label)
    return np.asarray(line.get_xdata()), np.asarray(line.get_ydata())


def test_each_axis_shows_its_residuals_in_millimetres_by_point(result: Calibration) -> None:
    rows, _ = panels(result)
    assert [row.get_ylabel() for row in rows] == ["x [mm]", "y [mm]", "z [mm]"]
    for axis, row in enumerate(rows):
        number, before = drawn(row, "before")
        assert number.tolist() == list(range(1, 21))
        assert before == pytest.approx(result.residuals_before[:, axis] * 1e3)
        assert drawn(row, "after")[1] == pytest.approx(result.residuals_after[:, axis] * 1e3)


def test_an_outlier_is_crossed_out_within_every_panel(result: Calibration) -> None:
    for row in panels(result)[0]:
        number, value = drawn(row, "outlier")
        low, high = row.get_ylim()
        assert number.tolist() == [7]
        assert low < value[0] < high


def test_good_residuals_fill_the_panels_despite_an_outlier(result: Calibration) -> None:
    for axis, row in enumerate(panels(result)[0]):
        shown = np.abs(np.stack([result.residuals_before, result.residuals_after])[:, result.inliers, axis]).max()
        assert row.get_ylim()[1] == pytest.approx(1.3 * shown * 1e3)


def test_the_plan_has_an_arrow_for_every_good_point(result: Calibration) -> None:
    _, plan = panels(result)
    (arrows,) = (found for found in plan.collections if type(found).__name__ == "Quiver")
    offsets = np.asarray(arrows.get_offsets())
    assert offsets == pytest.approx(result.observations.points[result.inliers, :2])
    assert plan.get_aspect() == 1.0


def test_points_without_outliers_have_no_crosses() -> None:
    rng = np.random.default_rng(32)
    found = calibrate(measured(TRUTH, random_counts(rng, 12), rng), NOW)
    rows, _ = panels(found)
    assert [line.get_label() for line in rows[0].lines if line.get_label() == "outlier"] == []


def test_it_is_written_as_a_picture(result: Calibration, tmp_path: Path) -> None:
    style.save(residuals_figure(result), tmp_path / "left.png")
    assert (tmp_path / "left.png").read_bytes().startswith(b"\x89PNG")
