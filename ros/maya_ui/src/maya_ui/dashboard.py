"""The dashboard: one widget, in rqt, in a separate window, or in another application; for Qt's thread only."""

from __future__ import annotations

from typing import Any

from python_qt_binding import loadUi
from python_qt_binding.QtCore import QDir, QEvent, QObject, QPoint, QSize, Qt, QTimer, Signal
from python_qt_binding.QtGui import QKeySequence
from python_qt_binding.QtWidgets import QApplication, QBoxLayout, QComboBox, QPushButton, QShortcut, QWidget

from maya_ui import look
from maya_ui.event_panel import EventPanel
from maya_ui.panel import PanelContext
from maya_ui.queue_panel import QueuePanel
from maya_ui.resources import resource
from maya_ui.robot import Command, Ended, Fact, Happened, Joints, Position, Presence, Robot, Under
from maya_ui.seen import Seen
from maya_ui.state_panel import StatePanel
from maya_ui.task_panel import TaskPanel
from maya_ui.teleop_panel import TeleopPanel
from maya_ui.words import LANGUAGES, WORDS, sentence, word

NARROW = 1000
"""Below this width [pixels], the labels of the head stand below each other, so that it can become narrower still."""

STOP_KEYS = ("Esc", "F12")
"""The keys that stop the robot, wherever the focus is."""

SPLIT = (3, 1)
"""Shares of the height for the commands and the events."""

SIZE = (1240, 860)
"""The size at which everything is visible without scrolling [pixels]."""

FIT_AGAIN = 50
"""Time between two attempts to fit the window on the screen [ms]."""

FITS = 20
"""Most attempts to fit the window on the screen; a display without a window manager never adds a frame."""

CALM = frozenset({"2201", "2202"})
"""Codes of commands that a person ended: stopped, cancelled."""


class _StillChoices(QObject):
    """Keeps the wheel of the mouse from changing a choice: the widget around it scrolls instead."""

    def eventFilter(self, watched: Any, event: Any) -> bool:  # noqa: N802 - Qt's name
        """Leave turns of the wheel to the parent."""
        if event.type() != QEvent.Wheel:
            return False
        event.ignore()
        return True


class _Ears(QObject):
    """Carries facts from any thread to Qt's."""

    heard = Signal(object)


class Dashboard(QWidget):
    """Shows a robot and takes commands for it. It does not know how the robot moves or how it is connected."""

    language_chosen = Signal(str)
    """A person chose another language."""

    def __init__(self, robot: Robot, language: str = "en", number: int = 1) -> None:
        """Show `robot`; of several dashboards in one window, the title shows the `number` from the second on."""
        super().__init__()
        self._number = number
        self._wide = 0
        self._fits_left = 0
        self._fitting = QTimer(self)
        self._fitting.timeout.connect(self._fit_window)
        loadUi(str(resource("MayaPlugin.ui")), self)
        self.setObjectName("MayaDashboard")
        self.setAttribute(Qt.WA_StyledBackground)
        QDir.setSearchPaths("resource", [str(resource(""))])
        self.setStyleSheet(resource("dashboard.qss").read_text(encoding="utf-8"))
        self._robot = robot
        self.seen = Seen()
        self._context = PanelContext(self, robot, self.seen, language)
        self._state = StatePanel(self._context)
        self._teleop = TeleopPanel(self._context, self._state.stop)
        self.list = QueuePanel(self._context)
        self._tasks = TaskPanel(self._context, self.list.add)
        self._events = EventPanel(self._context)
        self._content: Any = self.scroll_area.widget()
        self._content.installEventFilter(self)
        self._stop_by_key()
        self._still = _StillChoices()
        for choice in self.findChildren(QComboBox):
            choice.setFocusPolicy(Qt.StrongFocus)  # the wheel would give it the focus
            choice.installEventFilter(self._still)
        self._offer_languages()
        self.speak(language)
        self.stop.setFocus()
        for place, share in enumerate(SPLIT):
            self.split.setStretchFactor(place, share)
        self._ears = _Ears()
        self._ears.heard.connect(self._hear, Qt.QueuedConnection)
        robot.open(self._ears.heard.emit)

    @property
    def spoken(self) -> str:
        """The language of the dashboard."""
        return self._context.language

    def speak(self, language: str) -> None:
        """Show all text in a language."""
        self._context.language = language if language in LANGUAGES else "en"
        for key in WORDS:
            part: Any = getattr(self, key, None)
            if isinstance(part, QWidget):
                (part.setTitle if hasattr(part, "setTitle") else part.setText)(self._context.word(key))
                if f"{key}_hint" in WORDS:
                    part.setToolTip(self._context.word(f"{key}_hint"))
        self.language_choice.setCurrentIndex(self.language_choice.findData(self._context.language))
        title = self._context.word("title")
        self.setWindowTitle(title if self._number <= 1 else f"{title} ({self._number})")
        for panel in (self._teleop, self._tasks, self.list, self._events):
            panel.reword()
        self._wide = 0
        self._refresh()
        self._fold()

    def sizeHint(self) -> Any:  # noqa: N802 - Qt's name
        """Return the size at which everything is visible."""
        return QSize(*SIZE)

    def widen_window(self) -> None:
        """Make the window large enough for everything, as far as the screen allows."""
        window, screen = self.window(), QApplication.primaryScreen().availableSize()
        window.resize(window.size().expandedTo(self.sizeHint()).boundedTo(screen))

    def keep_window_on_screen(self) -> None:
        """Move the window, including its frame, onto its screen, as far as its least size allows.

        This is repeated until it fits, because the window manager adds the frame later, and columns that fold make the
        window narrower still.
        """
        self._fits_left = FITS
        self._fitting.start(FIT_AGAIN)
        self._fit_window()

    def _fit_window(self) -> None:
        window = self.window()
        handle = window.windowHandle()
        room = (QApplication.primaryScreen() if handle is None else handle.screen()).availableGeometry()
        frame = window.frameGeometry().size() - window.size()
        window.resize(window.size().boundedTo(room.size() - frame))
        whole = window.frameGeometry()
        left = max(room.left(), min(whole.left(), room.right() + 1 - whole.width()))
        top = max(room.top(), min(whole.top(), room.bottom() + 1 - whole.height()))
        if whole.topLeft() != QPoint(left, top):
            window.move(left, top)
        self._fits_left -= 1
        if self._fits_left <= 0 or (frame.height() > 0 and room.contains(window.frameGeometry())):
            self._fitting.stop()

    def resizeEvent(self, event: Any) -> None:  # noqa: N802 - Qt's name
        """Put the columns side by side if they fit, else below each other."""
        super().resizeEvent(event)
        self._fold()

    def eventFilter(self, watched: Any, event: Any) -> bool:  # noqa: N802 - Qt's name
        """Fold the columns when what they need has changed: another text, or the style, which Qt applies late."""
        if watched is self._content and event.type() == QEvent.LayoutRequest:
            self._fold()
        return bool(super().eventFilter(watched, event))

    def _fold(self) -> None:
        """Fold or unfold the columns.

        Texts change while the robot works. The columns keep the greatest width that they have needed, so that they do
        not jump from one shape to the other.
        """
        columns = self.columns
        parts = [columns.itemAt(place) for place in range(columns.count())]
        margins = columns.contentsMargins()
        needed = sum(part.minimumSize().width() for part in parts) + columns.spacing() * (len(parts) - 1)
        self._wide = max(self._wide, needed)
        bar = self.scroll_area.verticalScrollBar().sizeHint().width()
        fits = self._wide + margins.left() + margins.right() + bar <= self.width()
        self.mode.setWordWrap(self.width() < NARROW)
        for layout, side_by_side in ((columns, fits), (self.chips, self.width() >= NARROW)):
            direction = QBoxLayout.LeftToRight if side_by_side else QBoxLayout.TopToBottom
            if layout.direction() != direction:
                layout.setDirection(direction)
                self.layout().activate()  # the least width has changed

    def shut_down(self) -> None:
        """Release the held direction and stop listening."""
        self._teleop.release()
        self._robot.close()

    def showEvent(self, event: Any) -> None:  # noqa: N802 - Qt's name
        """Divide the height, which is known now."""
        super().showEvent(event)
        self.split.setSizes([share * self.split.height() // sum(SPLIT) for share in SPLIT])

    def _stop_by_key(self) -> None:
        for key in STOP_KEYS:
            shortcut = QShortcut(QKeySequence(key), self)
            shortcut.setContext(Qt.ApplicationShortcut)
            shortcut.setAutoRepeat(False)
            shortcut.activated.connect(self._state.stop)
            shortcut.activatedAmbiguously.connect(self._state.stop)

    def _offer_languages(self) -> None:
        for code, name in LANGUAGES.items():
            self.language_choice.addItem(name, code)
        self.language_choice.activated.connect(self._choose_language)

    def _choose_language(self, place: int) -> None:
        self.speak(self.language_choice.itemData(place))
        self.language_chosen.emit(self._context.language)

    def _hear(self, fact: Fact) -> None:
        known = self.seen.position is not None
        self.seen.take(fact)
        if isinstance(fact, (Position, Joints)) and known:
            self._state.place()
            self._teleop.teleop.positioned()
            return
        if isinstance(fact, Under):
            self._tasks.show_progress(fact)
        elif isinstance(fact, Happened):
            self._events.add(fact)
        elif isinstance(fact, Ended):
            self._end(fact)
        elif isinstance(fact, Presence) and not fact.controller:
            self._teleop.release()
        self._refresh()

    def _end(self, end: Ended) -> None:
        if end.command is Command.JOG:
            self._teleop.ended(end)
            if end.done or end.code in CALM:
                return
        what = self._context.word(f"command_{end.command.value}")
        if end.done:
            self._context.say(self._context.word("done", what=what), look.GOOD)
            return
        said = word(end.message, self.spoken) if end.message in WORDS else end.message
        said = sentence(end.code, said, self.spoken)
        key = "failed" if end.code else "failed_plainly"
        self._context.say(
            self._context.word(key, what=what, sentence=said, code=end.code), "" if end.code in CALM else look.BAD
        )

    def _refresh(self) -> None:
        """Show what has changed. A button that had the focus and is disabled now leaves it to STOP.

        Qt would give it to the next button, where a key that is pressed again would begin something else.
        """
        focused = self.focusWidget()
        for panel in (self._state, self._teleop, self._tasks, self.list):
            panel.refresh()
        if isinstance(focused, QPushButton) and not focused.isEnabled():
            self.stop.setFocus()
