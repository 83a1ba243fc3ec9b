"""The events of the robot as they come, the newest at the end."""

from __future__ import annotations

from typing import Any

from python_qt_binding.QtCore import QTime
from python_qt_binding.QtWidgets import QHeaderView, QTreeWidgetItem

from maya_ui.panel import PanelContext
from maya_ui.robot import Happened
from maya_ui.words import happened, sentence

KEPT = 500
"""Largest number of events shown; the newest ones."""


class EventPanel:
    """A list of events; it follows the newest unless a person has scrolled up to read."""

    def __init__(self, context: PanelContext) -> None:
        self._context = context
        self._events: list[tuple[str, Happened]] = []
        self._follows = True
        bar = context.ui.event_list.verticalScrollBar()
        bar.rangeChanged.connect(lambda *_: self._follow())
        bar.valueChanged.connect(self._scrolled)
        header = context.ui.event_list.header()
        header.setResizeContentsPrecision(0)
        for column in (0, 1):
            header.setSectionResizeMode(column, QHeaderView.ResizeToContents)

    def add(self, event: Happened) -> None:
        """Show a new event."""
        self._events.append((QTime.currentTime().toString("HH:mm:ss"), event))
        del self._events[:-KEPT]
        shown = self._context.ui.event_list
        shown.addTopLevelItem(self._row(*self._events[-1]))
        while shown.topLevelItemCount() > KEPT:
            shown.takeTopLevelItem(0)
        self._follow()

    def reword(self) -> None:
        """Show all events in the chosen language."""
        shown = self._context.ui.event_list
        shown.setHeaderLabels([self._context.word(key) for key in ("time", "event", "detail")])
        shown.clear()
        shown.addTopLevelItems([self._row(*one) for one in self._events])
        self._follow()

    def _scrolled(self, value: int) -> None:
        """Follow the newest event as long as the end is in view; a resize moves the end, not the reader."""
        self._follows = value >= self._context.ui.event_list.verticalScrollBar().maximum()

    def _follow(self) -> None:
        if self._follows:
            self._context.ui.event_list.scrollToBottom()

    def _row(self, time: str, event: Happened) -> Any:
        said, rest = happened(event.word, event.detail, self._context.language)
        item = QTreeWidgetItem([time, said, self._detail(event, rest)])
        item.setToolTip(2, self._detail(event, rest))
        return item

    def _detail(self, event: Happened, rest: dict[str, Any]) -> str:
        message = event.message
        if not message and event.word == "fault" and event.standing is not None:
            message = event.standing.fault
        if message:
            said = sentence(event.code, message, self._context.language)
            return f"{said} ({event.code})" if event.code else said
        told = [f"{key} {_short(value)}" for key, value in rest.items()]
        return "   ".join([*([event.code] if event.code else []), *told])


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
