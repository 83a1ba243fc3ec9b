"""Files of the command line, for this user alone: the user's token, and the lease of the shell."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from dmc41x3.files import PRIVATE, unwritable, write
from maya_un import credentials, runtime
from maya_un.service.access import callers


def keep_token(token: str) -> Path:
    """Store a token for all commands of this user, completely or not at all; return its file.

    Raises `FileUnwritable`.
    """
    place = credentials.token_file()
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise unwritable(place, error) from error
    write(place, f"{token}\n", PRIVATE, encoding="ascii")
    return place


def remove_token(void: Collection[str]) -> Path | None:
    """Remove the stored token if its id is in `void`; return its former file, else None.

    Raises `FileUnwritable`.
    """
    place = credentials.token_file()
    try:
        shown = callers.parse(place.read_text(encoding="ascii").strip())
        if shown is None or shown.id not in void:
            return None
        place.unlink()
    except FileNotFoundError:
        return None
    except ValueError:  # not text, so it contains no token of Maya
        return None
    except OSError as error:
        raise unwritable(place, error) from error
    return place


def set_aside() -> Path | None:
    """Rename the file of the stored token, if it exists; return its new path.

    Raises `FileUnwritable`.
    """
    place = credentials.token_file()
    aside = place.with_name(f"{place.name}.old")
    try:
        place.replace(aside)
    except FileNotFoundError:
        return None
    except OSError as error:
        raise unwritable(aside, error) from error
    return aside


def keep_lease(lease: str, url: str) -> None:
    """Store a lease for the commands of this user; raises `FileUnwritable`."""
    runtime.write(credentials.LEASE_FILE, {"id": lease, "url": url})
