"""Draws docs/images/rviz.png and docs/images/rviz-gripper.png: what rviz shows while the twin carries a part.

It needs what the tests in tests/ros need, and looks at the real thing: a roscore, the launch file, rviz on a display
that nobody sees.
"""

from __future__ import annotations

import re
import sys
import tempfile
from pathlib import Path
from threading import Event

from PIL import Image

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from maya_ros.graph.conversions import path_to_message  # noqa: E402
from maya_un.config import Config  # noqa: E402 - the path comes first
from maya_un.kinematics import Mechanism  # noqa: E402
from maya_un.motion.path import Path as Way  # noqa: E402
from maya_un.values import Point  # noqa: E402
from tests.ros.display import Display  # noqa: E402
from tests.ros.driver_client import Driver, Goal  # noqa: E402
from tests.ros.harness import Ros  # noqa: E402
from tests.ros.workspace import provide  # noqa: E402

IMAGES = ROOT / "docs" / "images"
VIEW = ROOT / "ros" / "maya_controller" / "rviz" / "urdf.rviz"
PARTS = {"bolt": [0.45, 1.25, 0.4], "nut": [0.95, 1.15, 0.4], "plate": [1.35, 0.75, 0.4], "rod": [1.5, 0.1, 0.4]}
TAKEN = Point(0.45, 1.25, 0.4)
ABOVE = TAKEN._replace(z=0.75)
AWAY = Point(1.45, -0.35, 0.9)
CLOSE = {
    "Distance": "0.95",
    "Pitch": "0.22",
    "X": f"{ABOVE.x}",
    "Y": f"{ABOVE.y}",
    "Z": f"{ABOVE.z + 0.07}",
}
SCENE = (500, 62, 1140, 602)
"""The part of the close picture that is kept: left, upper, right and lower edge [pixels]."""

SPEED = 20
PATIENCE = 4.0
"""rviz has drawn everything this long after it was told [s]."""


def main() -> int:
    """Draw both pictures."""
    workspace = provide()
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        with Display(place) as display, Ros(place, workspace) as ros:
            ros.set_param("/maya/parts", PARTS)
            ros.launch("maya_controller", "controller.launch", speed=SPEED)
            driver = ros.driver()
            _take(driver)
            for name, config in (("rviz-gripper.png", _closer(place)), ("rviz.png", VIEW)):
                shown = ros.start("rviz", "-d", str(config), environment=display.environment)
                ros.until(lambda: any("RViz" in title for title in display.windows()), "the window of rviz")
                Event().wait(PATIENCE)
                if config is VIEW:
                    _under_way(driver)
                _keep(display, name)
                shown.close()
    return 0


def _take(driver: Driver) -> None:
    """Home, and lift a part."""
    driver.do("/home", "maya_controller/Home").ended()
    driver.call("/gripper", {"data": True})
    mechanism = Mechanism.of(Config())
    for point in (ABOVE, TAKEN):
        _done(driver.do("/move", "maya_controller/Move", mechanism.ik(point)._asdict()))
    driver.call("/gripper", {"data": False})
    _done(driver.do("/move", "maya_controller/Move", mechanism.ik(ABOVE)._asdict()))


def _done(goal: Goal) -> None:
    outcome, result = goal.ended()
    if outcome != 3:
        raise SystemExit(str(result))


def _under_way(driver: Driver) -> None:
    """Set out on a path, and return when some of it is done and rviz has drawn what goes on, slowly, from there."""
    mechanism = Mechanism.of(Config())
    way = Way.joints(mechanism.ik(ABOVE), mechanism.ik(Point(1.2, 0.9, 1.1)), mechanism.ik(AWAY), blend=0.1)
    goal = driver.do("/controller/follow", "maya_controller/Follow", {"trajectory": path_to_message(way)})
    goal.feedback.until(lambda message: message["progress"] > 0.12)
    driver.publish("/controller/speed", "std_msgs/Float64", {"data": 0.02})
    Event().wait(PATIENCE)


def _closer(folder: Path) -> Path:
    """Return the configuration of rviz with the camera near the gripper, and no names over it."""
    text = VIEW.read_text(encoding="utf-8")
    camera, rest = text.partition("  Views:\n")[::2]
    for key, value in CLOSE.items():
        rest = re.sub(rf"^(\s+{key}: ).*$", rf"\g<1>{value}", rest, count=1, flags=re.MULTILINE)
    place = folder / "closer.rviz"
    place.write_text(camera.replace("Show Names: true", "Show Names: false") + "  Views:\n" + rest, encoding="utf-8")
    return place


def _keep(display: Display, name: str) -> None:
    picture = Image.fromarray(display.picture())
    if name != "rviz.png":
        picture = picture.crop(SCENE)
    picture.save(IMAGES / name, optimize=True)
    print(f"docs/images/{name}")


if __name__ == "__main__":
    sys.exit(main())
