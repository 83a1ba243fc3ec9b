"""The pendant of `maya jog` as a person has it before them: keys in, the picture out, a twin behind it."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from math import nan
from pathlib import Path

import pytest

from scripts.tmux import Pane, pane
from tests.system.processes import MAYA, done, running

pytestmark = pytest.mark.system


@pytest.fixture(scope="module")
def places(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("pendant")


@pytest.fixture(scope="module")
def robot(places: Path) -> Iterator[None]:
    """Keep a twin running whose gripper waits above the table."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MAYA_RUNTIME_DIR", str(places / "run"))
        patch.setenv("XDG_CONFIG_HOME", str(places / "config"))
        with running("up --port 0 --speed 50") as up:
            up.until("maya home")
            assert done("home", 60.0)[0] == 0
            assert done("approach 0.8 0.8 0.6", 60.0)[0] == 0
            yield


@pytest.fixture
def pendant(robot: None, places: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Pane]:
    environment = {"MAYA_RUNTIME_DIR": str(places / "run"), "XDG_CONFIG_HOME": str(places / "config")}
    for name, place in environment.items():
        monkeypatch.setenv(name, place)
    with pane([MAYA, "jog"], width=90, height=20, environment=environment) as shown:
        shown.until("nearest limits:")
        yield shown


def value(picture: str, name: str) -> float:
    """Return a coordinate of the picture (mm or degrees); NaN while the screen is redrawn."""
    found = re.search(rf"\b{name} +(-?\d+\.\d+)", picture)
    return nan if found is None else float(found[1])


def idle_at(name: str, wanted: float, slack: float = 0.15) -> Callable[[str], bool]:
    """Tell of a picture whether the robot stands where a coordinate is what is wanted."""
    return lambda picture: "idle" in picture and abs(value(picture, name) - wanted) < slack


@pytest.mark.waits("5 s of homing at fifty times real speed and 1 s of motion, for a real screen")
def test_keys_move_by_the_step_that_was_chosen(pendant: Pane) -> None:
    x = value(pendant.picture(), "x")
    pendant.press("X")
    pendant.until_true(idle_at("x", x - 10.0), "x 10 mm back")
    pendant.press("1")
    pendant.until("± 1.0 mm / 0.10°")
    pendant.press("Right")
    pendant.until_true(idle_at("x", x - 9.0), "x 1 mm forth")
    r = value(pendant.picture(), "r")
    pendant.press("r")
    pendant.until_true(idle_at("r", r + 1.0), "r 1 mm out")
    a = value(pendant.picture(), "a")
    pendant.press("3", "a")
    pendant.until_true(idle_at("a", a + 5.0, 0.02), "the boom 5 degrees on")


def test_limit_ends_a_step_and_is_reported(pendant: Pane) -> None:
    assert done("approach 0.8 0.8 1.91", 60.0)[0] == 0
    pendant.until_true(idle_at("z", 2010.0, 1.0), "the robot below the ceiling")
    pendant.press("3", "PageUp")
    pendant.until("times the load")
    pendant.until_true(lambda picture: "nearest limits: tension" in picture, "the tension as the nearest limit")
    assert 2040.0 < value(pendant.picture(), "z") < 2060.0


def test_a_pose_is_taught_by_its_name(pendant: Pane) -> None:
    pendant.press("t")
    pendant.until("Name of this pose")
    pendant.enter("ledge")
    pendant.until("Taught ledge:")
    pendant.press("t")
    pendant.enter("ledge")
    pendant.until("exists already")
    pendant.press("t")
    pendant.type("x")
    pendant.press("Escape")
    pendant.until_true(lambda picture: "Name of this pose" not in picture, "no question any more")
    pendant.press("q")
    assert pendant.ended() == 0


def test_space_stops_any_motion(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MAYA_RUNTIME_DIR", str(tmp_path / "run"))
    place = {"MAYA_RUNTIME_DIR": str(tmp_path / "run")}
    with running("up --port 0 --speed 5") as up:
        up.until("maya home")
        with pane([MAYA, "jog"], width=90, height=20, environment=place) as shown, running("home") as home:
            shown.until("position unknown until homed")
            shown.until("homing")
            shown.press("Space")
            code, said = home.end()
            assert (code, "2201" in said) == (1, True)
            shown.until("not homed")
            shown.press("x")
            shown.until("Run `maya home` first")
            shown.press("C-c")
            assert shown.ended() == 130


def test_without_a_robot_there_is_no_pendant(tmp_path: Path) -> None:
    with pane([MAYA, "jog"], width=90, height=20, environment={"MAYA_RUNTIME_DIR": str(tmp_path)}) as shown:
        shown.until("error 1020")
        assert shown.ended() == 1
