"""Kinds of parts of the dashboard, for their colours, which `resource/dashboard.qss` defines."""

from __future__ import annotations

from typing import Any

GOOD, BUSY, WARN, BAD, GONE = "good", "busy", "warn", "bad", "gone"
"""In order, active, needs attention, faulty, missing."""


def dress(widget: Any, kind: str) -> None:
    """Give a widget the look of a kind."""
    if widget.property("kind") != kind:
        widget.setProperty("kind", kind)
        widget.style().unpolish(widget)
        widget.style().polish(widget)
