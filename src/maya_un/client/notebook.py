"""Representations of messages in notebooks, registered with the notebook's formatters."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

from maya_un.client import looks
from maya_un.schema.jobs import JobReport, QueueView
from maya_un.schema.previews import JobPreview, Reach
from maya_un.schema.robot import Status
from maya_un.values import State

LOOKS: dict[type, Callable[[Any], str]] = {
    State: looks.state,
    Status: looks.status,
    JobReport: looks.report,
    JobPreview: looks.preview,
    QueueView: looks.queue,
    Reach: looks.reach,
}
"""Kinds of messages, and what makes HTML of them."""


def register() -> None:
    """Have the notebook that this runs in, if any, show messages as tables."""
    shells = sys.modules.get("IPython")
    shell = None if shells is None else shells.get_ipython()
    if shell is None:
        return
    html = shell.display_formatter.formatters["text/html"]
    for kind, look in LOOKS.items():
        html.for_type(kind, look)
