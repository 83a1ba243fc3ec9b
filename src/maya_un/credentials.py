"""Credentials of a client on this machine: the token of its user, and the control lease taken in the shell.

The token is $MAYA_TOKEN, else the line in the file at `token_file`; the lease is in a runtime file. A file that belongs
to another user, or that others can read, is not used. This module imports nothing heavy, because `maya stop` needs it.
It raises nothing: the service refuses a request without credentials.
"""

from __future__ import annotations

import os
import stat
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from maya_un import runtime

TOKEN = "MAYA_TOKEN"
"""The environment variable that holds a token."""

LEASE_FILE = "lease.json"
"""The runtime file of the lease that was taken in the shell."""

_MOST_BYTES = 4096


class StoredLease(NamedTuple):
    """A lease that was taken in the shell, at the service `url`."""

    id: str
    url: str


def token_file() -> Path:
    """Return the file of the user's token: $MAYA_TOKEN_FILE, else `maya/token` in the folder of configurations."""
    named = os.environ.get("MAYA_TOKEN_FILE")
    if named:
        return Path(named)
    base = os.environ.get("XDG_CONFIG_HOME")
    return (Path(base) if base else Path.home() / ".config") / "maya" / "token"


def token() -> str:
    """Return the token to send, "" without one."""
    named = os.environ.get(TOKEN)
    if named is not None:
        return _plain(named)
    try:
        return kept_in(token_file())
    except RuntimeError:  # no home folder exists
        return ""


def kept_in(place: Path) -> str:
    """Return the token in a file, "" unless the file belongs to this user and only this user can read it."""
    try:
        found = place.stat()
        ours = found.st_uid == os.getuid() and stat.S_ISREG(found.st_mode) and not found.st_mode & 0o077
        return _plain(place.read_text(encoding="ascii")) if ours and found.st_size <= _MOST_BYTES else ""
    except (OSError, ValueError):
        return ""


def origin() -> str:
    """Return the variable or file of the token, for display; "" without a token."""
    if not token():
        return ""
    return f"${TOKEN}" if TOKEN in os.environ else str(token_file())


def held() -> StoredLease | None:
    """Return the lease that was taken in the shell, None without one."""
    found = runtime.read(runtime.folder() / LEASE_FILE)
    try:
        return StoredLease(_plain(str(found["id"])), str(found["url"]))
    except (KeyError, TypeError):
        return None


def forget(lease: str) -> None:
    """Forget an ended lease that was taken in the shell; another one that was taken since stays."""
    kept = held()
    if kept is not None and kept.id == lease:
        with suppress(OSError):
            (runtime.folder() / LEASE_FILE).unlink()


def headers(url: str) -> dict[str, str]:
    """Return the headers of every request to the service at `url`: the token, and the lease held there."""
    shown, lease = token(), held()
    carried = {"Authorization": f"Bearer {shown}"} if shown else {}
    if lease is not None and lease.url == url and lease.id:
        carried["Maya-Lease"] = lease.id
    return carried


def _plain(text: str) -> str:
    """Return text that is valid in a header, "" for anything else."""
    line = text.strip()
    return line if line.isascii() and line.isprintable() else ""
