"""The robot's description: read by xacro, a tree that follows the closed chain, with the configured lengths."""

from __future__ import annotations

import importlib
import sys
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_ros.graph.urdf import BASE, GRIPPER, INCLUDE, JAW_CLOSED, JAW_OPEN, NAMES, describe, dimensions, positions
from maya_un.config import Config
from maya_un.kinematics import Mechanism, Workspace
from maya_un.values import Joints
from tests.description import MACROS, Tree
from tests.strategies import configuration, reachable_joints

OTHER = configuration(
    geometry={"height": 2.6, "length": 2.0, "delta": 0.25, "gripper_height": 0.3},
    axes={
        "a": {**Config().axes.a.model_dump(), "minimum": -0.4, "maximum": 1.5},
        "b": {**Config().axes.b.model_dump(), "minimum": 0.4, "maximum": 2.4},
        "c": {**Config().axes.c.model_dump(), "minimum": 0.2, "maximum": 2.4},
    },
)


@cache
def _trees() -> tuple[tuple[Config, Tree], ...]:
    return tuple((config, Tree(describe(config, MACROS))) for config in (Config(), OTHER))


def tree(config: Config) -> Tree:
    return next(made for of, made in _trees() if of == config)


def put(config: Config, joints: Joints, jaw: float = JAW_OPEN) -> dict[str, float]:
    return dict(zip(NAMES, positions(Mechanism.of(config), joints, jaw), strict=True))


def test_lengths_in_the_macros_are_those_of_the_default_configuration() -> None:
    kept = (MACROS.parent / INCLUDE).read_text(encoding="utf-8")
    assert kept == dimensions(Config()), "run scripts/docs"


def test_the_macros_need_no_package_to_be_found_and_no_argument() -> None:
    for macro in MACROS.parent.glob("*.xacro"):
        assert "$(" not in macro.read_text(encoding="utf-8"), macro.name


@pytest.mark.parametrize("config", [Config(), OTHER], ids=["the manual's", "another"])
def test_exactly_the_published_joints_are_free(config: Config) -> None:
    assert tree(config).free == set(NAMES)


def test_it_is_one_tree_from_the_base() -> None:
    found = tree(Config())
    children = [joint.child for joint in found.joints]
    assert sorted([BASE, *children]) == sorted(found.links)
    assert {joint.parent for joint in found.joints} <= set(found.links)
    assert found.used == found.materials


@given(joints=reachable_joints())
def test_gripper_position_agrees_with_kinematics(joints: Joints) -> None:
    at = tree(Config()).frame(GRIPPER, put(Config(), joints))
    assert at[:3, 3] == pytest.approx(Mechanism.of(Config()).fk(joints), abs=1e-9)


@given(joints=reachable_joints(Workspace.of(OTHER)))
def test_so_it_is_on_a_machine_of_other_lengths(joints: Joints) -> None:
    at = tree(OTHER).frame(GRIPPER, put(OTHER, joints))
    assert at[:3, 3] == pytest.approx(Mechanism.of(OTHER).fk(joints), abs=1e-9)


@given(joints=reachable_joints())
def test_the_gripper_hangs_upright_and_looks_outward(joints: Joints) -> None:
    turned = tree(Config()).frame(GRIPPER, put(Config(), joints))[:3, :3]
    outward = (np.sin(joints.a), np.cos(joints.a), 0.0)
    assert turned[:, 2] == pytest.approx((0.0, 0.0, 1.0), abs=1e-9)
    assert turned[:, 0] == pytest.approx(outward, abs=1e-9)


@given(joints=reachable_joints())
def test_both_lines_end_in_the_same_place(joints: Joints) -> None:
    there = put(Config(), joints)
    inner, outer = (tree(Config()).frame(f"{line}_end", there)[:3, 3] for line in "bc")
    assert inner == pytest.approx(outer, abs=1e-9)


@pytest.mark.parametrize("config", [Config(), OTHER], ids=["the manual's", "another"])
@pytest.mark.parametrize("line", ["b", "c"])
@given(share=st.floats(0.0, 1.0))
def test_the_pieces_of_a_line_leave_no_gap_and_do_not_stick_out(config: Config, line: str, share: float) -> None:
    axis = getattr(config.axes, line)
    piece = float(dimensions(config).split(f'name="{line}_piece" value="')[1].partition('"')[0])
    length = axis.minimum + share * (axis.maximum - axis.minimum)
    slides = [joint.mimics for joint in tree(config).joints if joint.mimics and joint.mimics[0] == line]
    starts = [0.0, *(factor * length + offset for _, factor, offset in slides), length - piece]
    assert length < piece or all(0.0 <= after - before <= piece for before, after in pairwise(starts))
    assert starts[-1] + piece == pytest.approx(length)


def test_gripper_opens_to_both_sides_of_the_gripper_point() -> None:
    for jaw in (JAW_OPEN, JAW_CLOSED):
        there = put(Config(), Joints(0.5, 2.0, 2.0), jaw)
        middle = tree(Config()).frame(GRIPPER, there)
        sides = [np.linalg.inv(middle) @ tree(Config()).frame(f"jaw_{side}", there) for side in ("left", "right")]
        assert sides[0][:3, 3] == pytest.approx((0.0, jaw, 0.0))
        assert sides[1][:3, 3] == pytest.approx((0.0, -jaw, 0.0))


def test_the_boom_turns_clockwise_from_y() -> None:
    there = put(Config(), Joints(0.0, 2.0, 2.0))
    assert tree(Config()).frame("boom", there)[:3, 0] == pytest.approx((0.0, 1.0, 0.0), abs=1e-12)
    there["a"] = np.pi / 2.0
    assert tree(Config()).frame("boom", there)[:3, 0] == pytest.approx((1.0, 0.0, 0.0), abs=1e-12)


def test_without_xacro_it_says_which_library_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "xacro", None)
    with pytest.raises(ModuleNotFoundError, match="xacro"):
        describe(Config(), MACROS)
    monkeypatch.undo()
    assert importlib.import_module("xacro")
