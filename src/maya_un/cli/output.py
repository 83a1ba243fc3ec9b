"""Output of `maya`: sentences, JSON and errors; maps error codes to exit codes."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Any

from dmc41x3.cli import console
from dmc41x3.cli.console import (
    DONE,
    FAILED,
    INTERRUPTED,
    REFUSED,
    OutputSettings,
    answer,
    emit,
    forget_unprinted,
    say,
    tolerate_any_terminal,
)
from maya_un.errors import MayaError, StorageUnavailable, translated

__all__ = [
    "DONE",
    "FAILED",
    "INTERRUPTED",
    "REFUSED",
    "answer",
    "complain",
    "concluded",
    "emit",
    "exit_code",
    "forget_unprinted",
    "say",
    "tolerate_any_terminal",
]


def complain(error: MayaError, settings: OutputSettings) -> int:
    """Print an error, as one sentence with its code or as JSON, and return its exit code."""
    console.complain(error, settings, "maya")
    return exit_code(error.code)


def concluded(report: Mapping[str, Any], settings: OutputSettings) -> int:
    """Print on the error stream why a job or command failed, and return the exit code; 0 if it succeeded.

    Once one of its steps has begun, nothing was refused, whatever its code. `report` is a JobReport as JSON data. With
    --json, the printed report already contains the error.
    """
    if report["state"] == "done":
        return DONE
    if not settings.json:
        message = translated(report["code"], report["message"], settings.language)
        print(f"maya: error {report['code']}: {message}", file=sys.stderr, flush=True)
    begun = any(step["duration"] is not None for step in report.get("steps", ()))
    return FAILED if begun else exit_code(report["code"]) or FAILED


def exit_code(code: int) -> int:
    """Return the exit code for an error code: 2 for wrong requests and configuration (4xxx, 5xxx), else 1.

    A full or read-only disk also returns 1, so that systemd restarts `maya up`.
    """
    return FAILED if code == StorageUnavailable.code else console.exit_code(code)
