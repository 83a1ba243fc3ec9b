"""What the command line keeps of who asks and who drives: the user's token, the shell's lease. For this user alone."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from maya_un import credentials, runtime
from maya_un.errors import FileUnwritable


def keep_token(token: str) -> Path:
    """Keep a token for all commands of this user, whole or not at all; raises `FileUnwritable`."""
    place = credentials.token_file()
    draft = place.with_name(f"{place.name}.{os.getpid()}")
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        mine = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
        with os.fdopen(mine, "w", encoding="ascii") as out:
            out.write(f"{token}\n")
        draft.replace(place)
    except OSError as error:
        with suppress(OSError):
            draft.unlink()
        raise FileUnwritable(path=place, reason=error.strerror or str(error)) from error
    return place


def keep_lease(lease: str, url: str) -> None:
    """Keep a lease for the commands of this user; raises `FileUnwritable`."""
    runtime.write(credentials.LEASE_FILE, {"id": lease, "url": url})
