"""Moving by hand: buttons and keys that move the robot while they are held."""

from __future__ import annotations

from math import degrees
from typing import Any

from python_qt_binding.QtCore import QEvent, QObject, Qt, QTimer
from python_qt_binding.QtWidgets import QApplication

from maya_ui import reasons
from maya_ui.panel import PanelContext
from maya_ui.robot import Command, Ended
from maya_ui.teleop import KEYS, REACHES, Direction, Teleop

LOOK_AGAIN = 100
"""Period of the check whether a button or key is still held [ms]."""

BUTTONS = {
    f"jog_{axis}_{name}": Direction(axis, sign) for axis in "xyzra" for name, sign in (("plus", 1), ("minus", -1))
}
"""The direction of each button."""

_LOST = (QEvent.FocusOut, QEvent.Hide, QEvent.WindowDeactivate)

_KEYS = {getattr(Qt, f"Key_{name}"): direction for name, direction in KEYS.items()}


class TeleopPanel(QObject):
    """The buttons, the pressed key, and the teleoperation that they control."""

    def __init__(self, context: PanelContext, stop: Any) -> None:
        super().__init__(context.ui)
        self._context = context
        self._stop = stop
        self._key: int | None = None
        self.teleop = Teleop(context.seen, context.robot.jog, context.robot.end_jog)
        for name, direction in BUTTONS.items():
            button = getattr(context.ui, name)
            button.pressed.connect(lambda direction=direction: self.teleop.press(direction))
            button.released.connect(self.release)
            button.installEventFilter(self)
        context.ui.keys.installEventFilter(self)
        context.ui.keys.toggled.connect(self.refresh)
        context.ui.reach_choice.currentIndexChanged.connect(self._choose)
        self._timer = QTimer(self)
        self._timer.timeout.connect(self._look)
        self._timer.start(LOOK_AGAIN)

    def reword(self) -> None:
        """Show the reaches with units."""
        choice = self._context.ui.reach_choice
        now = REACHES.index(self.teleop.reach)
        choice.blockSignals(True)
        choice.clear()
        choice.addItems([f"{reach.length * 1e3:g} mm · {degrees(reach.angle):.3g}°" for reach in REACHES])
        choice.setCurrentIndex(now)
        choice.blockSignals(False)

    def refresh(self) -> None:
        """Show whether the robot can be moved by hand now, and with what."""
        reason = self._why_not()
        for name in BUTTONS:
            self._context.allow(getattr(self._context.ui, name), reason)
        self._context.explain(self._context.ui.teleop_why, reason)
        live = self._context.ui.keys.isChecked()
        self._context.ui.keys_text.setText(self._context.word("keys_live" if live else "keys_off"))

    def _why_not(self) -> str:
        """Return why the robot cannot be moved by hand; motion of this panel is no reason."""
        ours = self.teleop.held is not None or self.teleop.under_way
        return reasons.link(self._context.seen) if ours else reasons.why_not(Command.JOG, self._context.seen)

    def release(self) -> None:
        """Release the held direction."""
        self._key = None
        self.teleop.release()

    def ended(self, end: Ended) -> None:
        """Handle the end of a path of this panel."""
        self.teleop.ended(end)

    def eventFilter(self, watched: QObject, event: Any) -> bool:  # noqa: N802 - Qt's name
        """Handle keys while they control the robot, and release the direction when the focus is lost."""
        if event.type() in _LOST:
            self._lost(watched)
            return False
        if watched is not self._context.ui.keys or not watched.isChecked():
            return False
        if event.type() == QEvent.ShortcutOverride and event.key() in (*_KEYS, Qt.Key_Space):
            event.accept()
            return True
        if event.type() == QEvent.KeyPress:
            return self._pressed(event)
        return event.type() == QEvent.KeyRelease and self._released(event)

    def _lost(self, watched: QObject) -> None:
        if watched is self._context.ui.keys:
            self._context.ui.keys.setChecked(False)
        if self.teleop.held is not None:
            self.release()

    def _pressed(self, event: Any) -> bool:
        if event.key() == Qt.Key_Space:
            self._stop()
            return True
        if event.key() not in _KEYS:
            return False
        if not event.isAutoRepeat() and self._key is None and not self._why_not():
            self._key = event.key()
            self.teleop.press(_KEYS[event.key()])
        return True

    def _released(self, event: Any) -> bool:
        if event.key() == self._key and not event.isAutoRepeat():
            self.release()
        return event.key() in _KEYS

    def _choose(self, place: int) -> None:
        if place >= 0:
            self.teleop.reach = REACHES[place]

    def _look(self) -> None:
        """Release a direction whose button or key is no longer held, even if its release event was lost."""
        if self.teleop.held is None:
            return
        ui = self._context.ui
        by_button = any(getattr(ui, name).isDown() for name in BUTTONS)
        by_key = self._key is not None and ui.keys.hasFocus() and QApplication.activeWindow() is not None
        if not by_button and not by_key:
            self.release()
