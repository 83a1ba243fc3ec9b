"""Memory of the dashboard and of `maya up` while a page looks on for eight hours of the robot's clock.

The robot carries out long jobs, and the page Live shows it, with the 3D view and the plots. The clock of the twin
runs a hundred times as fast as real time. A leak would show between the first hour, when everything is loaded and
the trace and the plots are full, and the eighth. `maya up` itself grows by its log of events, about 1 kB each, until
the log is full (`maya_un.events.KEPT`), whether or not somebody looks on.
"""

from __future__ import annotations

from typing import NamedTuple

from bench_dashboard import CHROMIUM, FLAGS, TO_AND_FRO, asked
from bench_memory import resident
from harness import Case, Goal, measure, report
from job import pairs
from playwright.sync_api import CDPSession, Page, sync_playwright
from service import Service, service

HOUR = 3600.0
WARM, HOURS = 1, 8
SPEED = 100
MOST_STEPS = 1000
"""Of one job. Two jobs last for more than eight hours."""


class Memory(NamedTuple):
    """Memory of the page's objects, and of the service [bytes]."""

    heap: float
    served: float


def looked_on() -> dict[int, Memory]:
    """Return the memory after one hour and after eight."""
    found: dict[int, Memory] = {}
    with service("--speed", str(SPEED)) as running, sync_playwright() as tool:
        browser = tool.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        page = browser.new_page(viewport={"width": 1440, "height": 900})
        page.goto(running.url)
        page.wait_for_selector("[data-drawn]")
        inspector = page.context.new_cdp_session(page)
        _begin(running)
        for hours in (WARM, HOURS):
            _wait(running, page, hours * HOUR)
            found[hours] = _memory(inspector, running)
        browser.close()
    return found


def _begin(running: Service) -> None:
    """Home the robot, and have it carry out two jobs of as many steps as possible."""
    moves = TO_AND_FRO["steps"] * (MOST_STEPS // len(TO_AND_FRO["steps"]))
    for job in (pairs((MOST_STEPS - 1) // 2), {"name": "to and fro", "steps": moves}):
        asked(running.url, "POST", "/v1/jobs", job)


def _wait(running: Service, page: Page, until: float) -> None:
    """Wait for a time of the robot's clock [s], while the job runs."""
    while (status := asked(running.url, "GET", "/v1/status"))["state"]["time"] < until:
        if status["state"]["mode"] == "faulted":
            raise RuntimeError("the job failed")
        page.wait_for_timeout(1000)


def _memory(inspector: CDPSession, running: Service) -> Memory:
    inspector.send("HeapProfiler.collectGarbage")
    return Memory(float(inspector.send("Runtime.getHeapUsage")["usedSize"]), resident(running.pid))


def main() -> None:
    found = looked_on()
    first, last = f"after {WARM} hour", f"after {HOURS} hours"
    cases = []
    for name, kind, most in (("objects of the page", "heap", 2.0), ("memory of maya up", "served", 10.0)):
        before, after = (getattr(found[hours], kind) for hours in (WARM, HOURS))
        cases += [
            Case(f"{name} {first}", lambda value=before: value, "MB"),
            Case(f"{name} {last}", lambda value=after: value, "MB", Goal(most, f"{name} {first}", "over")),
        ]
    report(measure(cases, rounds=1))


if __name__ == "__main__":
    main()
