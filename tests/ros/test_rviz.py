"""rviz on a display that nobody sees: its window comes up, and it lives while the twin moves and handles a part."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from maya_ros.graph.protocol import GoalStatus
from maya_un.values import Joints
from tests.ros.display import RVIZ_CRASH, Display, Picture
from tests.ros.launched_layers import DONE, HERE, THERE, LaunchedLayers, launched_layers
from tests.ros.test_model import QUICK, reached
from tests.ros.workspace import Workspace

BOOM = np.array((0.96, 0.69, 0.10))
"""The colour of the boom in the description."""

SCENE = np.s_[70:760, 370:1260]
"""The pixels of the scene, right of the list of displays."""

TABLE = (95, 95, 94)
"""The colour of the table's top as rviz draws it."""

DRAWN = 120.0
"""Longest time until rviz without a graphics card has drawn, on a busy machine [s]."""

STARTS = 3
"""Maximum number of launches until rviz has drawn the scene: it may crash before (`RVIZ_CRASH`)."""

pytestmark = pytest.mark.timeout(600)


@pytest.fixture(scope="module")
def display(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Display]:
    with Display(tmp_path_factory.mktemp("display")) as own:
        yield own


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory, workspace: Workspace, display: Display) -> Iterator[LaunchedLayers]:
    """All layers with rviz, which has drawn the scene."""
    for start in range(STARTS):
        folder = tmp_path_factory.mktemp("shown")
        with launched_layers(folder, workspace, environment=display.environment, core_debug=False, speed=QUICK) as up:
            up.ros.until(lambda: died(up) or "urdf.rviz - RViz" in display.windows(), "the window of rviz", DRAWN)
            up.ros.until(lambda: died(up) or has_table(display.picture()), "the table", DRAWN)
            if RVIZ_CRASH.search(up.launched.said) and start < STARTS - 1:
                continue
            assert not died(up)
            up.ros.until_nodes("/rviz", "/robot_state_publisher")
            yield up
            return


def has_table(picture: Picture) -> bool:
    """Tell whether the scene shows the table."""
    return bool((picture[SCENE] == TABLE).all(axis=2).sum() > 20_000)


def boom(picture: Picture) -> np.ndarray:
    """Return which pixels of the scene have the boom's colour, in whatever light."""
    scene = picture[SCENE]
    light = scene.max(axis=2)
    share = scene / np.maximum(light, 1)[:, :, None]
    return (light > 90) & (np.abs(share - BOOM / BOOM.max()).max(axis=2) < 0.08)


@pytest.mark.waits("4 s of homing at sixty times real speed, as rviz lives in real time")
def test_rviz_shows_the_model_and_it_moves_with_the_twin(shown: LaunchedLayers, display: Display) -> None:
    markers = shown.driver.subscribe("/maya_markers", "visualization_msgs/MarkerArray")
    markers.until(lambda array: any(one["ns"] == "workspace" for one in array["markers"]))
    assert not boom(display.picture()).any(), "what nobody knows is not drawn as if it were known"
    shown.home()
    shown.ros.until(lambda: boom(display.picture()).sum() > 2000, "the boom", DRAWN)
    reached(shown.driver, Joints(0.0, 1.7, 1.6))
    shown.ros.until(lambda: _middle(display.picture()) > 480, "the boom along +y, on the right", DRAWN)
    reached(shown.driver, Joints(1.9, 1.7, 1.6))
    shown.ros.until(lambda: _middle(display.picture()) < 380, "the boom beyond +x, on the left", DRAWN)
    assert "Exception" not in shown.launched.said


@pytest.mark.waits("about 3 s of two picks and two places at sixty times real speed, as rviz lives in real time")
def test_rviz_lives_when_a_known_part_is_picked_and_placed(shown: LaunchedLayers, display: Display) -> None:
    shown.ready()
    for place, back in ((HERE, THERE), (THERE, HERE)):
        assert shown.task("pick", place).ended() == (GoalStatus.SUCCEEDED, DONE)
        assert shown.twin()["carried"] == "part"
        assert shown.task("place", back).ended() == (GoalStatus.SUCCEEDED, DONE)
    reached(shown.driver, Joints(0.0, 1.7, 1.6))
    shown.ros.until(lambda: died(shown) or _middle(display.picture()) > 480, "the boom along +y, on the right", DRAWN)
    assert not died(shown)
    assert "/rviz" in shown.ros.nodes()


def died(shown: LaunchedLayers) -> bool:
    """Tell whether a program of the launch has died."""
    return "process has died" in shown.launched.said


def _middle(picture: Picture) -> float:
    """Return where the middle of the boom is, from left to right [pixels]."""
    return float(np.nonzero(boom(picture))[1].mean())
