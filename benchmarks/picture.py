"""How late the 3D picture of the dashboard shows a motion, compared with the mechanics of the twin.

The gripper moves down and up on straight lines. The page draws it with a matrix for each part; this code notes the
matrices of every picture, and finds that of the gripper by the distance that it covers. So the page needs no code for
the measurement. A picture counts as seen when the browser begins the next one.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from playwright.sync_api import Browser, Page

from maya_un.values import Point
from tests.dashboard.inside import Options, TwinService, twin_service

WAY = 0.2
"""Length of the line, on which the boom does not turn [m]."""

EVERY = 0.005
"""Time between two looks at the mechanics [s]."""

NOTE = """
(() => {
  const type = WebGL2RenderingContext.prototype, set = type.uniformMatrix4fv;
  const pictures = window.pictures = [];
  let matrices = null;
  type.uniformMatrix4fv = function (place, transpose, values, ...more) {
    if (matrices === null) {
      const picture = { at: 0, matrices: matrices = [] };
      requestAnimationFrame(() => { picture.at = performance.now(); pictures.push(picture); matrices = null; });
    }
    matrices.push([values[12], values[13], values[14]]);
    return set.call(this, place, transpose, values, ...more);
  };
})();
"""
"""Notes the translation of each matrix of a picture, and when the next picture began [ms]."""


class Track(NamedTuple):
    """How far the gripper was along its line (n,), from 0 to 1, at times (n,) [s, monotonic]."""

    times: NDArray[np.float64]
    shares: NDArray[np.float64]


@contextmanager
def standing() -> Iterator[TwinService]:
    """Run a homed robot at the speed of reality while the block runs; it takes a minute until the robot stands."""
    with tempfile.TemporaryDirectory() as folder, twin_service(Path(folder), Options(speed=1.0)) as robot:
        yield robot


def lateness(browser: Browser, robot: TwinService) -> float:
    """Return by how much nearly all pictures (95 %) are later than the mechanics at most [s]."""
    x, y, high = robot.gripper
    with browser.new_context(viewport={"width": 1440, "height": 900}) as context:
        page = context.new_page()
        page.add_init_script(NOTE)
        page.goto(robot.url)
        page.wait_for_selector("[data-drawn]")
        late = np.concatenate([_late(page, robot, Point(x, y, z)) for z in (high - WAY, high)])
    return float(np.percentile(late, 95))


def _late(page: Page, robot: TwinService, end: Point) -> NDArray[np.float64]:
    """Return how late the pictures of a move are (n,) [s]."""
    page.evaluate("pictures.length = 0")
    way = float(np.linalg.norm(np.subtract(end, robot.gripper)))
    truth = _moved(robot, end)
    page.wait_for_timeout(500)
    shown = _shown(page, _zero(page), way)
    inside = (shown.shares > 0.05) & (shown.shares < 0.95)
    if np.count_nonzero(inside) < 10:
        raise RuntimeError("the page drew too few pictures of the motion")
    return shown.times[inside] - np.interp(shown.shares[inside], truth.shares, truth.times)


def _moved(robot: TwinService, end: Point) -> Track:
    """Move the gripper on a line, and look at the mechanics until it is there."""
    begin = robot.gripper
    way = np.subtract(end, begin)
    robot.ask("POST /v1/tasks", {"command": "line", "target": list(end)})
    times, shares = [time.monotonic()], [0.0]
    until = times[0] + 60.0
    while shares[-1] < 0.999:
        if times[-1] > until:
            raise TimeoutError("the gripper did not reach its target")
        time.sleep(EVERY)
        gone = np.subtract(robot.gripper, begin)
        times.append(time.monotonic())
        shares.append(max(shares[-1], float(gone @ way / (way @ way))))
    return Track(np.array(times), np.array(shares))


def _zero(page: Page) -> float:
    """Return the time at which the clock of the page was 0 [s, monotonic]."""
    best: tuple[float, float] = (np.inf, 0.0)
    for _ in range(20):
        before = time.monotonic()
        there = float(page.evaluate("performance.now()")) / 1e3
        took = time.monotonic() - before
        best = min(best, (took, before + 0.5 * took - there))
    return best[1]


def _shown(page: Page, zero: float, way: float) -> Track:
    """Return the motion of the gripper in the pictures; `way` is the length of its line [m]."""
    pictures: list[dict[str, Any]] = page.evaluate("pictures")
    tracks = np.array([_followed(pictures, first) for first in pictures[0]["matrices"]])
    gone = np.linalg.norm(tracks - tracks[:, :1], axis=2)
    gripper = int(np.argmin(np.abs(gone[:, -1] - way)))
    times = zero + np.array([picture["at"] for picture in pictures]) / 1e3
    return Track(times, gone[gripper] / gone[gripper, -1])


def _followed(pictures: list[dict[str, Any]], place: list[float]) -> list[NDArray[np.float64]]:
    """Return where a part is in each picture. Its number changes: parts are drawn in the order of their distance."""
    found = [np.array(place)]
    for picture in pictures[1:]:
        places = np.array(picture["matrices"])
        found.append(places[np.argmin(np.linalg.norm(places - found[-1], axis=1))])
    return found
