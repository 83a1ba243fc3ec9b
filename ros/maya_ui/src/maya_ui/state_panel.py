"""The head of the dashboard (state, pause, speed, stop), its banner, and the position of the gripper."""

from __future__ import annotations

from math import degrees
from typing import Any

from python_qt_binding.QtWidgets import QMenu

from maya_ui import look, reasons
from maya_ui.lengths import metres, millimetres
from maya_ui.look import dress
from maya_ui.panel import PanelContext
from maya_ui.robot import Choice, Command, Position
from maya_ui.words import phrase, sentence

SPEEDS = (100, 75, 50, 25, 10, 5)
"""The speeds that can be chosen [%]."""

_KINDS: dict[str, str] = {
    "idle": look.GOOD,
    "homing": look.BUSY,
    "moving": look.BUSY,
    "stopping": look.BUSY,
    "paused": look.WARN,
    "not_homed": look.WARN,
    "fault": look.BAD,
    "disconnected": look.GONE,
}


class StatePanel:
    """Shows the state, and takes the commands for all motion."""

    def __init__(self, context: PanelContext) -> None:
        self._context = context
        self._choices: Any = None
        ui = context.ui
        ui.stop.clicked.connect(lambda _: self.stop())
        ui.recover.clicked.connect(lambda _: context.robot.recover())
        ui.pause.clicked.connect(self._pause)
        ui.resume_queue.clicked.connect(lambda _: context.robot.resume_queue())
        ui.recover_queue.setMenu(QMenu(ui.recover_queue))
        ui.recover_queue.menu().triggered.connect(lambda action: context.robot.recover_queue(action.data()))
        for percent in SPEEDS:
            ui.speed_choice.addItem(f"{percent} %", percent / 100.0)
        ui.speed_choice.activated.connect(self._choose_speed)
        for axis in "xyz":
            getattr(ui, f"axis_{axis}").setText(axis)

    def stop(self) -> None:
        """Stop all motion."""
        self._context.say(self._context.word("asked", what=self._context.word("command_stop")))
        self._context.robot.stop()

    def refresh(self) -> None:
        """Show the present state."""
        standing, ui = self._context.seen.standing, self._context.ui
        held = standing.mode == "idle" and self._context.seen.queue.mode != "running"
        ui.mode.setText(phrase("mode_queue_paused" if held else f"mode_{standing.mode}", self._context.language))
        ui.mode.setAccessibleName(ui.mode.text())
        dress(ui.light, look.WARN if held else _KINDS.get(standing.mode, look.WARN))
        self._chips()
        self._banner()
        self._pausing()
        self._speed()
        self.place()

    def _chips(self) -> None:
        standing, connected, ui = self._context.seen.standing, self._context.seen.connected, self._context.ui
        gripper = {None: "gripper_unknown", True: "gripper_closed", False: "gripper_open"}[standing.gripper_closed]
        shown = {
            "chip_homed": ("homed", "") if standing.homed else ("not_homed", look.WARN),
            "chip_moving": ("moves", look.BUSY) if standing.moving else ("rests", ""),
            "chip_gripper": (gripper, ""),
        }
        for name, (key, kind) in shown.items():
            chip = getattr(ui, name)
            chip.setVisible(connected)
            chip.setText(self._context.word(key))
            dress(chip, kind)

    def _banner(self) -> None:
        text, kind = self._advice()
        ui = self._context.ui
        ui.banner_text.setText(text)
        ui.banner.setVisible(bool(text))
        dress(ui.banner, kind)
        ui.recover.setVisible(self._context.seen.standing.mode == "fault")
        self._context.allow(ui.recover, reasons.why_not(Command.RECOVER, self._context.seen))
        self._queue_buttons()

    def _queue_buttons(self) -> None:
        ui, queue = self._context.ui, self._context.seen.queue
        ui.resume_queue.setVisible(queue.mode != "running" and not queue.job)
        self._context.allow(ui.resume_queue, reasons.why_not(Command.RESUME_QUEUE, self._context.seen))
        ui.recover_queue.setVisible(bool(queue.job))
        self._context.allow(ui.recover_queue, reasons.why_not(Command.RECOVER_QUEUE, self._context.seen))
        menu = ui.recover_queue.menu()
        shown = (queue.choices, self._context.language)
        if shown != self._choices:
            self._choices = shown
            menu.clear()
            for choice in queue.choices:
                menu.addAction(self._choice(choice)).setData(choice)

    def _choice(self, choice: Choice) -> str:
        """Return a choice in words."""
        said = phrase(f"choice_{choice.name}", self._context.language)
        return f"{said}: {self._context.word(f'holding_{choice.holding}')}" if choice.holding else said

    def _advice(self) -> tuple[str, str]:
        """Return the advice for a person, and its urgency."""
        standing = self._context.seen.standing
        gone = reasons.link(self._context.seen)
        if gone:
            return self._context.word(gone), look.GONE
        if standing.mode == "fault":
            said = sentence(standing.fault_code, standing.fault, self._context.language)
            return f"{said} ({standing.fault_code})" if standing.fault_code else said, look.BAD
        if standing.mode == "paused":
            return self._context.word("resume_first"), look.WARN
        if not self._context.seen.presence.master:
            return self._context.word("master_gone"), look.WARN
        said = [self._context.word("home_first")] if standing.mode == "not_homed" else []
        said += self._queue_advice()
        return (" ".join(said), look.WARN) if said else ("", "")

    def _queue_advice(self) -> list[str]:
        """Return the advice about a queue that does not continue by itself."""
        queue = self._context.seen.queue
        if queue.job:
            step = queue.step or self._context.word("between_steps")
            return [self._context.word("queue_interrupted", job=queue.job, step=step)]
        if queue.mode == "running":
            return []
        reason = f"queue_reason_{queue.reason}"
        return [
            self._context.word("queue_paused", reason=phrase(reason, self._context.language) if queue.reason else "—")
        ]

    def _pausing(self) -> None:
        paused = self._context.seen.standing.mode == "paused"
        button = self._context.ui.pause
        button.setText(self._context.word("resume" if paused else "pause"))
        self._context.allow(button, reasons.why_not(Command.RESUME if paused else Command.PAUSE, self._context.seen))

    def _pause(self) -> None:
        paused = self._context.seen.standing.mode == "paused"
        (self._context.robot.resume if paused else self._context.robot.pause)()

    def _speed(self) -> None:
        choice = self._context.ui.speed_choice
        self._context.allow(choice, reasons.why_not(Command.SPEED, self._context.seen))
        ratio = self._context.seen.standing.override
        nearest = min(range(choice.count()), key=lambda place: abs(choice.itemData(place) - ratio))
        if not choice.view().isVisible():
            choice.setCurrentIndex(nearest)

    def _choose_speed(self, place: int) -> None:
        self._context.robot.speed(self._context.ui.speed_choice.itemData(place))

    def place(self) -> None:
        """Show the position of the gripper."""
        here, joints = self._context.seen.position, self._context.seen.joints
        self._lengths(here)
        values = self._context.ui.joint_values
        if here is None:
            values.setText(self._context.word("unknown_position"))
        elif joints is not None:
            shown = {"a": degrees(joints.a), "b": joints.b * 1e3, "c": joints.c * 1e3}
            values.setText(self._context.word("joints", **shown))

    def _lengths(self, here: Position | None) -> None:
        for axis in "xyz":
            length = None if here is None else getattr(here, axis)
            getattr(self._context.ui, f"value_{axis}").setText("—" if length is None else millimetres(length))
            getattr(self._context.ui, f"unit_{axis}").setText("mm")
            getattr(self._context.ui, f"metres_{axis}").setText("" if length is None else metres(length))
