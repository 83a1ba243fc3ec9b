"""A robot with its dashboard, and a browser, which all tests of this folder share."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser, sync_playwright

from tests.dashboard.furnished import furnished_robot
from tests.dashboard.inside import Options, TwinService, twin_service
from tests.dashboard.services import PASSWORD, Service
from tests.dashboard.tabs import BROWSER, FLAGS, NO_WORKER, VIOLATIONS, Tab


def no_browser() -> str:
    """Return why no browser can be started here, "" if one can."""
    told = os.environ.get("MAYA_NO_BROWSER", "")
    return told or ("" if shutil.which(BROWSER) else f"{BROWSER} is not installed; ./test installs it")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Skip tests that need a browser if there is none."""
    reason = no_browser()
    for item in items:
        if reason and "chromium" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.skip(reason=f"no browser: {reason}"))


@pytest.fixture(scope="package")
def robot_service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TwinService]:
    """Return a service with a homed robot."""
    with twin_service(tmp_path_factory.mktemp("dashboard")) as made:
        yield made


@pytest.fixture(scope="package")
def furnished(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TwinService]:
    """Return a robot that has some of everything; no test changes it."""
    with furnished_robot(tmp_path_factory.mktemp("furnished"), jobs=10, poses=2) as made:
        yield made


@pytest.fixture
def robot(robot_service: TwinService) -> Iterator[TwinService]:
    """Return that service with its robot homed and at rest; whatever the test leaves is stopped."""
    robot_service.until_homed()
    yield robot_service
    robot_service.ask("POST /v1/stop")
    robot_service.ask("POST /v1/speed", {"ratio": 1.0})
    robot_service.until(lambda queue: queue["running"] is None, "/v1/queue")


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    """Return a browser. Playwright's event loop runs as long as it does, and no other test may find one running."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which(BROWSER), args=list(FLAGS))
        yield browser
        browser.close()


def new_tab(
    browser: Browser, of: Service, *, width: int = 1440, height: int = 900, worker: bool = False, **options: Any
) -> Tab:
    """Open a tab for a service, in a context of its own.

    Only with `worker` does the page load all its files at once and keep them, as it does over https.
    """
    known: dict[str, Any] = {
        "viewport": {"width": width, "height": height},
        "device_scale_factor": 0.5,  # a quarter of the pixels to draw in software
        "locale": "en",
        **options,
    }
    context = browser.new_context(**known)
    context.add_init_script(VIOLATIONS)
    if not worker:
        context.add_init_script(NO_WORKER)
    return Tab(context, of.url)


@pytest.fixture
def tab_of(chromium: Browser) -> Iterator[Callable[..., Tab]]:
    """Return what opens a tab, in a context of its own, for a service; none may have a problem at the end."""
    tabs: list[Tab] = []

    def opened(of: Service, **options: Any) -> Tab:
        tabs.append(new_tab(chromium, of, **options))
        return tabs[-1]

    yield opened
    for tab in tabs:
        tab.page.context.close()
    assert [problem for tab in tabs for problem in tab.problems] == []


@pytest.fixture(scope="module")
def used_tabs() -> list[Tab]:
    """Return the tabs that tests of a module have used one after another; the last one may be open."""
    return []


@pytest.fixture
def bare_tab(robot: Service, chromium: Browser, used_tabs: list[Tab]) -> Iterator[Tab]:
    """Return a tab for that robot, in which the test opens a page. The context of the test before is used again."""
    if not used_tabs or used_tabs[-1].page.is_closed():
        used_tabs.append(new_tab(chromium, robot))
    made = used_tabs[-1]
    made.problems.clear()
    made.page.set_viewport_size({"width": 1440, "height": 900})
    yield made
    assert made.problems == []
    if made.page.url.startswith(robot.url) and not made.page.is_closed():
        made.page.evaluate("localStorage.clear()")


@pytest.fixture
def tab(bare_tab: Tab) -> Tab:
    """Return that tab with the page Drive, which needs less computing than the 3D view of the page Live."""
    bare_tab.open("/drive")
    return bare_tab


@pytest.fixture(scope="package")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TwinService]:
    """Return a service with users: `root` is asked for whatever the tests ask."""
    options = Options(stored=True, addresses=("https://robot.example:4134",))
    with twin_service(tmp_path_factory.mktemp("guarded"), options) as made:
        made.token = made.ask("POST /v1/users", {"name": "root", "role": "admin"})["token"]
        made.ask("PATCH /v1/users/root", {"password": PASSWORD})
        yield made
