"""rviz on a display that nobody sees: its window comes up, the model is in it, and it moves when the twin moves."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from maya_un.values import Joints
from tests.ros.display import Display, Picture
from tests.ros.driven import Driver
from tests.ros.harness import Ros
from tests.ros.test_model import QUICK, homed, reached

BOOM = np.array((0.96, 0.69, 0.10))
"""The colour of the boom in the description."""


@pytest.fixture
def display(ros: Ros) -> Iterator[Display]:
    with Display(ros.folder) as own:
        yield own


def boom(picture: Picture) -> np.ndarray:
    """Return which pixels of the scene, right of the list of displays, have the boom's colour, in whatever light."""
    scene = picture[70:760, 370:1260]
    light = scene.max(axis=2)
    share = scene / np.maximum(light, 1)[:, :, None]
    return (light > 90) & (np.abs(share - BOOM / BOOM.max()).max(axis=2) < 0.08)


DRAWN = 120.0
"""rviz without a graphics card has drawn by then what it was told, on a machine that others use as well [s]."""


@pytest.mark.timeout(600)
def test_rviz_shows_the_model_and_it_moves_with_the_twin(ros: Ros, driver: Driver, display: Display) -> None:
    launch = ros.launch("maya_controller", "controller.launch", display.environment, core_debug=False, speed=QUICK)
    ros.until(lambda: "urdf.rviz - RViz" in display.windows(), "the window of rviz", DRAWN)
    ros.until_nodes("/rviz", "/hw_simulator", "/robot_state_publisher")
    markers = driver.subscribe("/maya_markers", "visualization_msgs/MarkerArray")
    markers.until(lambda array: any(one["ns"] == "workspace" for one in array["markers"]))
    assert not boom(display.picture()).any(), "what nobody knows is not drawn as if it were known"
    homed(driver)
    ros.until(lambda: boom(display.picture()).sum() > 2000, "the boom", DRAWN)
    reached(driver, Joints(0.0, 1.7, 1.6))
    ros.until(lambda: _middle(display.picture()) > 480, "the boom along +y, on the right", DRAWN)
    reached(driver, Joints(1.9, 1.7, 1.6))
    ros.until(lambda: _middle(display.picture()) < 380, "the boom beyond +x, on the left", DRAWN)
    assert "Exception" not in launch.said


def _middle(picture: Picture) -> float:
    """Return where the middle of the boom is, from left to right [pixels]."""
    return float(np.nonzero(boom(picture))[1].mean())
