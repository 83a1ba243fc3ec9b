"""Drives the dashboard of ros/maya_ui in a bare application, by lines of JSON on its standard input.

Run by a Python that has Qt, and rospy unless `--stand-in` is given: then the robot only records its requests, and the
test sends its facts. Every line is answered by one line.
"""

from __future__ import annotations

import dataclasses
import json
import sys
import threading
from pathlib import Path
from time import monotonic
from typing import Any

PATIENCE = 25.0
"""Longest wait for a condition [s]."""

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "ros" / "maya_ui" / "src"))

from maya_ui import robot as facts  # noqa: E402 - the path comes first
from maya_ui.dashboard import Dashboard  # noqa: E402
from maya_ui.tasks import Task  # noqa: E402
from python_qt_binding.QtCore import QEvent, QObject, QPoint, QPointF, Qt, QTimer, Signal  # noqa: E402
from python_qt_binding.QtGui import QKeyEvent, QWheelEvent  # noqa: E402
from python_qt_binding.QtTest import QTest  # noqa: E402
from python_qt_binding.QtWidgets import QApplication  # noqa: E402


class StandIn:
    """A robot that does nothing but remember what was asked for."""

    def __init__(self) -> None:
        self.asked: list[Any] = []
        self.heard: facts.Heard = lambda _: None

    def open(self, heard: facts.Heard) -> None:
        self.heard = heard

    def __getattr__(self, name: str) -> Any:
        def ask(*arguments: Any) -> None:
            self.asked.append([name, *(_plain(one) for one in arguments)])

        return ask


def _plain(value: Any) -> Any:
    if isinstance(value, list):
        return [_plain(one) for one in value]
    return dataclasses.asdict(value) if isinstance(value, (Task, facts.Path, facts.Choice)) else value


class Driver(QObject):
    """Does what the lines say."""

    said = Signal(str)

    def __init__(self, dashboard: Dashboard, robot: Any) -> None:
        super().__init__()
        self._dashboard = dashboard
        self._robot = robot
        self._others: list[Dashboard] = []
        self._waiting: list[tuple[float, dict[str, Any]]] = []
        self._timer = QTimer(self)
        self._timer.timeout.connect(self._look)
        self._timer.start(5)
        self.said.connect(self._line, Qt.QueuedConnection)
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        for line in sys.stdin:
            self.said.emit(line)
        self.said.emit('{"do": "leave"}')

    def _line(self, line: str) -> None:
        command = json.loads(line)
        try:
            answer = getattr(self, f"do_{command.pop('do')}")(**command)
        except Exception as error:  # noqa: BLE001 - whoever drives is told
            answer = {"error": f"{type(error).__name__}: {error}"}
        if answer is not self:
            print(json.dumps(answer), flush=True)

    def _part(self, name: str) -> Any:
        return getattr(self._dashboard, name) if name else self._dashboard

    def do_click(self, name: str) -> Any:
        QTest.mouseClick(self._part(name), Qt.LeftButton)

    def do_press(self, name: str) -> Any:
        QTest.mousePress(self._part(name), Qt.LeftButton)

    def do_release(self, name: str) -> Any:
        QTest.mouseRelease(self._part(name), Qt.LeftButton)

    def do_move_away(self, name: str) -> Any:
        QTest.mouseMove(self._part(name), QPoint(-50, -50))

    def do_key(self, key: str, down: bool = True, repeated: bool = False) -> Any:
        kind = QEvent.KeyPress if down else QEvent.KeyRelease
        event = QKeyEvent(kind, getattr(Qt, f"Key_{key}"), Qt.NoModifier, "", repeated)
        QApplication.sendEvent(QApplication.focusWidget() or self._dashboard, event)

    def do_strike(self, key: str) -> Any:
        """Press and release a key where the focus is, shortcuts included."""
        QTest.keyClick(QApplication.focusWidget() or self._dashboard, getattr(Qt, f"Key_{key}"))

    def do_turn_wheel(self, name: str) -> Any:
        """Turn the wheel of the mouse over a part; return whether the part takes it, else the columns scroll."""
        part = self._part(name)
        middle = part.rect().center()
        at = QPointF(middle), QPointF(part.mapToGlobal(middle))
        turn = QPoint(0, -120)
        wheel = QWheelEvent(*at, QPoint(), turn, Qt.NoButton, Qt.NoModifier, Qt.NoScrollPhase, False)
        QApplication.sendEvent(part, wheel)
        return wheel.isAccepted()

    def do_focus(self, name: str) -> Any:
        QApplication.setActiveWindow(self._dashboard)
        self._part(name).setFocus()
        focus = QApplication.focusWidget()
        return None if focus is None else focus.objectName()

    def do_unfocus(self) -> Any:
        QApplication.focusWidget().clearFocus()

    def do_type(self, name: str, text: str) -> Any:
        field = self._part(name)
        field.setFocus()
        field.selectAll()
        QTest.keyClicks(field, text) if text else field.clear()

    def do_choose(self, name: str, data: Any) -> Any:
        choice = self._part(name)
        place = choice.findData(data) if choice.findData(data) >= 0 else choice.findText(str(data))
        choice.setCurrentIndex(place)
        choice.activated.emit(place)

    def do_menu(self, name: str, choose: int = -1) -> Any:
        """Return what the menu of a button offers, and choose one of it."""
        actions = self._part(name).menu().actions()
        if choose >= 0:
            actions[choose].trigger()
        return [action.text() for action in actions]

    def do_choose_row(self, name: str, row: int) -> Any:
        self._part(name).setCurrentRow(row)

    def do_read(self, name: str) -> Any:
        part = self._part(name)
        shown: dict[str, Any] = {"visible": part.isVisible(), "enabled": part.isEnabled(), "tip": part.toolTip()}
        shown["text"] = _text(part)
        shown["kind"] = part.property("kind")
        shown["checked"] = bool(part.property("checked"))
        return shown

    def do_rows(self, name: str) -> Any:
        part = self._part(name)
        if hasattr(part, "topLevelItemCount"):
            items = [part.topLevelItem(row) for row in range(part.topLevelItemCount())]
            return [[item.text(column) for column in range(part.columnCount())] for item in items]
        return [part.item(row).text() for row in range(part.count())]

    def do_wait(self, **wanted: Any) -> Any:
        """Answer once a part reads as wanted: `text` a part of its text, `below` a number above it, or others."""
        self._waiting.append((monotonic() + PATIENCE, wanted))
        self._look()
        return self

    def _look(self) -> None:
        for end, wanted in list(self._waiting):
            now = self.do_read(wanted["name"])
            text = wanted.get("text", "")
            others = {key: wanted[key] for key in ("enabled", "visible", "kind", "tip") if key in wanted}
            below = "below" not in wanted or float(now["text"]) < wanted["below"]
            if text in str(now["text"]) and below and all(now[key] == value for key, value in others.items()):
                self._waiting.remove((end, wanted))
                print(json.dumps(now), flush=True)
            elif monotonic() > end:
                self._waiting.remove((end, wanted))
                print(json.dumps({"error": f"never came: {wanted}, but {now}; {self._everything()}"}), flush=True)

    def _everything(self) -> dict[str, Any]:
        shown = {name: _text(self._part(name)) for name in ("mode", "note", "banner_text", "progress", "task_why")}
        return {**shown, "events": self.do_rows("event_list")[-8:]}

    def do_tell(self, fact: str, times: int = 1, **fields: Any) -> Any:
        """Have the stand-in tell a fact, once or more, and answer when it has been heard."""
        kind = getattr(facts, fact)
        if "command" in fields:
            fields["command"] = facts.Command(fields["command"])
        if "choices" in fields:
            fields["choices"] = tuple(facts.Choice(*one) for one in fields["choices"])
        if fields.get("standing") is not None:
            fields["standing"] = facts.Standing(**fields["standing"])
        for _ in range(times):
            self._robot.heard(kind(**fields))
        QTimer.singleShot(0, lambda: print("null", flush=True))
        return self

    def do_asked(self) -> Any:
        asked, self._robot.asked = self._robot.asked, []
        return asked

    def do_add(self, command: str, target: list[float], open: bool = False) -> Any:
        self._dashboard.list.add(Task(command, (target[0], target[1], target[2]), open))

    def do_file(self, how: str, path: str) -> Any:
        getattr(self._dashboard.list, how)(path)

    def do_speak(self, language: str) -> Any:
        self._dashboard.speak(language)

    def do_size(self, width: int, height: int) -> Any:
        self._dashboard.resize(width, height)
        return [self._dashboard.width(), self._dashboard.height()]

    def do_keep_on_screen(self) -> Any:
        self._dashboard.keep_window_on_screen()

    def do_frame(self) -> Any:
        """Return the screen and the window with its frame, as left, top, width and height."""
        room, frame = QApplication.primaryScreen().availableGeometry(), self._dashboard.frameGeometry()
        return [[one.left(), one.top(), one.width(), one.height()] for one in (room, frame)]

    def do_place(self, name: str) -> Any:
        """Return where a part is in the dashboard [pixels]."""
        at = self._part(name).mapTo(self._dashboard, QPoint(0, 0))
        return [at.x(), at.y()]

    def do_beyond(self) -> Any:
        """Return how much of the columns is out of view to the side [pixels]."""
        return self._dashboard.scroll_area.horizontalScrollBar().maximum()

    def do_hint(self) -> Any:
        return [self._dashboard.sizeHint().width(), self._dashboard.sizeHint().height()]

    def do_last_row_is_in_view(self, name: str) -> Any:
        part = self._part(name)
        last = part.visualItemRect(part.topLevelItem(part.topLevelItemCount() - 1))
        return part.viewport().rect().contains(last)

    def do_title_of_another(self, number: int, language: str) -> Any:
        """Return the title of one more dashboard, in a language that is chosen after it was opened."""
        robot: Any = StandIn()
        another = Dashboard(robot, "en", number)
        self._others.append(another)  # PyQt crashes where Python's garbage collector ends a window
        another.speak(language)
        return another.windowTitle()

    def do_hide(self) -> Any:
        self._dashboard.hide()

    def do_show(self) -> Any:
        self._dashboard.show()
        QApplication.setActiveWindow(self._dashboard)

    def do_grab(self, path: str) -> Any:
        picture = self._dashboard.grab()
        return [picture.save(path), picture.width(), picture.height()]

    def do_leave(self) -> Any:
        self._dashboard.shut_down()
        QApplication.instance().quit()


def _text(part: Any) -> str:
    if hasattr(part, "currentText"):
        return part.currentText()
    if hasattr(part, "format"):
        return part.format()
    return part.text() if hasattr(part, "text") else part.windowTitle()


def main(arguments: list[str]) -> int:
    """Open the dashboard and obey the input until it ends."""
    app = QApplication(["dashboard"])
    app.setStyle("Fusion")
    if "--stand-in" in arguments:
        robot: Any = StandIn()
    else:
        from maya_ui.start import join
        from maya_ui.ui_controller import UiController

        if "--old-actionlib" in arguments:
            import actionlib

            del actionlib.ActionClient.stop  # which came with 1.13
        robot = UiController(lambda: join(app.quit))
    dashboard = Dashboard(robot)
    dashboard.resize(1240, 860)
    dashboard.show()
    dashboard.activateWindow()
    driver = Driver(dashboard, robot)
    print(json.dumps("ready"), flush=True)
    code = app.exec_()
    del driver
    return code


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
