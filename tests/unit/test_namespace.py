"""The default name of a robot in a ROS namespace."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_un.namespace import VARIABLE, robot_name

SEGMENT = st.text("abMAYAmaya2_-é", min_size=1, max_size=8)
SPACES = st.lists(SEGMENT, max_size=14).map("/".join)


def name_in(space: str) -> str:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(VARIABLE, space)
        return robot_name()


@pytest.mark.parametrize(
    ("space", "name"),
    [
        ("", "MAYA"), ("/", "MAYA"), ("maya2", "MAYA2"), ("/maya2/", "MAYA2"), ("Maya2", "mAYA2"), ("maya", "MAYA-"),
        ("MAYA", "maya"), ("a/b", "A-B"), ("a//b", "A-B"), ("a_b", "A_B"), ("é", "--e9--"),
    ],
)  # fmt: skip
def test_a_namespace_gives_a_name(space: str, name: str) -> None:
    assert name_in(space) == name


@given(SPACES, SPACES)
def test_two_namespaces_have_two_names(one: str, other: str) -> None:
    assert (name_in(one) == name_in(other)) is (one.strip("/") == other.strip("/"))


@given(SPACES)
def test_every_transport_can_carry_the_name(space: str) -> None:
    assert re.fullmatch(r"[A-Za-z0-9_-]{1,64}", name_in(space))
