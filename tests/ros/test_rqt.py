"""The dashboard in a real rqt on a small display, where rqt is installed.

$MAYA_RQT names the setup.bash of a workspace that holds rqt, where it is not on the PATH of the system.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest

from tests.ros.display import Display
from tests.ros.harness import places
from tests.ros.launched_layers import LaunchedLayers, launched_layers
from tests.ros.screen import RQT_DRIVER, Screen
from tests.ros.workspace import SYSTEM_PATH, Workspace, sourced

WORKSPACE = os.environ.get("MAYA_RQT")

PYTHON = Path("/usr/bin/python3")

SMALL = (1366, 768)
"""The display of a small laptop [pixels]."""

KEPT = "@maya_tools.perspective"
"""The name that rqt gives to a perspective that it has read from a file."""

pytestmark = [
    pytest.mark.system,
    pytest.mark.timeout(300),
    pytest.mark.skipif(
        WORKSPACE is None and shutil.which("rqt", path=SYSTEM_PATH) is None,
        reason="rqt is not installed, and $MAYA_RQT names no workspace with it",
    ),
]


@pytest.fixture(scope="module")
def display(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Display]:
    with Display(tmp_path_factory.mktemp("display"), *SMALL) as own:
        yield own


@pytest.fixture(scope="module")
def layers(tmp_path_factory: pytest.TempPathFactory, workspace: Workspace) -> Iterator[LaunchedLayers]:
    with launched_layers(tmp_path_factory.mktemp("layers"), workspace, custom_gui=False) as up:
        yield up


@pytest.fixture(scope="module")
def environment(
    tmp_path_factory: pytest.TempPathFactory, layers: LaunchedLayers, workspace: Workspace, display: Display
) -> Mapping[str, str]:
    """The environment of rqt on the graph of the layers."""
    more = [] if WORKSPACE is None else [Path(WORKSPACE)]
    found = sourced(workspace.place / "devel" / "setup.bash", *more)
    own_places = places(tmp_path_factory.mktemp("rqt"))
    return {**found, **own_places, **display.environment, "ROS_MASTER_URI": layers.ros.uri}


def rqt(environment: Mapping[str, str], log: Path, *arguments: str) -> Screen:
    return Screen(PYTHON, environment, log, *arguments, driver=RQT_DRIVER)


@pytest.mark.waits("4 s of homing at fifty times real speed, and the start of rqt twice")
def test_perspective_shows_the_dashboard_beside_rviz_and_is_kept(
    environment: Mapping[str, str], tmp_path: Path
) -> None:
    log = tmp_path / "rqt.log"
    with rqt(environment, log) as first:
        first.wait("home", enabled=True)
        first.click("home")
        first.wait("mode", "Ready")
        room, frame = first.ask("frame")
        assert frame[0] >= room[0]
        assert frame[1] >= room[1]
        assert frame[0] + frame[2] <= room[0] + room[2]
        assert frame[1] + frame[3] <= room[1] + room[3]
        (dashboard, (left, top, width, height)), (other, (left_of_rviz, top_of_rviz, *_)) = sorted(
            first.ask("docks").items()
        )
        assert dashboard == "maya_ui__Maya__1__MayaDashboard"
        assert other.startswith("rqt_rviz__RViz__1__")
        assert left + width <= left_of_rviz
        assert top == top_of_rviz
        assert height > 0
        assert _cut(first) == []
        assert first.ask("beyond") == 0
        first.ask("choose", name="language_choice", data="es")
        shown = first.ask("docks")
        first.ask("leave")
    with rqt(environment, log, "--perspective", KEPT) as again:
        again.wait("mode", "Listo")
        assert again.ask("docks") == shown
        assert _cut(again) == []
        assert again.ask("beyond") == 0
    said = log.read_text(encoding="utf-8")
    assert "could not load plugin" not in said
    assert "Traceback" not in said


def _cut(screen: Screen) -> list[str]:
    """Return the buttons of the header that are not whole within the dashboard."""
    return [name for name in ("stop", "pause", "speed_choice", "language_choice") if not screen.ask("whole", name=name)]
