"""The figure of a motion shows what the samples say, against the limits of the machine."""

from __future__ import annotations

from math import pi, radians

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from maya_un.config import Config
from maya_un.kinematics import Workspace
from maya_un.kinematics.zones import Box
from maya_un.plots import style
from maya_un.plots.job import MotionPhase, MotionSamples, job_figure
from maya_un.values import Joints, Point

CONFIG = Config()
WORKSPACE = Workspace.of(CONFIG)
TIME = np.linspace(0.0, 10.0, 41)
START, END = (WORKSPACE.ik(Point(0.4, 1.1, z)) for z in (0.4, 0.8))
JOINTS = np.array(START) + np.outer(TIME / 10.0, np.subtract(END, START))
VELOCITY = np.tile(np.subtract(END, START) / 10.0, (41, 1))
PHASES = (
    MotionPhase("up", 0.0, 6.0),
    MotionPhase("a name that is too long", 6.0, 6.5, "7"),
    MotionPhase("nor has this", 6.5, 6.6),
    MotionPhase("on", 6.6, 10.0),
)


def figure(workspace: Workspace = WORKSPACE, joints: np.ndarray = JOINTS) -> Figure:
    return job_figure(TIME, joints, VELOCITY, PHASES, CONFIG, workspace, "a job")


@pytest.fixture(scope="module")
def drawn() -> Figure:
    return figure()


def panel(of: Figure, label: str) -> Axes:
    (found,) = (axes for axes in of.axes if axes.get_ylabel() == label)
    return found


def curve(axes: Axes, index: int = 0) -> np.ndarray:
    return np.asarray(axes.lines[index].get_ydata(), dtype=np.float64)


def limits(axes: Axes) -> list[float]:
    return sorted(float(curve(axes, i)[0]) for i, line in enumerate(axes.lines) if line.get_linestyle() == "--")


def test_positions_and_their_strokes_are_in_degrees_and_metres(drawn: Figure) -> None:
    assert curve(panel(drawn, "a [°]")) == pytest.approx(np.degrees(JOINTS[:, 0]))
    assert curve(panel(drawn, "b [m]")) == pytest.approx(JOINTS[:, 1])
    assert limits(panel(drawn, "a [°]")) == pytest.approx([0.0, 120.0])
    assert limits(panel(drawn, "b [m]")) == [0.575, 2.26]
    assert limits(panel(drawn, "c [m]")) == [0.565, 2.3]


def test_velocities_are_shown_with_the_slew_of_each_axis(drawn: Figure) -> None:
    assert curve(panel(drawn, "b [mm/s]")) == pytest.approx(VELOCITY[:, 1] * 1e3)
    # 1000 counts/s at 371.06 counts/° are 2.695 °/s; 45 000 at 1 000 000 counts/m are 45 mm/s.
    assert limits(panel(drawn, "a [°/s]")) == pytest.approx([-2.695, 2.695], abs=5e-4)
    assert limits(panel(drawn, "c [mm/s]")) == pytest.approx([-45.0, 45.0])


def test_height_and_tension_are_the_mechanisms(drawn: Figure) -> None:
    heights = curve(panel(drawn, "z [m]"))
    assert heights[[0, -1]] == pytest.approx([0.4, 0.8])
    pulls = panel(drawn, "tension [× load]")
    margins = WORKSPACE.margins(START)
    assert curve(pulls, 0)[0] == pytest.approx(5.0 - margins.tension_b)
    assert curve(pulls, 1)[0] == pytest.approx(5.0 - margins.tension_c)
    assert limits(pulls) == [5.0]


def test_margins_are_those_of_the_workspace() -> None:
    course = MotionSamples(TIME, JOINTS, VELOCITY, WORKSPACE)
    found = {name: values for name, values, _ in course.margins()}
    for row in (0, 17, 40):
        margins = WORKSPACE.margins(Joints(*JOINTS[row]))
        assert found["stroke of b"][row] == pytest.approx(margins.line_b)
        assert found["stroke of c"][row] == pytest.approx(margins.line_c)
        assert found["slack"][row] == pytest.approx(min(margins.inner, margins.outer))
        assert found["table"][row] == pytest.approx(margins.floor)


def test_every_zone_has_its_own_curve() -> None:
    box = Box("press", Point(0.6, 0.9, 0.0), Point(0.9, 1.3, 0.3))
    workspace = WORKSPACE.with_zones([box])
    near = panel(figure(workspace), "distance to limit [m]")
    legend = near.get_legend()
    assert legend is not None
    assert legend.get_texts()[-1].get_text() == "zone press"
    zone = next(line for line in near.lines if line.get_label() == "zone press")
    drawn = np.asarray(zone.get_ydata())
    assert drawn[17] == pytest.approx(box.clearance(WORKSPACE.mechanism, Joints(*JOINTS[17])), abs=1e-6)


def test_phases_have_their_names_or_short_names_by_space(drawn: Figure) -> None:
    assert [text.get_text() for text in panel(drawn, "a [°]").texts] == ["up", "7", "on"]


def test_path_is_drawn_from_above_and_from_the_side(drawn: Figure) -> None:
    above, side = drawn.axes[-2:]
    lines = [line for axes in (above, side) for line in axes.lines if line.get_label() == "start"]
    starts = [np.asarray(line.get_xydata()) for line in lines]
    assert starts[0][0] == pytest.approx([0.4, 1.1])
    assert starts[1][0] == pytest.approx([np.hypot(0.4, 1.1), 0.4])
    assert above.get_title(loc="left").endswith("z = 0.40 m")


def test_rows_of_which_nothing_is_known_are_left_out() -> None:
    joints = JOINTS.copy()
    joints[:10] = np.nan
    zoned = WORKSPACE.with_zones([Box("far", Point(0.1, 0.1, 0.0), Point(0.2, 0.2, 0.1))])
    drawn = figure(zoned, joints)
    assert np.isnan(curve(panel(drawn, "z [m]"))).tolist() == [True] * 10 + [False] * 31
    side = drawn.axes[-1]
    (start,) = (np.asarray(line.get_xydata())[0] for line in side.lines if line.get_label() == "start")
    assert start[1] == pytest.approx(WORKSPACE.fk(Joints(*JOINTS[10])).z)
    assert style.rendered(drawn, "svg")


def test_a_motion_of_the_boom_alone_and_a_job_of_no_length_can_be_drawn() -> None:
    turned = np.column_stack((np.linspace(radians(10), pi / 2, 41), np.full(41, 1.2), np.full(41, 1.3)))
    assert style.rendered(job_figure(TIME, turned, np.zeros((41, 3)), (), CONFIG), "svg")
    still = job_figure(np.zeros(2), turned[:2], np.zeros((2, 3)), (MotionPhase("none", 0.0, 0.0),), CONFIG)
    assert style.rendered(still, "svg")
