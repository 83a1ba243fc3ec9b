"""Markers for rviz: everything once, then only changes; removed objects are deleted."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from maya_ros.graph import types
from maya_ros.graph.markers import HEAVY, LIGHT, MarkerCache, MarkerScene, line_markers, state_markers
from maya_ros.graph.protocol import Message
from maya_ros.graph.urdf import NAMES, LineDivision, describe, positions
from maya_un.config import Config
from maya_un.kinematics.zones import Box
from maya_un.values import Joints, Mode, Notice, Point, State
from tests.description import MACROS, Tree
from tests.fakes import state_of
from tests.strategies import WORKSPACE

MECHANISM = WORKSPACE.mechanism
CONFIG = Config()
HERE = WORKSPACE.ik(Point(0.5, 1.2, 0.5))
DELETE = 2


def standing(joints: Joints | None = HERE) -> State:
    return state_of(joints)


def names(array: Message | None) -> list[str]:
    assert array is not None
    types.conform("visualization_msgs/MarkerArray", array)
    return sorted({one["ns"] for one in array["markers"]})


def test_markers_are_published_once_and_then_on_change() -> None:
    drawing, view = MarkerCache(CONFIG), MarkerScene(standing(), WORKSPACE, parts={"bolt": Point(0.3, 1.0, 0.4)})
    assert names(drawing.update(view)) == ["lines", "parts", "stands", "workspace"]
    assert drawing.update(view) is None
    assert names(drawing.update(view, whole=True)) == ["lines", "parts", "stands", "workspace"]


def test_moving_robot_publishes_only_colours_of_the_lines() -> None:
    drawing, view = MarkerCache(CONFIG), MarkerScene(standing(), WORKSPACE, parts={"bolt": Point(0.3, 1.0, 0.4)})
    drawing.update(view)
    told = [
        drawing.update(replace(view, state=standing(WORKSPACE.ik(Point(0.5, 1.2, 0.5 + 0.001 * step)))))
        for step in range(1001)
    ]
    spoken = [array for array in told if array is not None]
    assert all(names(array) == ["lines"] for array in spoken)
    assert 0 < len(spoken) < 20


def test_a_path_that_has_been_gone_is_taken_away() -> None:
    drawing, view = (
        MarkerCache(CONFIG),
        MarkerScene(standing(), WORKSPACE, way=(Point(0.5, 1.2, 0.5), Point(0.6, 1.2, 0.5))),
    )
    assert "path" in names(drawing.update(view))
    array = drawing.update(replace(view, way=()))
    assert array is not None
    assert [(one["ns"], one["id"], one["action"]) for one in array["markers"]] == [
        ("path", 0, DELETE),
        ("path", 1, DELETE),
    ]


def test_changed_zones_or_strokes_redraw_the_scene() -> None:
    drawing, view = MarkerCache(CONFIG), MarkerScene(standing(), WORKSPACE)
    drawing.update(view)
    fenced = replace(view, zones=(Box("box", Point(0.1, 0.2, 0.0), Point(0.5, 1.0, 0.6)),))
    assert names(drawing.update(fenced)) == ["zones"]
    measured = replace(fenced, workspace=replace(WORKSPACE, line_b=(0.575, 2.2)))
    assert names(drawing.update(measured)) == ["workspace"]


def test_carried_part_is_published_when_picked_and_when_placed() -> None:
    drawing = MarkerCache(CONFIG)
    at = Point(0.5, 1.2, 0.52)
    view = MarkerScene(standing(), WORKSPACE, parts={"bolt": at})
    drawing.update(view)
    taken = replace(view, carried="bolt")
    (part,) = (one for one in _published(drawing.update(taken)) if one["ns"] == "parts")
    assert part["header"]["frame_id"] == "gripper"
    assert part["pose"]["position"]["z"] == pytest.approx(0.02)
    higher = replace(taken, state=standing(WORKSPACE.ik(Point(0.5, 1.2, 0.6))), parts={"bolt": Point(0.5, 1.2, 0.6)})
    assert drawing.update(higher) is None
    down = replace(higher, carried=None)
    (part,) = (one for one in _published(drawing.update(down)) if one["ns"] == "parts")
    assert part["header"]["frame_id"] == "base"


def test_lines_lie_on_the_pieces_of_the_description() -> None:
    description = Tree(describe(CONFIG, MACROS))
    there: dict[str, float] = dict(zip(NAMES, positions(MECHANISM, HERE), strict=True))
    b, c = (LineDivision.of(axis) for axis in (CONFIG.axes.b, CONFIG.axes.c))
    markers = list(line_markers(HERE, WORKSPACE, CONFIG))
    assert len(markers) == b.number + c.number
    ends = np.array([_ends(description, there, marker) for marker in markers])
    meeting = description.frame("hook", there)[:3, 3]
    anchors = [description.frame(f"line_{name}", there)[:3, 3] for name in "bc"]
    for anchor, own in zip(anchors, (ends[: b.number], ends[b.number :]), strict=True):
        assert own[0][0] == pytest.approx(anchor, abs=1e-6)
        assert own[-1][1] == pytest.approx(meeting, abs=1e-6)
        reached = np.linalg.norm(own - anchor, axis=2)
        assert np.all(np.diff(reached, axis=0) >= 0.0)
        assert np.all(reached[1:, 0] <= reached[:-1, 1] + 1e-9)


def test_a_line_is_the_redder_the_more_it_carries() -> None:
    def red(point: Point) -> float:
        return next(line_markers(WORKSPACE.ik(point), WORKSPACE, CONFIG))["color"]["r"]

    assert LIGHT.r < red(Point(0.5, 1.2, 0.3)) < red(Point(0.5, 1.2, 1.5)) < red(Point(0.5, 1.2, 1.9)) < HEAVY.r


def test_lines_that_are_straight_are_as_red_as_can_be() -> None:
    straight = list(line_markers(Joints(0.0, 0.9, 0.9), WORKSPACE, CONFIG))
    assert all(one["color"] == pytest.approx(HEAVY._asdict()) for one in straight)


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
def test_label_is_above_a_robot_that_is_not_ready(mode: Mode, fault: Notice | None, words: str) -> None:
    (word,) = state_markers(replace(standing(None), mode=mode, fault=fault), WORKSPACE, CONFIG)
    assert word["text"] == words
    assert word["pose"]["position"]["z"] > 2.35


def test_no_label_is_above_a_ready_robot() -> None:
    for mode in (Mode.IDLE, Mode.MOVING):
        assert {one["ns"] for one in state_markers(replace(standing(), mode=mode), WORKSPACE, CONFIG)} == {"lines"}


def _published(array: Message | None) -> list[Message]:
    assert array is not None
    return array["markers"]


def _ends(description: Tree, there: dict[str, float], cylinder: Message) -> Any:
    """Return both ends of a cylinder that lies along x of its frame, in the base frame [m]."""
    turned = [cylinder["pose"]["orientation"][part] for part in "xyzw"]
    assert turned == pytest.approx([0.0, 0.5**0.5, 0.0, 0.5**0.5])
    middle, half = cylinder["pose"]["position"]["x"], 0.5 * cylinder["scale"]["z"]
    frame = description.frame(cylinder["header"]["frame_id"], there)
    return [(frame @ np.array((middle + side * half, 0.0, 0.0, 1.0)))[:3] for side in (-1.0, 1.0)]


def test_a_marker_keeps_its_lock_to_the_frame_while_parts_are_carried_and_placed() -> None:
    """rviz ends itself where a marker that it has drawn is locked no longer."""
    drawing, view = (
        MarkerCache(CONFIG),
        MarkerScene(standing(), WORKSPACE, zones=(Box("fence", Point(0, 0, 0), Point(1, 1, 1)),)),
    )
    bolt, nut, there = Point(0.5, 1.2, 0.4), Point(0.3, 1.0, 0.4), Point(0.9, 0.9, 0.4)
    scenes: list[tuple[dict[str, Point], str | None]] = [
        ({"bolt": bolt, "nut": nut}, None),
        ({"bolt": bolt, "nut": nut}, "bolt"),
        ({"bolt": there, "nut": nut}, None),
        ({"nut": nut}, "nut"),  # another part has the number of the first
        ({"a": bolt, "nut": nut}, "nut"),
    ]
    locks: dict[tuple[str, int], set[bool]] = {}
    for parts, carried in scenes:
        told = drawing.update(replace(view, parts=parts, carried=carried)) or {"markers": []}
        for one in told["markers"]:
            if one["action"] != DELETE:
                locks.setdefault((one["ns"], one["id"]), set()).add(one["frame_locked"])
    assert {key for key, seen in locks.items() if len(seen) > 1} == set()
