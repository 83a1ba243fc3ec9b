"""Runs the rqt that is installed, and drives the dashboard in it by lines of JSON, as `dashboard_driver` does alone.

Its arguments are those of rqt; without any it opens the perspective as `maya_ui.start` does. Rqt and its plugins print
to the standard error output.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.ros.dashboard_driver import Dashboard, Driver  # isort: skip - it makes the package maya_ui known

from maya_ui.start import perspective_here
from python_qt_binding.QtCore import Qt, QTimer
from python_qt_binding.QtWidgets import QApplication, QDockWidget
from rqt_gui.main import Main


class RqtDriver(Driver):
    """Does what the lines say, in rqt."""

    def do_docks(self) -> Any:
        """Return the docks that are shown: left, top, width and height in the window [pixels]."""
        docks = self._dashboard.window().findChildren(QDockWidget, options=Qt.FindDirectChildrenOnly)
        return {
            dock.objectName(): [dock.x(), dock.y(), dock.width(), dock.height()]
            for dock in docks
            if not dock.visibleRegion().isEmpty()
        }

    def do_frame(self) -> Any:
        """Return the screen and the window with its frame, as left, top, width and height."""
        room, frame = QApplication.primaryScreen().availableGeometry(), self._dashboard.window().frameGeometry()
        return [[one.left(), one.top(), one.width(), one.height()] for one in (room, frame)]

    def do_whole(self, name: str) -> Any:
        """Tell whether all of a part is shown."""
        part = self._part(name)
        return part.visibleRegion().boundingRect() == part.rect()

    def do_leave(self) -> Any:
        """Close the window, whereupon rqt saves the perspective."""
        self._dashboard.window().close()


class _DrivenMain(Main):
    """rqt, with a driver as soon as it shows the dashboard."""

    driver: RqtDriver | None = None

    def create_application(self, argv: list[str]) -> Any:
        app = super().create_application(argv)
        self._search = QTimer(app)
        self._search.timeout.connect(self._find)
        self._search.start(50)
        return app

    def _find(self) -> None:
        found = [part for part in QApplication.allWidgets() if isinstance(part, Dashboard) and part.isVisible()]
        if found:
            self._search.stop()
            self.driver = RqtDriver(found[0], None)
            print(json.dumps("ready"), flush=True)


def main() -> int:
    """Open rqt and obey the input until it ends."""
    sys.stdout = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # C++ plugins print on it
    arguments = sys.argv[1:] or ["--perspective-file", str(perspective_here())]
    return int(_DrivenMain().main(["rqt", *arguments]) or 0)


if __name__ == "__main__":
    raise SystemExit(main())
