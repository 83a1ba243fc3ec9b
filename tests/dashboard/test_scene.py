"""The 3D view: what it draws of the robot's near future, and what can be moved in it."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tests.dashboard.services import Service
from tests.dashboard.tabs import SIZES, Tab
from tests.waiting import eventually

FIRST, SECOND = [0.5, 1.1, 0.5], [1.1, 0.5, 0.4]
"""Places of the gripper [m]; the way to the second is long."""

FAR = {"name": "there and back", "steps": [{"line": FIRST}, {"line": SECOND}]}

GHOST = "document.querySelector('[data-ghost]')"
DRAWN = "document.querySelector('[data-scene]')?.dataset.drawn"


def ghost_at(tab: Tab, point: list[float]) -> None:
    """Wait until the ghost stands at a place [m]."""
    eventually(lambda: pytest.approx(point, abs=1e-3) == ghost_of(tab), f"a ghost at {point}", 30.0, tab.text)


def ghost_of(tab: Tab) -> list[float]:
    """Return where the ghost stands [m], [] if there is none."""
    return [float(value) for value in (tab.get(f"{GHOST}?.dataset.ghost") or "").split(",") if value]


def picture(tab: Tab) -> bytes:
    """Return the 3D view as it is on the screen, without its buttons and words."""
    tab.page.add_style_tag(content="[data-scene] ~ * { visibility: hidden }")
    return tab.page.locator("[data-scene]").screenshot()


def test_the_ghost_of_the_next_step_goes_when_the_step_begins(robot: Service, tab_of: Callable[..., Tab]) -> None:
    tab = tab_of(robot, bypass_csp=True)
    tab.open("/")
    tab.until(DRAWN)
    assert tab.get(f"{GHOST} === null")
    robot.ask("POST /v1/tasks", {"command": "line", "target": SECOND})
    robot.until(lambda queue: queue["running"] is None, "/v1/queue")
    robot.ask("POST /v1/speed", {"ratio": 0.1})
    job = robot.ask("POST /v1/jobs", FAR)["id"]
    ghost_at(tab, SECOND)
    assert tab.get(f"{GHOST}.innerText") == "Next: line 1.1 0.5 0.4"
    robot.ask("POST /v1/queue/pause", {"when": "now"})
    robot.until(lambda status: status["state"]["mode"] == "paused" and not any(status["state"]["velocity"]))
    tab.until("document.querySelector('[data-state]').innerText.includes('Paused')")
    tab.page.click("[data-layer=trace]")  # it grows shorter by the time
    shown = picture(tab)
    tab.page.evaluate("document.querySelector('[data-layer=next]').click()")
    assert picture(tab) != shown
    assert tab.get(f"{GHOST} === null")
    tab.page.evaluate("document.querySelector('[data-layer=next]').click()")
    assert picture(tab) == shown
    robot.ask("POST /v1/speed", {"ratio": 1.0})
    robot.ask("POST /v1/queue/resume")
    robot.until(lambda report: report["steps"][1]["state"] != "queued", f"/v1/jobs/{job}")
    tab.until(f"{GHOST} === null")


def test_the_preview_of_a_motion_has_the_same_ghost_and_moves_nothing(
    robot: Service, tab_of: Callable[..., Tab]
) -> None:
    for name in ("desktop", "phone"):
        width, height = SIZES[name]
        tab = tab_of(robot, width=width, height=height)
        tab.open("/drive")
        if name == "phone":
            tab.page.click("[data-tab=goto]")
        before = robot.state["counts"]
        tab.page.click("[data-primitive=line]")
        target = SECOND if robot.state["point"][0] < 0.8 else FIRST
        for axis, value in zip("xyz", target, strict=True):
            tab.page.fill(f"[data-coordinate={axis}] input, input[data-coordinate={axis}]", f"{value * 1e3:.0f}")
        tab.page.click("[data-picture=space]")
        tab.until(DRAWN)
        tab.page.click("button[data-look], [data-look] button")
        ghost_at(tab, target)
        assert tab.get(f"{GHOST}.innerText") == "Preview"
        assert robot.state["counts"] == before
        tab.page.click("button[data-go], [data-go] button")
        tab.until(f"{GHOST} === null")
        robot.until(lambda queue: queue["running"] is None, "/v1/queue")
        assert robot.state["point"] == pytest.approx(target, abs=1e-3)
