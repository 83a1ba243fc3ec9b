"""The planner: refusals before it asks for a proof, and what it remembers."""

from __future__ import annotations

from math import cos, pi, sin

import pytest

from maya_un.config import Config
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
        with pytest.raises(PathRefused, match="turn all the way back"):
            planner.plan(workspace, Path.line(at(2.0 * pi - half), at(half)), 1.0)
        assert planner.plan(workspace, Path.line(at(pi - half), at(pi + half)), 1.0).move is not None


def test_the_motions_of_a_long_job_are_not_planned_again_when_they_begin() -> None:
    config = Config()
    planner, workspace = Planner(config, Mechanism.of(config)), Workspace.of(config)
    paths = [Path.line(at(0.5), at(0.6 + 1e-4 * number)) for number in range(600)]  # the legs of 400 tasks
    checked = [planner.plan(workspace, path, 1.0) for path in paths]
    assert all(planner.plan(workspace, path, 1.0) is plan for path, plan in zip(paths, checked, strict=True))
