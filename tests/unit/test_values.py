"""The few things that values compute, and that nobody can change them."""

from __future__ import annotations

import dataclasses

import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_un.values import Joints, Mode, Notice, Point, Progress


@pytest.mark.parametrize(
    ("elapsed", "duration", "fraction"),
    [(0.0, 8.0, 0.0), (2.0, 8.0, 0.25), (8.0, 8.0, 1.0), (9.0, 8.0, 1.0), (-0.1, 8.0, 0.0), (0.0, 0.0, 1.0)],
)
def test_progress_is_a_share_of_the_duration(elapsed: float, duration: float, fraction: float) -> None:
    assert Progress("lift", elapsed, duration).fraction == fraction


@given(elapsed=st.floats(-1e6, 1e6), duration=st.floats(-1.0, 1e6))
def test_progress_never_leaves_zero_to_one(elapsed: float, duration: float) -> None:
    assert 0.0 <= Progress("travel", elapsed, duration).fraction <= 1.0


def test_a_notice_cannot_be_changed() -> None:
    notice = Notice(2103, "not homed")
    with pytest.raises(dataclasses.FrozenInstanceError):
        notice.code = 0  # type: ignore[misc]


def test_joints_and_points_keep_the_order_of_the_axes() -> None:
    assert (tuple(Joints(a=1.0, b=2.0, c=3.0)), tuple(Point(x=1.0, y=2.0, z=3.0))) == ((1, 2, 3), (1, 2, 3))


def test_a_mode_reads_as_its_word_at_every_edge() -> None:
    assert f"{Mode.NOT_HOMED}" == "not_homed"
