"""Common objects of all parts of the dashboard."""

from __future__ import annotations

from typing import Any

from maya_ui.look import dress
from maya_ui.reasons import Reason
from maya_ui.robot import Robot
from maya_ui.seen import Seen
from maya_ui.tasks import GRIPPER, Task
from maya_ui.words import WORDS, word


class PanelContext:
    """The objects that all panels share: the widgets, the robot, its known state, and the language."""

    def __init__(self, ui: Any, robot: Robot, seen: Seen, language: str) -> None:
        self.ui = ui
        self.robot = robot
        self.seen = seen
        self.language = language

    def word(self, key: str, **details: object) -> str:
        """Return a word in the chosen language."""
        return word(key, self.language, **details)

    def say(self, text: str, kind: str = "") -> None:
        """Show the outcome of a command, at the foot of the window."""
        self.ui.note.setText(text)
        self.ui.note.setAccessibleDescription(text)
        dress(self.ui.note, kind)

    def allow(self, button: Any, reason: Reason) -> None:
        """Enable a button, or disable it and show the reason."""
        hint = f"{button.objectName()}_hint"
        text = self.word(reason or hint) if reason or hint in WORDS else ""
        if button.isEnabled() == bool(reason) or button.toolTip() != text:
            button.setEnabled(not reason)
            button.setToolTip(text)
            button.setAccessibleDescription(text)

    def explain(self, label: Any, reason: Reason) -> None:
        """Show a reason as text, for people without a pointer to rest on a button."""
        label.setText(self.word(reason) if reason else "")
        label.setVisible(bool(reason))

    def task_text(self, task: Task) -> str:
        """Return a task in words, its target in millimetres."""
        if task.command == GRIPPER:
            return self.word("task_open" if task.open else "task_close")
        name = self.word(f"task_{task.command}")
        if task.command == "home":
            return name
        return f"{name}   {' · '.join(f'{length * 1e3:.6g}' for length in task.target)}"
