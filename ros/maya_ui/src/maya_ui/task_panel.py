"""Tasks: home and gripper at once, and pick, place and approach at a typed position."""

from __future__ import annotations

from typing import Any, Callable

from maya_ui import look, reasons
from maya_ui.lengths import NotALength, metres, millimetres, parsed
from maya_ui.look import dress
from maya_ui.panel import PanelContext
from maya_ui.robot import Command, Under
from maya_ui.tasks import AIMED, APPROACH, GRIPPER, HOME, PICK, PLACE, Task

COMMANDS: dict[str, tuple[str, bool]] = {
    "task_pick": (PICK, False),
    "task_place": (PLACE, False),
    "task_approach": (APPROACH, False),
    "task_home": (HOME, False),
    "task_open": (GRIPPER, True),
    "task_close": (GRIPPER, False),
}
"""The commands by their words: a command, and whether it opens the gripper."""


class TaskPanel:
    """The quick buttons, the fields of a task, and its use: now, into the queue, or onto the list."""

    def __init__(self, context: PanelContext, add: Callable[[Task], None]) -> None:
        self._context = context
        self._add = add
        self._touched = False
        ui = context.ui
        ui.home.clicked.connect(lambda _: context.robot.home())
        ui.open_gripper.clicked.connect(lambda: context.robot.gripper(True))
        ui.close_gripper.clicked.connect(lambda: context.robot.gripper(False))
        ui.here.clicked.connect(self._take_position)
        ui.now.clicked.connect(lambda: self._with_task(context.robot.perform))
        ui.send.clicked.connect(lambda: self._with_task(self._send))
        ui.add.clicked.connect(lambda: self._with_task(add))
        ui.command_choice.currentIndexChanged.connect(lambda _: self.refresh())
        for axis, field in self._fields():
            ui_name = f"field_name_{axis}"
            getattr(ui, ui_name).setText(f"{axis} [mm]")
            field.textChanged.connect(lambda _: self._typed())
            field.setAccessibleName(f"{axis} [mm]")

    def reword(self) -> None:
        """Show the commands in the chosen language."""
        choice = self._context.ui.command_choice
        now = max(0, choice.currentIndex())
        choice.blockSignals(True)
        choice.clear()
        for key in COMMANDS:
            choice.addItem(self._context.word(key), key)
        choice.setCurrentIndex(now)
        choice.blockSignals(False)

    def refresh(self) -> None:
        """Show which commands can be sent now, and why the others cannot."""
        context, ui, seen = self._context, self._context.ui, self._context.seen
        quick = reasons.why_not(Command.HOME, seen)
        for button in (ui.home, ui.open_gripper, ui.close_gripper):
            context.allow(button, quick)
        context.explain(ui.quick_why, quick)
        aimed = self._command()[0] in AIMED
        for _, field in self._fields():
            field.setEnabled(aimed)
            field.setToolTip(context.word("target_hint"))
        context.allow(ui.here, "" if seen.position is not None else "no_position")
        now = reasons.why_not_now(Task(*self._bare()), seen)
        queued = reasons.why_not(Command.SEND, seen)
        context.allow(ui.now, now)
        context.allow(ui.send, queued)
        context.allow(ui.add, "")
        context.explain(ui.task_why, now if now != quick else queued)
        self._echo()
        self.show_progress(seen.under)

    def show_progress(self, under: Under | None) -> None:
        """Show the progress of the command under way."""
        bar = self._context.ui.progress
        bar.setEnabled(under is not None)
        bar.setValue(0 if under is None else round(1000 * min(1.0, max(0.0, under.share))))
        if under is None:
            bar.setFormat("")
            return
        what = self._context.word(f"command_{under.command.value}")
        phase = under.phase.replace("_", " ")
        bar.setFormat(self._context.word("under_way", what=what, phase=f"{phase}  %p%" if under.share else phase))

    def task(self) -> Task | None:
        """Return the task of the fields, None if a field holds no length; the fields show which."""
        command, opens = self._command()
        if command not in AIMED:
            return Task(command, open=opens)
        self._touched = True
        lengths = [self._length(axis, field) for axis, field in self._fields()]
        self._echo()
        if any(length is None for length in lengths):
            next(field for axis, field in self._fields() if self._length(axis, field) is None).setFocus()
            return None
        x, y, z = (length or 0.0 for length in lengths)
        return Task(command, (x, y, z))

    def _with_task(self, use: Callable[[Task], None]) -> None:
        task = self.task()
        if task is not None:
            use(task)

    def _send(self, task: Task) -> None:
        self._context.robot.send(task)
        self._context.say(self._context.word("sent", what=self._context.task_text(task)), look.GOOD)

    def _command(self) -> tuple[str, bool]:
        return COMMANDS.get(self._context.ui.command_choice.currentData(), (PICK, False))

    def _bare(self) -> tuple[str, tuple[float, float, float], bool]:
        command, opens = self._command()
        return command, (0.0, 0.0, 0.0), opens

    def _fields(self) -> tuple[tuple[str, Any], ...]:
        ui = self._context.ui
        return (("x", ui.field_x), ("y", ui.field_y), ("z", ui.field_z))

    def _length(self, axis: str, field: Any) -> float | None:
        try:
            return parsed(field.text())
        except NotALength:
            return None

    def _typed(self) -> None:
        self._touched = True
        self._echo()

    def _echo(self) -> None:
        """Show beside every field how it is understood, and below the fields the first error."""
        wrong = ""
        for axis, field in self._fields():
            echo, kind = "", ""
            try:
                echo = metres(parsed(field.text()))
            except NotALength as error:
                bad = self._touched and field.isEnabled() and (error.key != "length_missing" or not field.hasFocus())
                kind = look.BAD if bad else ""
                wrong = wrong or (self._context.word(error.key, name=axis) if bad else "")
            getattr(self._context.ui, f"echo_{axis}").setText(echo)
            dress(field, kind)
        self._context.ui.target_why.setText(wrong)
        self._context.ui.target_why.setVisible(bool(wrong))

    def _take_position(self) -> None:
        here = self._context.seen.position
        if here is not None:
            for axis, field in self._fields():
                field.setText(millimetres(getattr(here, axis)))
