"""A held jog ends with every way to lose the key: the robot itself says that it rests, and stays there."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest
from playwright.sync_api import WebSocketRoute, expect

from maya_un.errors import RequestLate
from maya_un.http.stream import requests
from tests.dashboard.services import SPEED, Service
from tests.dashboard.tabs import Tab


def key_of(robot: Service) -> str:
    """Return the key along y that has the longer way before it."""
    return f'[data-jog="y{"-" if robot.state["point"][1] > 1.15 else "+"}"]'


ATTEMPTS = 5

PRESSED = ".key.down"
"""The key that is held."""

ANOTHER_PAGE = "document.querySelector('.rail a[href$=queue]').click()"

ENDS: dict[str, Callable[[Tab], object]] = {
    "pointer up": lambda tab: tab.page.mouse.up(),
    "pointer cancelled": lambda tab: tab.page.dispatch_event(PRESSED, "pointercancel"),
    "capture lost": lambda tab: tab.page.dispatch_event(PRESSED, "lostpointercapture"),
    "window without focus": lambda tab: tab.page.evaluate("dispatchEvent(new Event('blur'))"),
    "tab hidden": lambda tab: tab.hide(),
    "another page of the dashboard": lambda tab: tab.page.evaluate(ANOTHER_PAGE),
    "another document": lambda tab: tab.page.goto("about:blank"),
    "tab closed": lambda tab: tab.page.close(),
    "browser closed": lambda tab: tab.page.context.close(),
    "stop": lambda tab: tab.page.keyboard.press("Space"),
    "pages reloaded": lambda tab: tab.page.reload(),
}


@contextmanager
def held(robot: Service, tab: Tab) -> Iterator[None]:
    """Hold a key of the jog while the block runs, and see that the robot moves; then it must rest."""
    robot.ask("POST /v1/speed", {"ratio": 0.1})
    key = key_of(robot)
    tab.until(f"document.querySelector('{key}:not([aria-disabled])')")
    box = tab.page.locator(key).bounding_box()
    assert box is not None
    tab.page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    tab.page.mouse.down()
    robot.until(lambda status: status["state"]["moving"])
    yield
    robot.require_rest()


def test_jog_goes_on_while_its_key_is_held(robot: Service, tab: Tab) -> None:
    """It lasts longer than one request. The service ends it early if a busy machine delays the next request."""
    lasted = False
    for _ in range(ATTEMPTS):
        with held(robot, tab):
            lasted = robot.at(robot.state["time"] + 0.8 * SPEED)["moving"]
            tab.page.mouse.up()
        if lasted:
            break
    assert lasted


@pytest.mark.parametrize("end", ENDS)
def test_jog_ends(robot: Service, tab: Tab, end: str) -> None:
    with held(robot, tab):
        ENDS[end](tab)


def test_jog_on_the_page_teach_ends_when_its_keys_are_folded(robot: Service, tab: Tab) -> None:
    tab.open("/teach")
    with held(robot, tab):
        tab.page.evaluate("document.querySelector('[data-drive-here] summary').click()")


def test_jog_by_a_key_ends_with_it_and_with_the_focus(robot: Service, tab: Tab) -> None:
    robot.ask("POST /v1/speed", {"ratio": 0.1})
    for end in (lambda: tab.page.keyboard.up("Enter"), lambda: tab.page.focus(".rail a")):
        key = key_of(robot)
        tab.until(f"document.querySelector('{key}:not([aria-disabled])')")
        tab.page.focus(key)
        tab.page.keyboard.down("Enter")
        robot.until(lambda status: status["state"]["moving"])
        end()
        robot.require_rest()
        tab.page.keyboard.up("Enter")


GAMEPAD = """(() => {
    const buttons = Array.from({ length: 17 }, () => ({ pressed: false }));
    window.pad = { id: 'pad', connected: true, mapping: 'standard', axes: [0, 0, 0, 0], buttons, seen: 0 };
    Object.defineProperty(pad, 'timestamp', { get: () => performance.now() });
    navigator.getGamepads = () => { pad.seen += 1; return [pad]; };
    window.sockets = [];
    window.presses = new Set();
    window.WebSocket = class extends WebSocket {
        constructor(...of) { super(...of); sockets.push(this); }
        send(text) { const { body } = JSON.parse(text); if (body?.hold) presses.add(body.press); super.send(text); }
    };
})()"""
"""A gamepad that is not dead, the connections of the page, to cut them, and the presses that it sends."""

INTERRUPTIONS: dict[str, Callable[[Tab], object]] = {
    "stop": lambda tab: tab.page.keyboard.press("Space"),
    "connection lost": lambda tab: tab.get("sockets.at(-1).close()"),
}


@pytest.mark.parametrize("interruption", INTERRUPTIONS)
def test_gamepad_moves_nothing_after_an_interruption_until_its_button_comes_up(
    robot: Service, bare_tab: Tab, interruption: str
) -> None:
    """The person still holds button and stick when the stop is done or the page is connected again."""
    robot.ask("POST /v1/speed", {"ratio": 0.1})
    bare_tab.page.add_init_script(GAMEPAD)
    bare_tab.open("/drive")
    way = -1 if "y+" in key_of(robot) else 1
    bare_tab.until("document.querySelector('[data-jog]:not([aria-disabled])')")
    enable = "(pressed) => { pad.buttons[4].pressed = pressed }"
    bare_tab.page.evaluate(enable, True)
    bare_tab.page.evaluate("(way) => { pad.axes[1] = way }", way)
    robot.until(lambda status: status["state"]["moving"])
    INTERRUPTIONS[interruption](bare_tab)
    bare_tab.until("document.querySelector('[data-gamepad]:not(.driving)')")
    robot.require_rest()
    bare_tab.until("document.querySelector('[data-jog]:not([aria-disabled])')")
    robot.at(robot.state["time"] + 0.8 * SPEED)
    assert bare_tab.get("presses.size") == 1
    bare_tab.page.evaluate(enable, False)
    bare_tab.until(f"pad.seen > {bare_tab.get('pad.seen') + 1}")
    at_rest = robot.state["counts"]
    bare_tab.page.evaluate(enable, True)
    bare_tab.until("presses.size === 2")
    robot.until(lambda status: status["state"]["counts"] != at_rest)  # on a busy machine, the motion may be over
    bare_tab.page.evaluate(enable, False)
    robot.require_rest()


class Link:
    """The network between a page and the service: while it is `stalled` it holds back what the page sends."""

    def __init__(self, tab: Tab) -> None:
        self.stalled = False
        self.held: list[str | bytes] = []
        self._server: WebSocketRoute | None = None
        tab.page.route_web_socket("**/v1/stream", self._connect)

    def recover(self) -> None:
        """Deliver what was held back."""
        assert self._server is not None
        self.stalled = False
        for message in self.held:
            self._server.send(message)

    def _connect(self, page: WebSocketRoute) -> None:
        self._server = server = page.connect_to_server()
        page.on_message(lambda message: self.held.append(message) if self.stalled else server.send(message))


def test_a_request_that_the_network_held_back_moves_nothing(
    robot: Service, bare_tab: Tab, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The person has given it up by then."""
    monkeypatch.setattr(requests, "MOST_DELAY", 0.2)
    link = Link(bare_tab)
    bare_tab.open("/drive")
    bare_tab.page.get_by_role("button", name="Step", exact=True).click()
    key = key_of(robot)
    bare_tab.until(f"document.querySelector('{key}:not([aria-disabled])')")
    before = robot.state["point"]
    link.stalled = True
    bare_tab.page.click(key)
    bare_tab.until(f"performance.now() > {bare_tab.get('performance.now()') + 300}")
    assert any('"/v1/jog"' in str(message) for message in link.held)
    link.recover()
    expect(bare_tab.page.get_by_role("alert")).to_contain_text(str(RequestLate.code))
    robot.require_rest()
    assert robot.state["point"] == before
    monkeypatch.undo()
    bare_tab.page.click(key)
    robot.until(lambda status: status["state"]["point"] != before)
