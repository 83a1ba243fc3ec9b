"""The picture of a camera on the page Live: a stream, snapshots, and a camera that does not answer."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from statistics import fmean

import pytest
from PIL import Image

from tests.dashboard.cameras import CameraServer, camera_server
from tests.dashboard.services import Service, service
from tests.dashboard.tabs import Tab
from tests.waiting import eventually

SIGHT = "document.querySelector('[data-camera]')?.dataset.sight"
PERIOD = 0.5
"""The shortest time between two requests for snapshots [s] (web/src/pages/live/camera.ts)."""

RENEWAL, PATIENCE = 10.0, 5.0
"""Time after which a stream is requested again, and after which a camera does not answer [s] (the same file)."""

SELDOM = 0.5
"""Between two screenshots, which are expensive [s]."""

COLOURS = {(255, 0, 0): "red", (0, 128, 0): "green", (0, 0, 255): "blue"}


@pytest.fixture
def camera() -> Iterator[CameraServer]:
    """Return a camera."""
    with camera_server() as made:
        yield made


@pytest.fixture
def filmed(camera: CameraServer, tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Service]:
    """Return a service with this camera, whose kind is the parameter."""
    settings = f'[camera]\nurl = "{camera.url}/{request.param}"\nkind = "{request.param}"\n'
    with service(tmp_path, "--journal memory", settings) as made:
        yield made


@pytest.fixture
def watching(filmed: Service, camera: CameraServer, tab_of: Callable[..., Tab]) -> Tab:
    """Return a tab that shows it."""
    tab = tab_of(filmed)
    tab.page.clock.install()
    tab.allow(camera.url)
    tab.open("/")
    return tab


def colour_of(tab: Tab) -> str:
    """Return the colour in the middle of the camera's picture."""
    shot = Image.open(io.BytesIO(tab.page.locator("[data-camera]").screenshot())).convert("RGB")
    pixel = shot.getpixel((shot.width // 2, shot.height // 2))
    assert isinstance(pixel, tuple)
    red, green, blue, *_ = pixel
    return COLOURS.get((red, green, blue), str(pixel))


def shows(tab: Tab, colour: str, step: float = 0.0) -> None:
    """Wait until the camera's picture has a colour; before each look the page's clock goes forward by `step` [s]."""

    def shown() -> bool:
        if step:
            tab.jump(step)
        return colour_of(tab) == colour

    eventually(shown, f"a {colour} picture", 30.0, lambda: colour_of(tab) + tab.text(), pause=SELDOM)


@pytest.mark.parametrize("filmed", ["stream"], indirect=True)
def test_a_stream_that_hangs_holds_nothing_and_comes_back(filmed: Service, camera: CameraServer, watching: Tab) -> None:
    shows(watching, "red")
    assert watching.get(SIGHT) == "live"
    camera.colour = "green"
    shows(watching, "green")
    camera.mood = "hanging"
    watching.jump(RENEWAL)
    watching.jump(PATIENCE)
    watching.until(f"{SIGHT} === 'silent'")
    assert "has not answered since" in watching.page.locator("[data-camera]").inner_text()
    assert colour_of(watching) not in COLOURS.values()  # the last picture turns grey
    assert watching.get("document.readyState") == "complete"
    watching.page.click("button.stop >> visible=true")
    watching.until("document.querySelector('[data-stopped]').innerText.includes('at rest')")
    camera.mood, camera.colour = "well", "blue"
    shows(watching, "blue", PATIENCE)
    assert watching.get(SIGHT) == "live"
    eventually(lambda: camera.open == 1, "one request at a time")
    camera.mood = "ending"
    eventually(lambda: camera.open == 0, "the end of the stream")
    camera.mood, camera.colour = "well", "red"
    shows(watching, "red", PATIENCE)
    watching.hide()
    eventually(lambda: camera.open == 0, "a hidden page has no stream")
    watching.hide(False)
    eventually(lambda: camera.open == 1, "a page in view has one")
    watching.page.click(".rail a[href='/queue']")
    eventually(lambda: camera.open == 0, "another page has none")


@pytest.mark.parametrize("filmed", ["snapshot"], indirect=True)
def test_a_snapshot_is_requested_after_the_answer_to_the_one_before(
    filmed: Service, camera: CameraServer, watching: Tab
) -> None:
    shows(watching, "red")
    camera.colour = "green"
    shows(watching, "green")
    camera.delay = 2 * PERIOD
    before = len(camera.asked)
    eventually(lambda: len(camera.asked) > before + 3, "four requests")
    assert camera.most == 1
    waits = [later - one for one, later in pairwise(camera.asked)]
    assert fmean(waits) > 0.9 * PERIOD  # a busy machine takes single requests late
    assert fmean(waits[before:]) > 0.9 * camera.delay
    watching.hide()
    eventually(lambda: camera.open == 0, "the end of the last request")
    asked = len(camera.asked)
    filmed.at(filmed.state["time"] + 2.0)
    assert len(camera.asked) == asked
    camera.delay, camera.colour = 0.0, "blue"
    watching.hide(False)
    shows(watching, "blue")


def test_without_a_camera_there_is_no_place_for_one(bare_tab: Tab) -> None:
    bare_tab.open("/")
    bare_tab.until("document.querySelector('[data-scene]')?.dataset.drawn")
    assert bare_tab.get("document.querySelector('[data-camera]') === null")
