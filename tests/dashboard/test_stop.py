"""Stop from the page, in every way; the robot itself says whether it stopped."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from tests.dashboard.services import Service
from tests.dashboard.tabs import SIZES, Tab, stop_in_sight
from tests.waiting import eventually

STOP = "button.stop >> visible=true"

ELSEWHERE = {
    "button": ".rail button",
    "link": ".rail a",
    "slider": "input[type=range]",
}
"""Places of the focus in which Space is stop, too."""


@contextmanager
def stopped(robot: Service) -> Iterator[int]:
    """Begin a motion, which the block must stop; yield the number of the newest event before."""
    robot.begin_motion()
    since = robot.newest
    yield since
    robot.until_event("stopped", since)
    robot.require_rest()


def await_motion(tab: Tab) -> None:
    """Wait until the page knows that the robot moves."""
    tab.until("document.querySelector('[data-state].busy')")


def stops(robot: Service, since: int) -> list[Any]:
    """Return the stops after an event."""
    return [event for event in robot.ask(f"GET /v1/events?since={since}") if event["kind"] == "stopped"]


def escape_twice(robot: Service, tab: Tab, since: int) -> None:
    """Press Escape twice, and again if this machine was too busy for two presses within the time of the page."""

    def pressed() -> bool:
        tab.page.keyboard.press("Escape")
        tab.page.keyboard.press("Escape")
        return bool(stops(robot, since))

    eventually(pressed, "a stop by Escape")


@pytest.mark.parametrize("size", SIZES)
def test_button(robot: Service, tab: Tab, size: str) -> None:
    width, height = SIZES[size]
    tab.page.set_viewport_size({"width": width, "height": height})
    with stopped(robot):
        tab.page.click(STOP)
    tab.until("document.querySelector('[data-stopped]').innerText.includes('at rest')")


@pytest.mark.parametrize("focus", ELSEWHERE)
def test_space_stops_and_presses_nothing(robot: Service, tab: Tab, focus: str) -> None:
    tab.page.evaluate("addEventListener('click', () => { window.pressed = true })")
    with stopped(robot):
        await_motion(tab)
        tab.page.focus(ELSEWHERE[focus])
        tab.page.keyboard.press("Space")
    assert tab.get("[window.pressed ?? false, document.documentElement.dataset.theme]") == [False, "dark"]


AT_ONCE = """([key]) => {
    const press = (key) => new KeyboardEvent('keydown', { key, bubbles: true, cancelable: true });
    key.dispatchEvent(press('Enter'));
    key.dispatchEvent(press(' '));
}"""
"""Begin a jog by a key, and press Space before any state of the robot can have arrived."""


def test_space_stops_a_jog_before_the_page_knows_that_the_robot_moves(robot: Service, tab: Tab) -> None:
    tab.open("/drive")
    tab.until("document.querySelector('[data-jog]:not([aria-disabled])')")
    since = robot.newest
    tab.page.locator("[data-jog]").first.evaluate_all(AT_ONCE)
    robot.until_event("stopped", since)
    robot.require_rest()


def test_space_in_a_text_field_is_a_space(robot: Service, tab: Tab) -> None:
    tab.open("/history")
    field = tab.page.locator("main input:is([type=search], [type=text], :not([type]))").first
    with stopped(robot):
        await_motion(tab)
        since = robot.newest
        field.focus()
        tab.page.keyboard.type("a b")
        assert field.input_value() == "a b"
        assert robot.state["moving"]
        assert not stops(robot, since)
        escape_twice(robot, tab, since)


def test_space_at_rest_presses_the_button_that_has_the_focus(robot: Service, tab: Tab) -> None:
    since = robot.newest
    tab.page.focus(".rail button[lang]")
    tab.page.keyboard.press("Space")
    tab.until("document.documentElement.lang === 'es'")
    assert not stops(robot, since)


def test_escape_twice(robot: Service, tab: Tab) -> None:
    with stopped(robot) as since:
        tab.page.keyboard.press("Escape")
        assert not stops(robot, since)
        escape_twice(robot, tab, since)


def test_with_all_connections_of_the_browser_busy(robot: Service, tab: Tab) -> None:
    robot.begin_motion()
    since = robot.newest
    tab.page.evaluate(
        """(since) => {
            window.waiting = 0;
            const hang = async (number) => {
                window.waiting += 1;
                for (;;) await fetch(`/v1/events?since=${since + 1000}&wait=${20 + number}`).then((got) => got.text());
            };
            for (let number = 0; number < 6; number += 1) void hang(number);
            window.seventh = 'waits';
            fetch('/v1/health').then(() => { window.seventh = 'answered' });
        }""",
        since,
    )
    tab.until("window.waiting === 6")
    tab.page.click(STOP)
    robot.until_event("stopped", since)
    assert tab.get("window.seventh") == "waits"
    robot.require_rest()
    tab.until("document.querySelector('[data-stopped]').innerText.includes('at rest')")
    assert tab.get("window.seventh") == "waits"


def test_from_another_browser(robot: Service, tab: Tab, tab_of: Callable[..., Tab]) -> None:
    other = tab_of(robot, width=390, height=844)
    other.open("/queue")
    with stopped(robot):
        other.page.click(STOP)
    tab.until("document.querySelector('[data-state].ok')")


def test_over_a_dialogue_and_without_a_token(guarded: Service, tab_of: Callable[..., Tab]) -> None:
    """On this machine stop needs no token, even while homing; the dialogue to sign in does not cover it."""
    for name, (width, height) in SIZES.items():
        tab = tab_of(guarded, width=width, height=height)
        tab.page.goto(guarded.url)
        tab.until("document.querySelector('dialog[open]')", name)
        stop_in_sight(tab)
        since = guarded.newest
        guarded.ask("POST /v1/tasks", {"command": "home"})
        guarded.until(lambda status: status["state"]["moving"])
        if name == "phone":
            tab.page.locator(".dock button.stop").click()
        elif name == "tablet":
            tab.page.keyboard.press("Escape")
            tab.page.keyboard.press("Escape")
        else:
            box = tab.page.locator(STOP).first.bounding_box()
            assert box is not None
            tab.page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        guarded.until_event("stopped", since)
        guarded.until(lambda status: not status["state"]["moving"])
        guarded.until(lambda queue: queue["running"] is None, "/v1/queue")
