"""Opens the dashboard: in rqt with its perspective if rqt is installed, else in a separate window."""

from __future__ import annotations

import ast
import json
import os
import shutil
import signal
import sys
import threading
from pathlib import Path
from typing import Callable

from maya_ui.resources import perspective

NODE = "maya_dashboard"
"""The name of the node."""

LOOK = 0.5
"""Time between two checks for a master [s]."""

RVIZ = "rqt_rviz/RViz"
"""The name of rviz among rqt's plugins."""

FARTHER = 1.4
"""How much farther away rviz looks beside the dashboard, so that the whole boom is in view."""

NO_DISPLAY = "maya_dashboard: there is no display, so no dashboard is opened; everything else runs."


HELP = """usage: maya_ui.py [--window] [ARGUMENT ...]

The dashboard of Maya: in rqt, or in a window of its own with --window and where there is no rqt.
Other arguments are those of rqt (rqt --help) or, in a window of its own, of Qt. It needs a display."""


def main(arguments: list[str] | None = None) -> int:
    """Open the dashboard and return the exit code when it is closed; without a display, print one line."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    if {"-h", "--help"} & set(given):
        print(HELP)
        return 0
    if not _has_display():
        print(NO_DISPLAY, file=sys.stderr)
        return 0
    rqt = shutil.which("rqt")
    if rqt is not None and "--window" not in given:
        os.execv(rqt, [rqt, "--perspective-file", str(perspective_here()), *given])
    return window(given)


def perspective_here() -> Path:
    """Return the perspective for this computer, written into ROS's home folder.

    It leaves out plugins that are not installed: rqt would wait for them, and restore neither layout nor settings. In a
    namespace it leaves out rviz, which would show the Maya without a namespace, as rqt remaps no names of C++ plugins.
    """
    import rospkg  # noqa: PLC0415 - only rqt needs it

    packages = rospkg.RosPack()
    folder = Path(rospkg.get_ros_home(), "maya_ui")
    folder.mkdir(parents=True, exist_ok=True)
    kept = json.loads(perspective().read_text(encoding="utf-8"))
    manager = kept["groups"]["pluginmanager"]
    running = manager["keys"]["running-plugins"]
    plugins = ast.literal_eval(running["repr"])
    installed = {plugin: instances for plugin, instances in plugins.items() if plugin.split("/")[0] in packages.list()}
    if os.environ.get("ROS_NAMESPACE", "").strip("/"):
        installed.pop(RVIZ, None)
    running["repr"] = repr(installed)
    shown = _narrowed(Path(packages.get_path("maya_controller"), "rviz", "urdf.rviz"), folder)
    keys = {"rviz_config_file": {"type": "repr", "repr": repr(str(shown))}}
    manager["groups"]["plugin__rqt_rviz__RViz__1"] = {"groups": {"plugin": {"keys": keys}}}
    here = folder / perspective().name
    here.write_text(json.dumps(kept, indent=2), encoding="utf-8")
    return here


def _narrowed(settings: Path, folder: Path) -> Path:
    """Write settings of rviz for the room beside the dashboard into a folder: no panels, and a more distant view."""
    import yaml  # noqa: PLC0415

    shown = yaml.safe_load(settings.read_text(encoding="utf-8"))
    shown["Panels"] = []  # to hide them is not enough: rviz in rqt shows them again
    shown["Visualization Manager"]["Views"]["Current"]["Distance"] *= FARTHER
    beside = folder / settings.name
    beside.write_text(yaml.safe_dump(shown, sort_keys=False), encoding="utf-8")
    return beside


def window(arguments: list[str]) -> int:
    """Show the dashboard in a separate window until it is closed, or ROS ends the node."""
    from python_qt_binding.QtCore import QSettings, QTimer  # noqa: PLC0415 - without a display there may be no Qt
    from python_qt_binding.QtWidgets import QApplication  # noqa: PLC0415

    from maya_ui.dashboard import Dashboard  # noqa: PLC0415
    from maya_ui.ui_controller import UiController  # noqa: PLC0415

    app = QApplication([NODE, *arguments])
    settings = QSettings("maya-un", "dashboard")
    dashboard = Dashboard(UiController(lambda: join(app.quit)), str(settings.value("language", preferred())))
    dashboard.language_chosen.connect(lambda language: settings.setValue("language", language))
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: app.quit())
    awake = QTimer()  # Python handles its signals only when it runs
    awake.timeout.connect(lambda: None)
    awake.start(200)
    dashboard.resize(dashboard.sizeHint())
    dashboard.show()
    code = app.exec_()
    dashboard.shut_down()
    return int(code)


def join(leave: Callable[[], object]) -> None:
    """Make this program a node once a master answers; `leave` is called when ROS ends the node."""
    import rospy  # noqa: PLC0415 - it takes long to load, and the window must open before

    from maya_ui.layers import master_answers  # noqa: PLC0415

    wait = threading.Event()
    while not master_answers(NODE):
        wait.wait(LOOK)
    rospy.init_node(NODE, disable_signals=True)
    rospy.on_shutdown(leave)


def preferred() -> str:
    """Return the language of the environment, English if the dashboard does not have it."""
    said = os.environ.get("LC_ALL") or os.environ.get("LC_MESSAGES") or os.environ.get("LANG") or ""
    return "es" if said.startswith("es") else "en"


def _has_display() -> bool:
    if os.environ.get("QT_QPA_PLATFORM"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
