"""The cost of the dashboard: bytes and time until a page is seen, and the work of its viewers for `maya up`.

The viewers are clients of the stream with the subscriptions of a page. `maya up` is a process of its own on the twin,
in a long job. Its cost is CPU time, so what other processes take is left out. The browser is Debian's Chromium, which
draws in software here. A page without content, from the same server, is the baseline of the times in the browser.
"""

from __future__ import annotations

import asyncio
import json
import re
import subprocess
import tempfile
import time
import urllib.request
from collections.abc import Callable, Mapping
from math import inf
from pathlib import Path
from statistics import median
from typing import Any

from bench_memory import resident
from harness import Case, Figure, Goal, Sample, cpu_time, measure, report
from job import pairs
from picture import lateness, standing
from playwright.sync_api import Browser, sync_playwright
from service import MAYA, Service, service
from stream_client import Client

from maya_un.dashboard.pages import BROTLI, SITE

VIEWERS = 30
RATE = 10
SECONDS = 10.0
"""Duration of one sample of the viewers' cost [s]. It covers several steps of the job, because their costs differ."""

CHROMIUM = "/usr/bin/chromium-headless-shell"
FLAGS = ["--no-sandbox", "--enable-unsafe-swiftshader", "--disable-background-networking"]
TO_AND_FRO: dict[str, Any] = {
    "name": "to and fro",
    "steps": [{"move": place} for place in ([0.5, 1.4, 1.5], [1.2, 1.5, 1.4])],
}
"""A job that ends where it begins, so it takes as long each time."""

SUBSCRIPTION = {
    "type": "subscribe",
    "state": {"rate": RATE},
    "queue": True,
    "motion": True,
    "signals": True,
    "can": True,
}


def packed(path: Path) -> int:
    """Return the bytes of a file as they travel to a browser on this computer or over https."""
    brotli = path.with_name(path.name + BROTLI)
    return (brotli if brotli.exists() else path).stat().st_size


def first_bytes() -> float:
    """Return the bytes of the document, and of the scripts and styles that it names."""
    document = SITE / "index.html"
    named = re.findall(r'"\./(assets/[^"]+\.(?:js|css))"', document.read_text(encoding="utf-8"))
    return float(packed(document) + sum(packed(SITE / name) for name in named))


def all_bytes() -> float:
    """Return the bytes of all scripts and styles."""
    return float(sum(packed(path) for path in SITE.rglob("*") if path.suffix in {".js", ".css", ".html"}))


class Viewers:
    """Clients of the stream in this process; `stalled` ones never read."""

    def __init__(self, url: str) -> None:
        self._loop = asyncio.new_event_loop()
        self._port = int(url.rpartition(":")[2])
        self._open: list[asyncio.Transport] = []

    def cost(self, pid: int, count: int, stalled: int = 0) -> float:
        """Return the CPU time that the service uses in a second while `count` clients look on [s]."""
        self._loop.run_until_complete(self._enter(count, stalled))
        before, began = cpu_time(pid), time.monotonic()
        self._loop.run_until_complete(asyncio.sleep(SECONDS))
        found = (cpu_time(pid) - before) / (time.monotonic() - began)
        self.leave()
        return found

    def stop(self, url: str, count: int, stalled: int) -> float:
        """Return the time until the service answers a stop while clients look on [s]."""
        self._loop.run_until_complete(self._enter(count, stalled))
        self._loop.run_until_complete(asyncio.sleep(0.5))
        request = urllib.request.Request(f"{url}/v1/stop", method="POST")
        began = time.monotonic()
        with urllib.request.urlopen(request, timeout=30.0) as answer:
            answer.read()
        found = time.monotonic() - began
        self.leave()
        return found

    def lag(self, url: str, count: int, stalled: int) -> float:
        """Return how late the robot's loop does what is due, 99 % of the times at most, while clients look on [s]."""
        self._loop.run_until_complete(self._enter(count, stalled))
        before = lags(url)
        self._loop.run_until_complete(asyncio.sleep(SECONDS))
        found = quantile({bound: number - before[bound] for bound, number in lags(url).items()}, 0.99)
        self.leave()
        return found

    def duration(self, url: str, count: int, stalled: int) -> float:
        """Return the time that a job takes on the robot's clock while clients look on [s]."""
        self._loop.run_until_complete(self._enter(count, stalled))
        number = asked(url, "POST", "/v1/jobs", TO_AND_FRO)["id"]
        while (report := asked(url, "GET", f"/v1/jobs/{number}"))["state"] != "done":
            self._loop.run_until_complete(asyncio.sleep(0.1))
        self.leave()
        return float(report["duration"])

    def leave(self) -> None:
        """Close all connections."""
        for transport in self._open:
            transport.abort()
        self._open.clear()
        self._loop.run_until_complete(asyncio.sleep(0.1))

    async def _enter(self, count: int, stalled: int) -> None:
        for number in range(count + stalled):
            transport, client = await self._loop.create_connection(
                lambda: Client(SUBSCRIPTION, lambda _text, _now: None), "127.0.0.1", self._port
            )
            await client.open.wait()
            if number >= count:
                transport.pause_reading()
            self._open.append(transport)


def asked(url: str, method: str, path: str, body: object = None) -> dict[str, Any]:
    """Return the answer to a request."""
    data = None if body is None else json.dumps(body).encode()
    request = urllib.request.Request(f"{url}{path}", data, {"Content-Type": "application/json"}, method=method)
    with urllib.request.urlopen(request, timeout=30.0) as answer:
        found: dict[str, Any] = json.load(answer)
    return found


def lags(url: str) -> dict[float, float]:
    """Return how often the robot's loop was late by at most each bound [s], as `maya up` counts it."""
    with urllib.request.urlopen(f"{url}/metrics", timeout=30.0) as answer:
        text = answer.read().decode()
    return {float(bound): float(number) for bound, number in re.findall(r'lag_seconds_bucket{le="(.+)"} (\S+)', text)}


def quantile(counts: Mapping[float, float], share: float) -> float:
    """Return the value that this share of the values does not exceed, linear within a bucket, as Prometheus does."""
    wanted = share * counts[inf]
    low, below = 0.0, 0.0
    for bound, number in sorted(counts.items()):
        if number >= wanted:
            return low if bound == inf else low + (bound - low) * (wanted - below) / (number - below)
        low, below = bound, number
    return low


def painted(browser: Browser, url: str) -> float:
    """Return the time from the request of a page to its first content on the screen [s]."""
    with browser.new_context() as context:
        page = context.new_page()
        page.goto(url)
        seen = "performance.getEntriesByName('first-contentful-paint')[0]?.startTime ?? 0"
        return _polled(lambda: float(page.evaluate(seen))) / 1e3


def drawn(browser: Browser, url: str) -> float:
    """Return the time from the request of the page Live to the robot on the screen [s]."""
    with browser.new_context(viewport={"width": 1440, "height": 900}) as context:
        page = context.new_page()
        began = time.monotonic()
        page.goto(url)
        _polled(lambda: float(page.evaluate("document.querySelector('[data-drawn]') ? 1 : 0")))
        return time.monotonic() - began


def _polled(look: Callable[[], float]) -> float:
    until = time.monotonic() + 30.0
    while time.monotonic() < until:
        if found := look():
            return found
        time.sleep(0.005)
    raise TimeoutError("the page did not appear")


def files_in_memory() -> float:
    """Return by how much a service grows when all files of the pages are requested [bytes]."""
    with service() as fresh:
        before = resident(fresh.pid)
        for path in SITE.rglob("*.*"):
            if path.name == "index.html" or path.suffix == BROTLI:
                continue
            with urllib.request.urlopen(f"{fresh.url}/{path.relative_to(SITE)}", timeout=30.0) as answer:
                answer.read()
        return resident(fresh.pid) - before


def busy(running: Service) -> None:
    """Have the robot home, and begin a job that lasts longer than the benchmark."""
    subprocess.run([MAYA, "home"], env=running.environment, capture_output=True, check=True)
    with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
        json.dump(pairs(200), file)
        file.flush()
        subprocess.run([MAYA, "job", "submit", file.name], env=running.environment, capture_output=True, check=True)


def resumed(running: Service, sample: Sample) -> Sample:
    """Return a sample that is taken in motion: the queue continues after the stop before."""

    def taken() -> float:
        subprocess.run([MAYA, "queue", "resume"], env=running.environment, capture_output=True, check=False)
        return sample()

    return taken


def seen() -> list[Figure]:
    """Return the figures of the browser. Its event loop ends with it, so viewers of this process come later."""
    with service("--speed", "1") as quiet, standing() as robot, sync_playwright() as tool:
        browser = tool.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        cases = [
            Case("bytes before the first paint", first_bytes, "MB", Goal(0.08)),
            Case("bytes of all scripts and styles", all_bytes, "MB", Goal(0.3)),
            Case("first paint of an empty page", lambda: painted(browser, f"{quiet.url}/maya.svg"), "ms"),
            Case("first paint of the dashboard", lambda: painted(browser, quiet.url), "ms", Goal(600.0)),
            Case("robot drawn", lambda: drawn(browser, quiet.url), "ms", Goal(1500.0)),
            Case(
                "picture of a motion behind the mechanics (95 %)", lambda: lateness(browser, robot), "ms", Goal(100.0)
            ),
        ]
        figures = measure(cases, rounds=5, by=median)
        browser.close()
    return figures


def served() -> list[Figure]:
    """Return the figures of the service."""
    with service("--speed", "5") as running:
        busy(running)
        viewers, url, pid = Viewers(running.url), running.url, running.pid
        nobody = "maya up in a job, nobody looks, CPU a second"
        alone = "lateness of the robot's loop (99 %), nobody looks"
        cases = [
            Case(nobody, lambda: viewers.cost(pid, 0), "ms"),
            Case("one viewer", lambda: viewers.cost(pid, 1), "ms", Goal(10.0, nobody, "over")),
            Case(f"{VIEWERS} viewers", lambda: viewers.cost(pid, VIEWERS), "ms", Goal(50.0, nobody, "over")),
            Case(alone, lambda: viewers.lag(url, 0, 0), "ms"),
            Case(
                f"lateness of the robot's loop (99 %), {VIEWERS} viewers and 5 that do not read",
                lambda: viewers.lag(url, VIEWERS, 5),
                "ms",
                Goal(1.0, alone, "over"),
            ),
            Case("stop, nobody looks", resumed(running, lambda: viewers.stop(url, 0, 0)), "ms"),
            Case(
                f"stop, {VIEWERS} viewers and 5 that do not read",
                resumed(running, lambda: viewers.stop(url, VIEWERS, 5)),
                "ms",
                Goal(10.0, "stop, nobody looks", "over"),
            ),
            Case(
                f"stop, {VIEWERS} viewers and 5 that do not read, by itself",
                resumed(running, lambda: viewers.stop(url, VIEWERS, 5)),
                "ms",
                Goal(50.0),
            ),
            Case("memory that the files of the pages take", files_in_memory, "MB", Goal(5.0)),
        ]
        return measure(cases, rounds=5, by=median)


def worked() -> list[Figure]:
    """Return how long the robot works."""
    with service("--speed", "20") as running:
        subprocess.run([MAYA, "home"], env=running.environment, capture_output=True, check=True)
        viewers, url = Viewers(running.url), running.url
        nobody = "job on the twin's clock, nobody looks"
        cases = [
            Case(nobody, lambda: viewers.duration(url, 0, 0), "s"),
            Case(
                f"job, {VIEWERS} viewers and 5 that do not read",
                lambda: viewers.duration(url, VIEWERS, 5),
                "s",
                Goal(1.01, nobody),
            ),
        ]
        return measure(cases, rounds=5, by=median)


def main() -> None:
    report([*seen(), *served(), *worked()])


if __name__ == "__main__":
    main()
