"""Where this program keeps what must outlive it: the queue and its history, recordings, the log."""

from __future__ import annotations

import os
from pathlib import Path


def state_folder() -> Path:
    """Return the folder of state: $MAYA_STATE_DIR, else $XDG_STATE_HOME/maya, else ~/.local/state/maya."""
    named = os.environ.get("MAYA_STATE_DIR")
    if named:
        return Path(named)
    home = os.environ.get("XDG_STATE_HOME")
    return (Path(home) if home else Path.home() / ".local" / "state") / "maya"
