"""What a part of the dashboard may be, for its colour; `resource/dashboard.qss` says how it looks then."""

from __future__ import annotations

from typing import Any

GOOD, BUSY, WARN, BAD, GONE = "good", "busy", "warn", "bad", "gone"
"""As it should be, doing something, to be looked at, in trouble, not there."""


def dress(widget: Any, kind: str) -> None:
    """Have a widget look as its kind does."""
    if widget.property("kind") != kind:
        widget.setProperty("kind", kind)
        widget.style().unpolish(widget)
        widget.style().polish(widget)
