"""Refusals of the planner before it asks for a proof: lines that the boom cannot follow."""

from __future__ import annotations

from math import cos, pi, sin

import pytest

from maya_un.config.files import parse
from maya_un.controller.planner import Planner
from maya_un.errors import PathRefused
from maya_un.kinematics import Mechanism, Workspace
from maya_un.motion import Path
from maya_un.values import Point


def at(angle: float) -> Point:
    return Point(1.2 * sin(angle), 1.2 * cos(angle), 0.6)


def test_line_across_the_end_of_a_whole_turn_is_refused() -> None:
    config = parse({"axes": {"a": {"minimum": 0.0, "maximum": 2.0 * pi}}})
    mechanism, workspace = Mechanism.of(config), Workspace.of(config)
    planner = Planner(config, mechanism)
    for half in (0.3, 0.05, 0.005):
        with pytest.raises(PathRefused, match="turn back"):
            planner.plan(workspace, Path.line(at(2.0 * pi - half), at(half)), 1.0)
        assert planner.plan(workspace, Path.line(at(pi - half), at(pi + half)), 1.0).move is not None
