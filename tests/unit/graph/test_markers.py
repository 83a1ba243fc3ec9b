"""What rviz is told: everything once, then only what has changed; what is gone is taken away."""

from __future__ import annotations

from dataclasses import replace

import pytest

from maya_un.graph import types
from maya_un.graph.markers import HEAVY, LIGHT, Drawing, View, line_marker, state_markers
from maya_un.graph.protocol import Message
from maya_un.kinematics.zones import Box
from maya_un.values import Joints, Mode, Notice, Point, State
from tests.fakes import state_of
from tests.strategies import WORKSPACE

MECHANISM = WORKSPACE.mechanism
HERE = WORKSPACE.ik(Point(0.5, 1.2, 0.5))
DELETE = 2


def standing(joints: Joints | None = HERE) -> State:
    return state_of(joints)


def names(array: Message | None) -> list[str]:
    assert array is not None
    types.conform("visualization_msgs/MarkerArray", array)
    return sorted({one["ns"] for one in array["markers"]})


def test_everything_is_told_once_and_then_nothing_until_something_changes() -> None:
    drawing, view = Drawing(), View(standing(), WORKSPACE, parts={"bolt": Point(0.3, 1.0, 0.4)})
    assert names(drawing.update(view)) == ["lines", "parts", "stands", "workspace"]
    assert drawing.update(view) is None
    assert names(drawing.update(view, whole=True)) == ["lines", "parts", "stands", "workspace"]


def test_while_the_robot_moves_only_the_lines_are_told() -> None:
    drawing, view = Drawing(), View(standing(), WORKSPACE, parts={"bolt": Point(0.3, 1.0, 0.4)})
    drawing.update(view)
    moved = replace(view, state=standing(HERE._replace(b=HERE.b + 0.001)))
    array = drawing.update(moved)
    assert names(array) == ["lines"]
    assert array is not None
    assert len(array["markers"]) == 1


def test_a_path_that_has_been_gone_is_taken_away() -> None:
    drawing, view = Drawing(), View(standing(), WORKSPACE, way=(Point(0.5, 1.2, 0.5), Point(0.6, 1.2, 0.5)))
    assert "path" in names(drawing.update(view))
    array = drawing.update(replace(view, way=()))
    assert array is not None
    assert [(one["ns"], one["id"], one["action"]) for one in array["markers"]] == [
        ("path", 0, DELETE),
        ("path", 1, DELETE),
    ]


def test_other_zones_or_strokes_draw_the_surroundings_anew() -> None:
    drawing, view = Drawing(), View(standing(), WORKSPACE)
    drawing.update(view)
    fenced = replace(view, zones=(Box("box", Point(0.1, 0.2, 0.0), Point(0.5, 1.0, 0.6)),))
    assert names(drawing.update(fenced)) == ["zones"]
    measured = replace(fenced, workspace=replace(WORKSPACE, line_b=(0.575, 2.2)))
    assert names(drawing.update(measured)) == ["workspace"]


def test_a_part_that_is_carried_is_told_when_it_is_taken_and_when_it_is_put_down() -> None:
    drawing = Drawing()
    at = Point(0.5, 1.2, 0.52)
    view = View(standing(), WORKSPACE, parts={"bolt": at})
    drawing.update(view)
    taken = replace(view, carried="bolt")
    (part,) = (one for one in _told(drawing.update(taken)) if one["ns"] == "parts")
    assert part["header"]["frame_id"] == "gripper"
    assert part["pose"]["position"]["z"] == pytest.approx(0.02)
    higher = replace(taken, state=standing(WORKSPACE.ik(Point(0.5, 1.2, 0.6))), parts={"bolt": Point(0.5, 1.2, 0.6)})
    assert {one["ns"] for one in _told(drawing.update(higher))} == {"lines"}
    down = replace(higher, carried=None)
    (part,) = (one for one in _told(drawing.update(down)) if one["ns"] == "parts")
    assert part["header"]["frame_id"] == "base"


def test_lines_run_from_the_anchors_to_where_they_meet() -> None:
    inner, meeting, outer, again = line_marker(Joints(0.0, 2.0, 2.0), MECHANISM, 5.0)["points"]
    assert meeting == again
    assert inner == pytest.approx({"x": 0.0, "y": 0.3, "z": 2.35})
    assert outer == pytest.approx({"x": 0.0, "y": 2.3, "z": 2.35})
    assert meeting == pytest.approx({"x": 0.0, "y": 1.3, "z": 2.35 - 3.0**0.5})


def test_a_line_is_the_redder_the_more_it_carries() -> None:
    def red(point: Point) -> float:
        return line_marker(WORKSPACE.ik(point), MECHANISM, 5.0)["colors"][0]["r"]

    assert LIGHT.r < red(Point(0.5, 1.2, 0.3)) < red(Point(0.5, 1.2, 1.5)) < red(Point(0.5, 1.2, 1.9)) < HEAVY.r


def test_lines_that_are_straight_are_as_red_as_can_be() -> None:
    colours = line_marker(Joints(0.0, 0.9, 0.9), MECHANISM, 5.0)["colors"]
    assert all(colour == pytest.approx(HEAVY._asdict()) for colour in colours)


@pytest.mark.parametrize(
    ("mode", "fault", "words"),
    [
        (Mode.NOT_HOMED, None, "not homed"),
        (Mode.HOMING, None, "homing"),
        (Mode.PAUSED, None, "paused"),
        (Mode.DISCONNECTED, None, "disconnected"),
        (Mode.FAULT, Notice(2301, "limit"), "fault 2301"),
    ],
)
def test_a_word_stands_above_a_robot_that_is_not_simply_ready(mode: Mode, fault: Notice | None, words: str) -> None:
    (word,) = state_markers(replace(standing(None), mode=mode, fault=fault), WORKSPACE)
    assert word["text"] == words
    assert word["pose"]["position"]["z"] > 2.35


def test_no_word_stands_above_one_that_is() -> None:
    for mode in (Mode.IDLE, Mode.MOVING):
        assert [one["ns"] for one in state_markers(replace(standing(), mode=mode), WORKSPACE)] == ["lines"]


def _told(array: Message | None) -> list[Message]:
    assert array is not None
    return array["markers"]
