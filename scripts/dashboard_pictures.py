"""Draws docs/images/dashboard: each page of the dashboard on phone, tablet and desktop, in both themes.

It needs Chromium, and looks at the real thing: a `maya up` with users, jobs, poses and a running job. The page Robots
is that of a robot at a broker with two others.
"""

from __future__ import annotations

import io
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import Browser, sync_playwright

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from maya_un.dashboard.pages import PAGES  # noqa: E402 - the path comes first
from tests.dashboard.services import Service, service  # noqa: E402
from tests.dashboard.tabs import BROWSER, FLAGS, SIZES, THEMES, Tab  # noqa: E402
from tests.ports import free_port  # noqa: E402
from tests.system.brokers import broker  # noqa: E402
from tests.system.processes import Process  # noqa: E402
from tests.system.processes import done as ended  # noqa: E402
from tests.system.test_fleet import Robot  # noqa: E402

IMAGES = ROOT / "docs" / "images" / "dashboard"

HEIGHT = 560
"""Height of every screen in a picture [px]."""

GAP = 16
"""Space around the screens [px]."""

SINGLE = {
    "live": ("/", "desktop", "dark"),
    "drive": ("/drive", "desktop", "dark"),
    "queue": ("/queue", "desktop", "dark"),
    "phone": ("/", "phone", "dark"),
    "robots": ("/robots", "desktop", "dark"),
}
"""Pictures of one screen, for README and the guide: docs/images/dashboard-NAME.png."""

POSES = {"tray": (0.30, 1.05, 0.7), "box": (1.05, 0.40, 0.7), "rest": (0.80, 0.80, 0.9)}
ZONE = {"kind": "box", "low": [0.55, 0.95, 0.0], "high": [0.75, 1.15, 0.55]}
STEPS = (
    ("luis", "ANA home"),
    ("luis", "ANA approach 0.5 1.1 0.5"),
    ("cell", "BETO home"),
    ("cell", "BETO pick 9 9 0.4"),
    ("luis", "ANA gripper open"),
)
"""Steps for other robots, with their supervisors."""

FAILS = {"name": "forgot to pick", "steps": [{"place": [0.50, 1.00]}]}


def main() -> int:
    """Draw all pictures."""
    IMAGES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which(BROWSER), args=list(FLAGS))
        with service(Path(folder), "--speed 20 --table examples/02_sort_grid.yaml") as robot, fleet() as of_fleet:
            prepare(robot)
            for path in PAGES:
                screens = dict(shots(browser, of_fleet if path == "/robots" else robot, path))
                sheet(list(screens.values())).save(IMAGES / f"{path.strip('/') or 'live'}.webp", quality=82, method=6)
                for name, (of, size, theme) in SINGLE.items():
                    if of == path:
                        screens[size, theme].save(ROOT / "docs" / "images" / f"dashboard-{name}.png", optimize=True)
                print(path)
        browser.close()
    return 0


def prepare(robot: Service) -> None:
    """Fill the robot's service with what people have there after a morning: users, places, jobs, a recording."""
    robot.until_homed()
    for name, point in POSES.items():
        done(robot, robot.ask("POST /v1/tasks", {"command": "approach", "target": list(point)}))
        robot.ask(f"PUT /v1/poses/{name}")
    robot.ask("PUT /v1/zones/column", ZONE)
    done(robot, submit(robot, "01_pick_and_place"))
    done(robot, robot.ask("POST /v1/jobs", FAILS))
    robot.ask("POST /v1/recordings")
    running = submit(robot, "02_sort_grid")
    submit(robot, "01_pick_and_place")
    robot.until(lambda report: report["steps"][3]["state"] != "queued", f"/v1/jobs/{running['id']}")
    robot.ask("POST /v1/speed", {"ratio": 0.1})  # the job runs until all pictures are drawn
    robot.token = robot.ask("POST /v1/users", {"name": "root", "role": "admin"})["token"]
    for name, role in (("ana", "operator"), ("visitor", "viewer"), ("luis", "student")):
        token = robot.ask("POST /v1/users", {"name": name, "role": role})["token"]
    root, robot.token = robot.token, token
    submit(robot, "05_pallet")
    robot.token = root


@contextmanager
def fleet() -> Iterator[Service]:
    """Run a robot at a broker with two others; two supervisors have sent steps, and one of these is under way."""
    with ExitStack() as running:
        folder = Path(running.enter_context(tempfile.TemporaryDirectory()))
        one = running.enter_context(broker(folder))
        for name in ("ANA", "BETO"):
            other = Robot(name, folder / name, one)
            running.callback(other.kill)
            other.start()
        settings = f'[coms]\nserver_address = "http://localhost:{free_port()}"\n'
        options = f"--coms --rosbridge-port {free_port()} --journal memory --speed 2"
        robot = running.enter_context(service(folder, options, settings, MAYA_COMS_URL=one.url))
        robot.until(lambda found: {one["state"] for one in found["robots"]} == {"idle"}, "/v1/fleet")
        for user, step in STEPS:
            ended(f"fleet send {step} --url {one.url}", env={"MAYA_COMS_USER": user})
        under_way = Process(f"fleet send MAYA home --url {one.url}", env={"MAYA_COMS_USER": "luis"})
        running.callback(under_way.kill)
        robot.until(lambda found: found["robots"][2]["state"] == "working", "/v1/fleet")
        yield robot


def submit(robot: Service, example: str) -> Any:
    """Submit an example, and return the service's answer."""
    text = next(one["text"] for one in robot.ask("GET /v1/examples") if one["name"] == example)
    return robot.ask("POST /v1/jobs", robot.ask("POST /v1/jobs/parse", {"text": text})["job"])


def done(robot: Service, job: Any) -> None:
    """Wait for the end of a job."""
    robot.until(lambda report: report["state"] in {"done", "failed"}, f"/v1/jobs/{job['id']}")


def shots(browser: Browser, robot: Service, path: str) -> Iterator[tuple[tuple[str, str], Image.Image]]:
    """Yield the screens of a page by size and theme."""
    for theme in THEMES:
        for size, (width, height) in SIZES.items():
            context = browser.new_context(viewport={"width": width, "height": height}, locale="en")
            context.add_init_script(
                f"sessionStorage['maya.token'] = {robot.token!r}; localStorage['maya.theme'] = {theme!r};"
                "localStorage['maya.tour'] = 'shown'"
            )
            tab = Tab(context, robot.url)
            tab.open(path)
            tab.page.wait_for_load_state("networkidle")
            tab.page.wait_for_timeout(1500)  # plots and the 3D view fill
            yield (size, theme), Image.open(io.BytesIO(tab.page.screenshot()))
            context.close()


def sheet(screens: list[Image.Image]) -> Image.Image:
    """Return one picture of all screens, a row for each theme."""
    small = [one.resize((round(one.width * HEIGHT / one.height), HEIGHT), Image.Resampling.LANCZOS) for one in screens]
    rows = [small[: len(SIZES)], small[len(SIZES) :]]
    width = max(sum(one.width + GAP for one in row) for row in rows) + GAP
    picture = Image.new("RGB", (width, len(rows) * (HEIGHT + GAP) + GAP), "#7f8790")
    for number, row in enumerate(rows):
        left = GAP
        for one in row:
            picture.paste(one, (left, GAP + number * (HEIGHT + GAP)))
            left += one.width + GAP
    return picture


if __name__ == "__main__":
    sys.exit(main())
