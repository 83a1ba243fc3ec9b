"""The page Robots: a broker, two robots on twins, a supervisor; each of them dies under the page."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import pytest

from tests.calm import CALM_FILE
from tests.dashboard.services import Service, service
from tests.dashboard.tabs import LANGUAGES, SIZES, Tab
from tests.dashboard.test_access import Examiner
from tests.ports import free_port
from tests.system.brokers import Broker, broker
from tests.system.processes import Process
from tests.system.test_fleet import Robot

pytestmark = pytest.mark.timeout(300)

RAIL = "document.querySelector('.rail a[href=\"/robots\"]')"
TABS_FIT = (
    "((tabs) => tabs.scrollWidth <= tabs.clientWidth && tabs.getBoundingClientRect().right <= innerWidth)"
    "(document.querySelector('.tabs'))"
)

HTML = "<img src=x onerror=alert(1)>"


class Fleet(NamedTuple):
    """A broker, the robot MAYA whose dashboard is shown, and the robot ANA."""

    broker: Broker
    maya: Service
    ana: Robot

    def send(self, user: str, line: str) -> Process:
        """Have a supervisor send a step."""
        return Process(f"fleet send {line} --url {self.broker.url}", env={"MAYA_COMS_USER": user})


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Fleet]:
    folder = tmp_path_factory.mktemp("fleet")
    settings = f'{CALM_FILE.read_text()}[coms]\nserver_address = "http://localhost:{free_port()}"\n'
    options = f"--coms --rosbridge-port {free_port()} --journal memory --speed 100"
    with broker(folder) as one:
        ana = Robot("ANA", folder / "ana", one)
        try:
            ana.start()
            with service(folder, options, settings, MAYA_COMS_URL=one.url) as maya:
                yield Fleet(one, maya, ana)
        finally:
            ana.kill()


@pytest.fixture
def tab(fleet: Fleet, tab_of: Callable[..., Tab]) -> Tab:
    """Return the page Robots, with both robots at work on nothing."""
    found = tab_of(fleet.maya)
    found.open("/robots")
    for name in ("ANA", "MAYA"):
        found.until(state(name, "idle", "failed"))
    return found


def card(name: str) -> str:
    return f"document.querySelector('[data-robot={name}]')"


def state(name: str, *states: str) -> str:
    """Return the expression that holds while a robot is shown in one of the states."""
    return f"{list(states)}.includes({card(name)}?.dataset.robotState)"


def shown(name: str, text: str, part: str = "") -> str:
    """Return the expression that holds while a part of the card of a robot holds a text."""
    where = f"{card(name)}?.querySelector('{part}')" if part else card(name)
    return f"{where}?.innerText.includes('{text}')"


def test_a_robot_without_a_broker_says_so_and_has_no_place_for_robots(
    robot_service: Service, tab_of: Callable[..., Tab]
) -> None:
    tab = tab_of(robot_service)
    tab.open("/robots")
    tab.until("document.querySelector('[data-fleet=none]')")
    assert "connected to no broker" in tab.text()
    assert "maya up --coms" in tab.text()
    assert not tab.get(f"Boolean({RAIL})")


@pytest.mark.waits("2.4 s of homing at a hundred times real speed, as the broker lives in real time")
def test_a_step_appears_with_its_supervisor_and_its_result(fleet: Fleet, tab: Tab) -> None:
    assert tab.get(f"{RAIL}.getAttribute('aria-current')") == "page"
    home = fleet.send("anna", "ANA home")
    try:
        tab.until(state("ANA", "working"))
        tab.until(shown("ANA", "Home", "[data-current]"))
        tab.until(shown("ANA", "from anna", "[data-current]"))
        tab.until(state("MAYA", "idle"))
        assert home.end()[0] == 0
    finally:
        home.kill()
    tab.until(state("ANA", "idle"))
    tab.until(shown("ANA", "from anna", "[data-step=done]"))
    wrong = fleet.send(HTML, "ANA pick 9 9 0.4")
    assert wrong.end()[0] == 1
    tab.until(state("ANA", "failed"))
    tab.until(shown("ANA", "Pick 9000.0, 9000.0, 400.0 mm", "[data-step=failed]"))
    tab.until(shown("ANA", "cannot be reached", "[data-step=failed]"))
    tab.until(shown("ANA", HTML, "[data-step=failed]"))
    tab.page.click("[data-language] >> visible=true")
    tab.until(shown("ANA", "Falló el último paso"))
    tab.until("!" + shown("ANA", "cannot be reached", "[data-step=failed]"))


def test_a_killed_robot_is_gone_and_comes_back(fleet: Fleet, tab: Tab) -> None:
    fleet.ana.kill()
    tab.until(state("ANA", "offline", "lost"))
    tab.until(state("MAYA", "idle"))
    fleet.ana.start()
    tab.until(state("ANA", "idle", "failed"))


def test_the_death_of_the_broker_is_shown_and_its_return(fleet: Fleet, tab_of: Callable[..., Tab]) -> None:
    tab = tab_of(fleet.maya, bypass_csp=True)
    tab.open("/robots")
    examiner = Examiner(tab, "desktop")
    tab.until(state("ANA", "idle", "failed"))
    examiner.walk("fleet", [])
    fleet.broker.kill()
    tab.until("document.querySelector('[data-lost-broker]')?.innerText.includes('may still move')")
    assert tab.get(f"{card('ANA')}.classList.contains('old')")
    examiner.walk("fleet without its broker", [])
    fleet.broker.start()
    tab.until("!document.querySelector('[data-lost-broker]')")
    for name in ("ANA", "MAYA"):
        tab.until(state(name, "idle", "failed"))
    assert examiner.found == []


def test_the_fleet_fits_every_screen_in_both_languages(fleet: Fleet, tab: Tab) -> None:
    for language in LANGUAGES:
        tab.choose(language, "dark")
        tab.open("/robots")
        tab.until(state("ANA", "idle", "failed"))
        for size, (width, height) in SIZES.items():
            tab.page.set_viewport_size({"width": width, "height": height})
            assert tab.get("document.documentElement.scrollWidth <= innerWidth"), f"{language} {size}"
            assert tab.get(TABS_FIT), f"{language} {size}"


def test_the_fleet_is_sent_only_while_it_is_shown(fleet: Fleet, tab_of: Callable[..., Tab]) -> None:
    tab = tab_of(fleet.maya)
    frames: list[str] = []
    tab.page.on("websocket", lambda socket: socket.on("framereceived", lambda payload: frames.append(str(payload))))
    tab.open("/")
    assert fleet.send("anna", "MAYA gripper open").end()[0] == 0
    fleet.maya.until(lambda found: found["robots"][1]["last"][:1] and not found["robots"][1]["step"], "/v1/fleet")
    tab.page.click(".rail a[href='/robots']")
    tab.until(shown("MAYA", "Gripper open", "[data-step=done]"))
    sent = [frame for frame in frames if frame.startswith('{"type":"fleet"')]
    assert sent
    assert all("gripper" in frame for frame in sent), "it was sent before the page asked for it"
