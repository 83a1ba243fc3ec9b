"""Hypothesis strategies for all tests of mechanics and motion."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import cos, sin, sqrt

import numpy as np
from hypothesis import strategies as st

from maya_un.config import Config
from maya_un.kinematics import Workspace
from maya_un.motion.proof import prove
from maya_un.values import Joints, Point

WORKSPACE = Workspace.of(Config())
"""The workspace of the manual's machine."""


def configuration(**sections: Mapping[str, object]) -> Config:
    """Return the manual's configuration with some values changed, e.g. `geometry={"height": 2.2}`."""
    return Config.model_validate(sections)


@st.composite
def reachable_sections(draw: st.DrawFn, workspace: Workspace = WORKSPACE) -> tuple[float, float]:
    """Draw a reachable (u, h) [m], the edges of the section with them."""
    section = workspace.section
    u = draw(st.floats(0.0, section.width).filter(lambda at: section.depths(at) is not None))
    low, high = section.depths(u) or (0.0, 0.0)
    return u, low + draw(st.floats(0.0, 1.0)) * (high - low)


@st.composite
def reachable_points(draw: st.DrawFn, workspace: Workspace = WORKSPACE) -> Point:
    """Draw a gripper point of the workspace [m]."""
    u, h = draw(reachable_sections(workspace))
    a = draw(st.floats(*workspace.boom))
    d = workspace.mechanism.delta + u
    return Point(d * sin(a), d * cos(a), workspace.mechanism.reach_down - h)


@st.composite
def reachable_joints(draw: st.DrawFn, workspace: Workspace = WORKSPACE) -> Joints:
    """Draw joints of the workspace (rad, m, m)."""
    u, h = draw(reachable_sections(workspace))
    beyond = workspace.mechanism.width - u
    return Joints(draw(st.floats(*workspace.boom)), sqrt(h * h + u * u), sqrt(h * h + beyond * beyond))


@st.composite
def edge_joints(draw: st.DrawFn, workspace: Workspace = WORKSPACE) -> Joints:
    """Draw joints at the upper or lower edge of the section, where straight paths are at risk."""
    section = workspace.section
    u = draw(st.floats(0.01, 0.99).map(lambda share: share * section.width))
    low, high = section.depths(u) or (0.0, 0.0)
    into = draw(st.floats(1e-6, 0.05)) * (high - low)
    h = draw(st.sampled_from((low + into, high - into)))
    beyond = workspace.mechanism.width - u
    return Joints(draw(st.floats(*workspace.boom)), sqrt(h * h + u * u), sqrt(h * h + beyond * beyond))


def any_points() -> st.SearchStrategy[Point]:
    """Draw points in a box around the robot [m], most of them out of reach."""
    return st.builds(Point, st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-1.0, 3.0))


def paths(
    joints: st.SearchStrategy[Joints] | None = None, least: int = 2, most: int = 5
) -> st.SearchStrategy[list[Joints]]:
    """Draw waypoints of paths that are straight in the joints, from `least` to `most` of them."""
    drawn = reachable_joints() if joints is None else joints
    return st.lists(drawn, min_size=least, max_size=most)


def prove_ways(workspace: Workspace, *waypoints: Joints) -> None:
    """Prove the straight ways between waypoints, all of them asked for; raises as `prove` does."""
    prove(workspace, np.array(waypoints), range(1, len(waypoints) - 1))


def shares(count: int) -> Iterator[float]:
    """Yield `count` + 1 evenly spaced shares from 0 to 1."""
    return (step / count for step in range(count + 1))
