"""Settings for tests of other things than data records and the watchdog's beats, which cost most of the time."""

from __future__ import annotations

from pathlib import Path

from maya_un.config import Config, load

CALM_FILE = Path(__file__).with_suffix(".toml")
"""A configuration file with these settings, for commands."""

CALM = load(CALM_FILE)
"""The configuration that it holds."""

SELDOM_BEATING = CALM.model_copy(update={"controller": Config().controller})
"""The usual data records, which find motion of another program in time, and few beats."""
