"""The list of tasks that is prepared here, and the queue of the process layer that receives it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from python_qt_binding.QtWidgets import QFileDialog

from maya_ui import look, reasons
from maya_ui.panel import PanelContext
from maya_ui.robot import Command
from maya_ui.tasks import BadJob, Task, TaskList, job_tasks, job_text

MOST_BYTES = 250_000
"""Size of the largest job file that is read, as `maya run` reads it."""


class QueuePanel:
    """Shows the list, and lets a person change, save, load and queue it."""

    def __init__(self, context: PanelContext) -> None:
        self._context = context
        self.tasks = TaskList()
        ui = context.ui
        ui.up.clicked.connect(lambda: self._move(-1))
        ui.down.clicked.connect(lambda: self._move(1))
        ui.remove.clicked.connect(self._remove)
        ui.clear.clicked.connect(self._clear)
        ui.load.clicked.connect(self._ask_load)
        ui.save.clicked.connect(self._ask_save)
        ui.start.clicked.connect(self._start)
        ui.stop_queue.clicked.connect(lambda _: context.robot.stop_queue())
        ui.task_list.currentRowChanged.connect(lambda _: self.refresh())

    def add(self, task: Task) -> None:
        """Append a task to the list."""
        try:
            self._show(self.tasks.add(task))
        except BadJob as bad:
            self._context.say(self._context.word(bad.key, **bad.details), look.BAD)

    def reword(self) -> None:
        """Show the tasks in the chosen language."""
        self._show(self._context.ui.task_list.currentRow())

    def refresh(self) -> None:
        """Show what can be done with the list now."""
        ui, row = self._context.ui, self._context.ui.task_list.currentRow()
        empty = "" if len(self.tasks) else "list_empty"
        chosen = empty or ("" if row >= 0 else "nothing_chosen")
        for button, reason in ((ui.up, chosen), (ui.down, chosen), (ui.remove, chosen), (ui.clear, empty)):
            self._context.allow(button, reason)
        queue = reasons.why_not(Command.START_QUEUE, self._context.seen)
        self._context.allow(ui.load, "")
        self._context.allow(ui.save, empty)
        self._context.allow(ui.start, queue or empty)
        self._context.allow(ui.stop_queue, reasons.why_not(Command.STOP_QUEUE, self._context.seen))
        self._context.explain(ui.queue_why, queue or self._held() or empty)

    def _held(self) -> str:
        """Return the word for a queue that accepts tasks but does not start them, "" for a running queue."""
        return "queue_waits" if self._context.seen.queue.mode != "running" else ""

    def load(self, path: str) -> None:
        """Read the list from a job file."""
        name = Path(path).name
        cell = self._context.seen.cell
        try:
            with Path(path).open("rb") as file:
                text = file.read(MOST_BYTES + 1)[:MOST_BYTES].decode("utf-8")
            self.tasks.replace(job_tasks(text, None if cell is None else cell.grasp_height))
        except BadJob as bad:
            self._context.say(self._context.word(bad.key, file=name, **bad.details), look.BAD)
        except (OSError, UnicodeDecodeError) as error:
            self._context.say(self._context.word("job_unreadable", file=name, reason=error), look.BAD)
        else:
            self._show(0)
            self._context.say(self._context.word("loaded", count=len(self.tasks), file=name), look.GOOD)

    def save(self, path: str) -> None:
        """Write the list to a job file; a name without an ending gets one."""
        file = Path(path) if Path(path).suffix else Path(path).with_suffix(".yaml")
        try:
            file.write_text(job_text(list(self.tasks), file.stem), encoding="utf-8")
        except OSError as error:
            self._context.say(self._context.word("job_unwritable", file=file.name, reason=error.strerror), look.BAD)
        else:
            self._context.say(self._context.word("saved", count=len(self.tasks), file=file.name), look.GOOD)

    def _ask_load(self) -> None:
        self._ask(QFileDialog.AcceptOpen, QFileDialog.ExistingFile, self.load)

    def _ask_save(self) -> None:
        self._ask(QFileDialog.AcceptSave, QFileDialog.AnyFile, self.save)

    def _ask(self, mode: Any, files: Any, use: Any) -> None:
        """Open a file dialog that leaves the stop button reachable."""
        dialog = QFileDialog(self._context.ui)
        dialog.setAcceptMode(mode)
        dialog.setFileMode(files)
        dialog.setNameFilter(self._context.word("files"))
        dialog.setModal(False)
        dialog.fileSelected.connect(use)
        dialog.finished.connect(dialog.deleteLater)
        dialog.show()

    def _start(self) -> None:
        self._context.robot.start_queue(list(self.tasks))
        self._context.say(
            self._context.word("list_waits" if self._held() else "list_sent", count=len(self.tasks)),
            look.WARN if self._held() else look.GOOD,
        )

    def _move(self, by: int) -> None:
        self._show(self.tasks.move(self._context.ui.task_list.currentRow(), by))

    def _remove(self) -> None:
        row = self._context.ui.task_list.currentRow()
        self.tasks.remove(row)
        self._show(min(row, len(self.tasks) - 1))

    def _clear(self) -> None:
        self.tasks.replace([])
        self._show(-1)

    def _show(self, row: int) -> None:
        shown = self._context.ui.task_list
        shown.blockSignals(True)
        shown.clear()
        shown.addItems([f"{number}.  {self._context.task_text(task)}" for number, task in enumerate(self.tasks, 1)])
        shown.setCurrentRow(row)
        shown.blockSignals(False)
        self.refresh()
