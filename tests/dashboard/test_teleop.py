"""A held jog ends with every way to lose the key: the robot itself says that it rests, and stays there."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from tests.dashboard.services import Service
from tests.dashboard.tabs import Tab


def key_of(robot: Service) -> str:
    """Return the key along y that has the longer way before it."""
    return f'[data-jog="y{"-" if robot.state["point"][1] > 1.15 else "+"}"]'


PRESSED = ".key.down"
"""The key that is held."""

HIDE = """
    Object.defineProperty(document, 'hidden', { configurable: true, get: () => true });
    document.dispatchEvent(new Event('visibilitychange'));
"""

ANOTHER_PAGE = "document.querySelector('.rail a[href$=queue]').click()"

ENDS: dict[str, Callable[[Tab], object]] = {
    "pointer up": lambda tab: tab.page.mouse.up(),
    "pointer cancelled": lambda tab: tab.page.dispatch_event(PRESSED, "pointercancel"),
    "capture lost": lambda tab: tab.page.dispatch_event(PRESSED, "lostpointercapture"),
    "window without focus": lambda tab: tab.page.evaluate("dispatchEvent(new Event('blur'))"),
    "tab hidden": lambda tab: tab.page.evaluate(HIDE),
    "another page of the dashboard": lambda tab: tab.page.evaluate(
        "document.querySelector('.rail a[href=\"/queue\"]').click()"
    ),
    "another document": lambda tab: tab.page.goto("about:blank"),
    "tab closed": lambda tab: tab.page.close(),
    "browser closed": lambda tab: tab.page.context.close(),
    "stop": lambda tab: tab.page.keyboard.press("Space"),
    "pages reloaded": lambda tab: tab.page.reload(),
}


@contextmanager
def held(robot: Service, tab: Tab) -> Iterator[None]:
    """Hold a key of the jog while the block runs; the robot moves when the block begins."""
    robot.ask("POST /v1/speed", {"ratio": 0.1})
    key = key_of(robot)
    tab.until(f"document.querySelector('{key}:not([aria-disabled])')")
    box = tab.page.locator(key).bounding_box()
    assert box is not None
    tab.page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    tab.page.mouse.down()
    require_motion(robot)
    yield
    robot.require_rest()


def require_motion(robot: Service) -> None:
    """Wait until the robot moves.

    A busy machine may repeat the request too late; the service then ends the jog, which is right.
    """
    robot.until(lambda status: status["state"]["moving"])


@pytest.mark.parametrize("end", ENDS)
def test_jog_ends(robot: Service, tab: Tab, end: str) -> None:
    with held(robot, tab):
        ENDS[end](tab)


def test_jog_by_a_key_ends_with_it_and_with_the_focus(robot: Service, tab: Tab) -> None:
    robot.ask("POST /v1/speed", {"ratio": 0.1})
    for end in (lambda: tab.page.keyboard.up("Enter"), lambda: tab.page.focus(".rail a")):
        key = key_of(robot)
        tab.until(f"document.querySelector('{key}:not([aria-disabled])')")
        tab.page.focus(key)
        tab.page.keyboard.down("Enter")
        require_motion(robot)
        end()
        robot.require_rest()
        tab.page.keyboard.up("Enter")
