"""The folder of data that must outlive the program: the queue and its history, recordings, the log."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from dmc41x3.files import unwritable
from dmc41x3.i18n import phrase
from maya_un.errors import FileUnwritable
from maya_un.namespace import own


def state_folder() -> Path:
    """Return the folder of state: $MAYA_STATE_DIR, else $XDG_STATE_HOME/maya, else ~/.local/state/maya.

    In a ROS namespace it is the subfolder of that namespace.
    """
    named = os.environ.get("MAYA_STATE_DIR")
    if named:
        return own(Path(named))
    home = os.environ.get("XDG_STATE_HOME")
    return own((Path(home) if home else Path.home() / ".local" / "state") / "maya")


def queue_file() -> Path:
    """Return the file of the queue, its history and the users, in the folder of state."""
    return state_folder() / _QUEUE


def own_queue_file() -> Path:
    """Return the file of the queue in the folder that `own_state_folder` creates; raises `FileUnwritable`."""
    return own_state_folder() / _QUEUE


_QUEUE = "maya.db"


def own_state_folder() -> Path:
    """Return the folder of state, created with access for its owner alone if it is missing.

    Removes other users' access from an existing folder of this user. Raises `FileUnwritable` for a folder that
    everybody may write to.
    """
    place = state_folder()
    try:
        place.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = place.stat()
        if found.st_mode & stat.S_IWOTH:
            reason = phrase(
                "everybody may write to this folder and so change the queue; set its permissions with `chmod 700`"
            )
            raise FileUnwritable(path=place, reason=reason)
        if found.st_uid == os.getuid() and found.st_mode & 0o077:
            place.chmod(0o700)
    except OSError as error:
        raise unwritable(place, error) from error
    return place
