"""Events as lines for people."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from maya_un.cli.display import Display

_PLAIN = {
    "disconnected", "homed", "stopped", "paused", "resumed", "gripper_open", "gripper_closed", "limit", "fault",
    "estop", "recovered"
}  # fmt: skip
"""Kinds that are told by their name, their code and their message."""


def line(event: Mapping[str, Any]) -> str | None:
    """Return an event, as JSON has it, as a line; None where it is not worth one."""
    kind, detail = event["kind"], event["detail"]
    if kind == "step" and detail["state"] != "queued":
        return _with_code(f"{detail['index']:>4} {detail['step']}: {detail['state']}", event["code"])
    if kind == "phase":
        return f"       {detail['name']}"
    if kind == "speed":
        return f"       speed {detail['ratio']:.0%}"
    if kind in _PLAIN:
        message = detail.get("message", "")
        return f"       {_with_code(kind.replace('_', ' '), event['code'])} {message}".rstrip()
    return None


def _with_code(text: str, code: int) -> str:
    return f"{text} ({code})" if code else text


def tell(event: Mapping[str, Any], display: Display) -> None:
    """Show an event, where it is worth a line, and remember the phase it begins."""
    if event["kind"] == "phase":
        display.phase = event["detail"]["name"]
    text = line(event)
    if text is not None:
        display.note(text)
