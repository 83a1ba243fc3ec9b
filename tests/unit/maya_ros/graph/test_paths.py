"""Paths cross the graph unchanged; invalid paths are refused; a requested time is kept."""

from __future__ import annotations

from itertools import permutations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_ros.graph import types
from maya_ros.graph.conversions import MotionPreviewer, path_from_message, path_to_message, speeds_for
from maya_ros.graph.protocol import Message
from maya_un.config import Config
from maya_un.controller.homing import homed_pose
from maya_un.controller.planner import Planner
from maya_un.controller.protocol import Preview
from maya_un.errors import InvalidMessage, InvalidValue, MayaError, TrajectoryRefused
from maya_un.kinematics.mechanism import Mechanism
from maya_un.kinematics.workspace import Workspace
from maya_un.motion.path import Blend, Path, Route, Space
from maya_un.values import LEAST_SPEED, Joints, Point

KIND = "trajectory_msgs/JointTrajectory"
NUMBERS = st.floats(-1e3, 1e3)
SHARES = st.floats(0.01, 1.0)
BLENDS = st.builds(Blend, st.floats(0.0, 1.0), st.floats(0.0, 1.0), SHARES, SHARES)


@st.composite
def paths(draw: st.DrawFn) -> Path:
    waypoints = draw(st.lists(st.tuples(NUMBERS, NUMBERS, NUMBERS), min_size=2, max_size=6))
    between = len(waypoints) - 2
    blends = draw(st.just([]) | st.lists(BLENDS, min_size=between, max_size=between))
    return Path(draw(st.sampled_from(Space)), tuple(waypoints), tuple(blends))


@given(paths(), st.floats(0.0, 1e6))
def test_path_is_unchanged_after_conversion(path: Path, least: float) -> None:
    read, time = path_from_message(types.conform(KIND, path_to_message(path, least)))
    assert (read.space, read.waypoints) == (path.space, path.waypoints)
    assert read.pieces.vias == path.pieces.vias
    assert (read.blends or (Blend(0.0, 0.0),) * (len(path.waypoints) - 2)) == (
        path.blends or (Blend(0.0, 0.0),) * (len(path.waypoints) - 2)
    )
    assert time == pytest.approx(least, abs=1e-8)


def test_joints_alone_are_a_path_straight_in_them() -> None:
    route = [Joints(0.0, 1.0, 2.0), Joints(0.1, 1.1, 2.1)]
    assert path_from_message(types.conform(KIND, path_to_message(route))) == (Path.joints(*route), 0.0)


@pytest.mark.parametrize("names", list(permutations("abc")))
def test_joints_may_have_any_order(names: tuple[str, ...]) -> None:
    point = {"a": 0.1, "b": 1.2, "c": 1.3}
    positions = [point[name] for name in names]
    message = trajectory(list(names), [positions, positions])
    assert path_from_message(message)[0].waypoints[0] == (0.1, 1.2, 1.3)


@pytest.mark.parametrize(
    "names",
    [[], ["a"], ["a", "b"], ["a", "b", "c", "d"], ["a", "b", "b"], ["A", "B", "C"], ["z", "y", "x"], ["a", "z", "d"]],
)
def test_other_names_are_refused(names: list[str]) -> None:
    with pytest.raises(InvalidMessage, match="joint_names"):
        path_from_message(trajectory(names, [[0.0] * len(names)] * 2))


@pytest.mark.parametrize(
    ("points", "error"),
    [
        ([], TrajectoryRefused),
        ([{"positions": [0.0, 1.0, 1.0]}], TrajectoryRefused),
        ([{"positions": [0.0, 1.0]}] * 2, InvalidMessage),
        ([{"positions": [0.0, 1.0, None]}] * 2, InvalidValue),
        ([{"positions": [0.0, 1.0, 1e308]}] * 2, InvalidValue),
        ([{"positions": [0.0, 1.0, 1.0], "effort": [0.1]}] * 3, InvalidMessage),
        ([{"positions": [0.0, 1.0, 1.0], "effort": [0.1, 0.1, 0.0, 1.0]}] * 3, InvalidValue),
        ([{"positions": [0.0, 1.0, 1.0], "effort": [-0.1, 0.1, 1.0, 1.0]}] * 3, InvalidValue),
        ([{"positions": [0.0, 1.0, 1.0], "effort": [0.1, None, 1.0, 1.0]}] * 3, InvalidValue),
    ],
)
def test_invalid_points_are_refused(points: list[Message], error: type[MayaError]) -> None:
    with pytest.raises(error):
        path_from_message(types.conform(KIND, {"joint_names": ["a", "b", "c"], "points": points}))


def test_velocities_and_efforts_at_the_ends_are_not_looked_at() -> None:
    point = {"positions": [0.0, 1.0, 1.0], "velocities": [9.0], "accelerations": [1.0, 2.0], "effort": [1.0]}
    path, _ = path_from_message(types.conform(KIND, {"joint_names": ["a", "b", "c"], "points": [point] * 2}))
    assert path.blends == ()


# Slowness of the path.

CONFIG = Config()
PLANNER = Planner(CONFIG, Mechanism.of(CONFIG))
WORKSPACE = Workspace.of(CONFIG)
HOME = homed_pose(CONFIG)
WAY = [HOME, HOME._replace(a=0.5)]


def preview(path: Route, *, speed: float = 1.0) -> Preview:
    return PLANNER.preview(WORKSPACE, path, speed)


def speed_for(preview: MotionPreviewer, path: Route, least: float) -> float:
    steps = speeds_for(preview, path, least)
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value


def test_without_a_time_it_goes_as_fast_as_it_may() -> None:
    assert speed_for(preview, WAY, 0.0) == 1.0
    assert speed_for(preview, WAY, 0.5 * preview(WAY).duration) == 1.0
    assert speed_for(preview, [HOME, HOME], 10.0) == 1.0


@given(st.floats(1.0, 100.0))
def test_requested_time_is_taken_and_no_more_than_necessary(times: float) -> None:
    """Accelerations go in steps, so that not every duration can be had: then a little faster is too fast."""
    least = times * preview(WAY).duration
    speed = speed_for(preview, WAY, least)
    duration = preview(WAY, speed=speed).duration
    assert least <= duration
    assert duration <= 1.03 * least or preview(WAY, speed=1.01 * speed).duration < least


def test_on_a_line_too() -> None:
    place = Mechanism.of(CONFIG).fk(HOME)
    path = Path.line(place, Point(place.x, place.y, place.z + 0.1))
    least = 3.0 * preview(path).duration
    duration = preview(path, speed=speed_for(preview, path, least)).duration
    assert least <= duration <= 1.03 * least + 0.1


def test_slower_than_can_be_is_refused() -> None:
    with pytest.raises(TrajectoryRefused, match="slowest"):
        speed_for(preview, WAY, 2.0 * preview(WAY, speed=LEAST_SPEED).duration)


def trajectory(names: list[str], points: list[list[float]]) -> Message:
    return types.conform(KIND, {"joint_names": names, "points": [{"positions": point} for point in points]})
