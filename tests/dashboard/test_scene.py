"""The 3D view: what it draws of the robot's near future, and what can be moved in it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any
from urllib.parse import quote

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


PICTURES = """window.pictures = 0;
const clear = WebGL2RenderingContext.prototype.clear;
WebGL2RenderingContext.prototype.clear = function (...parts) { window.pictures += 1; return clear.apply(this, parts); };
"""
"""Counts the pictures of a page, as each one begins with a clear canvas."""

MESSAGES = 40
"""In so many messages of the stream, signals change and the robot does not."""


def test_a_robot_at_rest_is_drawn_once_a_second_for_its_trace(robot: Service, tab_of: Callable[..., Tab]) -> None:
    tab = tab_of(robot)
    tab.page.add_init_script(PICTURES)
    messages: list[int] = []
    tab.page.on("websocket", lambda socket: socket.on("framereceived", lambda _: messages.append(1)))
    tab.open("/")
    tab.until(DRAWN)

    def still() -> bool:
        before, heard = tab.get("[performance.now() / 1000, window.pictures]"), len(messages)
        eventually(lambda: tab.get("true") and len(messages) >= heard + MESSAGES, "messages of the stream")
        after = tab.get("[performance.now() / 1000, window.pictures]")
        return after[1] - before[1] <= after[0] - before[0] + 1.0

    eventually(still, "a picture that stays", told=tab.text)


NO_TRACE = """const later = window.setTimeout;
window.setTimeout = (work, time, ...rest) => (time === 1000 ? 0 : later(work, time, ...rest));
"""
"""Leaves out the pictures that a robot at rest gets for its trace."""


def test_a_robot_at_rest_is_drawn_again_when_the_browser_has_taken_the_picture_away(
    robot: Service, tab_of: Callable[..., Tab]
) -> None:
    tab = tab_of(robot)
    tab.page.add_init_script(PICTURES + NO_TRACE)
    tab.open("/")
    tab.until(DRAWN)
    canvas = "document.querySelector('[data-scene]').getContext('webgl2')"
    tab.get(f"(window.taken = {canvas}.getExtension('WEBGL_lose_context')).loseContext()")
    tab.until(f"{canvas}.isContextLost()")
    before = tab.get("window.pictures")
    tab.get("window.taken.restoreContext()")
    tab.until(f"window.pictures > {before}")


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


TAUGHT = {
    "poses": ("PUT /v1/poses/shelf?replace=true", {"point": FIRST}),
    "pallets": (
        "PUT /v1/pallets/tray?replace=true",
        {"corners": [[0.6, 0.9, 0.4], [0.9, 0.9, 0.4], [0.6, 0.6, 0.4], [0.9, 0.6, 0.4]], "rows": 3, "columns": 4},
    ),
    "zones": ("PUT /v1/zones/post", {"kind": "box", "low": [0.2, 1.2, 0.0], "high": [0.4, 1.4, 0.5]}),
}
"""Requests that teach something of each kind."""

PLACES: dict[str, Callable[[dict[str, Any]], list[list[float]]]] = {
    "poses": lambda pose: [pose["point"]],
    "pallets": lambda pallet: pallet["corners"],
    "zones": lambda zone: [zone["low"], zone["high"]],
}


@pytest.fixture
def taught(robot: Service) -> Iterator[Service]:
    """Return a robot to which one thing of each kind has been taught, and nothing else."""
    for kind in TAUGHT:
        for one in robot.ask(f"GET /v1/{kind}"):
            robot.ask(f"DELETE /v1/{kind}/{quote(one['name'], safe='')}")
    for request, body in TAUGHT.values():
        robot.ask(request, body)
    yield robot
    for request, _ in TAUGHT.values():
        robot.ask(request.replace("PUT", "DELETE").partition("?")[0])


def place_of(robot: Service, kind: str) -> list[list[float]]:
    """Return the points of what was taught [m]."""
    [only] = robot.ask(f"GET /v1/{kind}")
    return PLACES[kind](only)


def edit(tab: Tab, kind: str) -> None:
    """Open the form of what was taught, and wait for its grip in the 3D view."""
    tab.page.click(f"[data-tab={kind}]")
    tab.page.click("button[data-edit], [data-edit] button")
    tab.until("document.querySelector('[data-grip]')")


def centre(tab: Tab, selector: str) -> tuple[float, float]:
    """Return where the middle of an element is [px]."""
    box = tab.page.locator(selector).first.bounding_box()
    assert box is not None
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def drag(tab: Tab, axis: str) -> None:
    """Drag the arrow of an axis half its length further."""
    (x, y), (tip_x, tip_y) = centre(tab, "[data-axis] ~ [data-grip]"), centre(tab, f"[data-axis={axis}]")
    tab.page.mouse.move(tip_x, tip_y)
    tab.page.mouse.down()
    tab.page.mouse.move(tip_x + (tip_x - x) / 4, tip_y + (tip_y - y) / 4)
    tab.page.mouse.move(tip_x + (tip_x - x) / 2, tip_y + (tip_y - y) / 2)
    tab.page.mouse.up()


@pytest.mark.parametrize("kind", TAUGHT)
def test_what_is_taught_moves_in_3d_and_is_sent_when_it_is_saved(
    taught: Service, tab_of: Callable[..., Tab], kind: str
) -> None:
    tab = tab_of(taught)
    tab.open("/teach")
    before, counts = place_of(taught, kind), taught.state["counts"]
    edit(tab, kind)
    drag(tab, "x")
    tab.page.focus("[data-grip]")
    tab.page.keyboard.press("PageUp")
    tab.page.keyboard.press("Shift+ArrowDown")
    assert place_of(taught, kind) == before
    saving = f"[data-save-{kind.removesuffix('s')}]"
    tab.page.click(f"button{saving}, {saving} button")
    tab.until("!document.querySelector('[data-grip]')", "the form is closed")
    ways = [
        [new - old for old, new in zip(*pair, strict=True)] for pair in zip(before, place_of(taught, kind), strict=True)
    ]
    assert ways == [pytest.approx([ways[0][0], -0.001, 0.01], abs=1e-5)] * len(ways)
    assert 0.01 < ways[0][0] < 0.5
    assert taught.state["counts"] == counts


FIELDS = "['x', 'y', 'z'].map((axis) => Number(document.querySelector(`[data-place=${axis}] input`).value))"
"""The place of the pose that is edited, as its form shows it [mm]."""

BALL = "document.querySelector('[data-grip]').offsetTop"
"""Place of its ball in the 3D view [px]; the form above may move the whole view."""


def test_a_finger_drags_a_grip_and_scrolls_beside_it(taught: Service, tab_of: Callable[..., Tab]) -> None:
    tab = tab_of(taught, width=390, height=844, has_touch=True)
    tab.open("/teach")
    edit(tab, "poses")
    tab.until("document.querySelector('[data-reach]')", "the answer whether the robot gets there, which moves the view")
    tab.page.locator("[data-scene]").scroll_into_view_if_needed()
    finger = tab.page.context.new_cdp_session(tab.page)

    def swipe(x: float, y: float, up: float) -> None:
        for share, kind in ((0.0, "touchStart"), (0.5, "touchMove"), (1.0, "touchMove"), (1.0, "touchEnd")):
            points = [] if kind == "touchEnd" else [{"x": x, "y": y - share * up}]
            finger.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    scrolled = "scrollY"
    tab.page.evaluate(
        "addEventListener('pointerdown', (event) => { document.body.dataset.pointer = event.pointerType }, true)"
    )
    top, (x, y, z), ball = tab.get(scrolled), tab.get(FIELDS), tab.get(BALL)
    swipe(*centre(tab, "[data-axis=z]"), 40.0)
    tab.until(f"{FIELDS}[2] > {z}")
    assert tab.get("document.body.dataset.pointer") == "touch"
    assert tab.get(FIELDS)[:2] == [x, y]
    tab.until(f"Math.abs({ball} - {BALL} - 40) < 8", f"the ball follows the finger from {ball}")
    assert tab.get(scrolled) == top
    x, y = centre(tab, "[data-scene]")
    swipe(x, y - 100.0, -120.0)
    tab.until(f"{scrolled} < {top}")
