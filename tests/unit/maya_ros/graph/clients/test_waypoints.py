"""Waypoints are reported as they are passed, in order and once each, at any change of the speed."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from maya_ros.graph.clients.controller import Vias
from maya_un.config import Config, Units
from maya_un.controller.planner import MotionPlan, Planner
from maya_un.kinematics.mechanism import Mechanism
from maya_un.kinematics.workspace import Workspace
from maya_un.motion.path import Path
from maya_un.values import Point

CONFIG = Config()
PLANNER, WORKSPACE = Planner(CONFIG, Mechanism.of(CONFIG)), Workspace.of(CONFIG)
POINTS = st.builds(Point, st.floats(0.3, 0.9), st.floats(0.8, 1.2), st.floats(0.4, 1.2))


def plan(*corners: Point) -> MotionPlan:
    return PLANNER.plan(WORKSPACE, Path.line(*corners), 1.0)


def driven(planned: MotionPlan, paces: list[tuple[float, float]], every: float = 0.25) -> list[tuple[int, float]]:
    """Drive along a plan at changing shares of its speed; return the reported vias, with the planned time at each."""
    assert planned.move is not None
    passed: list[tuple[int, float]] = []
    gone = now = 0.0
    vias = Vias(planned, Units.of(CONFIG), lambda via: passed.append((via, gone)), began=0.0)
    for pace, seconds in [*paces, (1.0, 1e4)]:
        until = now + seconds
        while now < until and gone < planned.move.duration:
            now, gone = now + every, gone + pace * every
            vias.at(planned.move.position_at(gone), now)
    vias.finish()
    return passed


@settings(max_examples=20)
@given(
    st.lists(POINTS, min_size=3, max_size=4, unique=True),
    st.lists(st.tuples(st.sampled_from([0.0, 0.05, 0.3, 1.0]), st.floats(0.1, 10.0)), max_size=3),
)
def test_each_waypoint_is_reported_once_in_order_near_its_place(
    corners: list[Point], paces: list[tuple[float, float]]
) -> None:
    try:
        planned = plan(*corners)
    except Exception:  # noqa: BLE001 - not every drawn way can be gone
        return
    if planned.move is None:
        return
    passed, times = driven(planned, paces), planned.move.via_times()
    assert [via for via, _ in passed] == list(range(len(times)))
    assert all(abs(gone - time) < 0.5 for (_, gone), time in zip(passed, times, strict=True))


def test_path_there_and_back_is_not_mistaken_for_its_return() -> None:
    low, high = Point(0.5, 1.0, 0.5), Point(0.5, 1.0, 0.9)
    planned = plan(low, high, low, high, low)
    assert planned.move is not None
    passed = driven(planned, [(0.3, 5.0), (0.0, 30.0), (1.0, 5.0)])
    assert [via for via, _ in passed] == [0, 1, 2]
    for (_, gone), time in zip(passed, planned.move.via_times(), strict=True):
        assert abs(gone - time) < 0.5


def test_no_waypoint_is_reported_after_a_stop() -> None:
    low, high = Point(0.5, 1.0, 0.5), Point(0.5, 1.0, 0.9)
    planned = plan(low, high, low)
    told: list[int] = []
    vias = Vias(planned, Units.of(CONFIG), told.append, began=0.0)
    assert planned.move is not None
    vias.at(planned.move.position_at(1.0), 1.0)
    assert told == []
