"""The options of every command of `maya`, at any position: --json, --lang, --units, --config."""

from __future__ import annotations

import os
from collections.abc import Sequence

from dmc41x3.cli import console as tools
from dmc41x3.cli.console import CommandContext, OutputSettings, asks_for_json, settings_of

__all__ = ["CommandContext", "OutputSettings", "asks_for_json", "from_environment", "settings_of", "split"]


def from_environment() -> OutputSettings:
    """Return the settings without options: $MAYA_LANG and $MAYA_UNITS, English and mm for unsupported values."""
    settings, units = tools.from_environment("MAYA_LANG"), os.environ.get("MAYA_UNITS", "").lower()
    return settings._replace(units=units) if units in tools.UNITS else settings


def split(arguments: Sequence[str], settings: OutputSettings) -> tuple[OutputSettings, list[str]]:
    """Extract the common options from `arguments`; return them and the rest, in order.

    Raises `InvalidCommandLine` for an option without its value and `InvalidValue` for an unknown value of one.
    """
    return tools.split_options(arguments, settings, "maya", ("--lang", "--units", "--config"))
