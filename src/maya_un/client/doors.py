"""The address of the service, and the credentials of a client."""

from __future__ import annotations

import os
import ssl
from collections.abc import Callable
from dataclasses import dataclass
from urllib.parse import urlsplit

from maya_un import credentials, runtime
from maya_un.errors import InvalidValue, ServiceNotRunning


@dataclass(frozen=True, slots=True)
class ServiceAddress:
    """The service's address, like "http://127.0.0.1:4133", and what to show there: a token, a control lease.

    Both are "" for none.
    """

    url: str
    token: str = ""
    lease: str = ""


Finder = Callable[[], ServiceAddress]
"""Looks up the address of the service; a restarted `maya up` may have another port."""


def finder(url: str | None, token: str | None) -> Finder:
    """Return what finds the service: at `url`, else $MAYA_URL, else wherever this user's `maya up` runs now.

    The token is `token`, else this user's (`maya_un.credentials`); a lease that was taken in the shell is shown, too.
    Raises `InvalidValue` for what is no http or https address; to find raises `ServiceNotRunning`.
    """
    named = url or os.environ.get("MAYA_URL")
    checked = _checked(named) if named else None

    def find() -> ServiceAddress:
        where = _running() if checked is None else checked
        shown = credentials.token() if token is None else token
        taken = credentials.held()
        return ServiceAddress(where, shown, taken.id if taken is not None and taken.url == where else "")

    return find


def _running() -> str:
    found = runtime.find()
    if found is None:
        raise ServiceNotRunning
    return found.url


def _checked(url: str) -> str:
    try:
        parts = urlsplit(url)
        usable = parts.scheme in {"http", "https"} and bool(parts.hostname) and parts.port != 0
    except ValueError:
        usable = False
    if not usable:
        raise InvalidValue(key="url", value=repr(url), reason="it is like http://127.0.0.1:4133")
    return url.rstrip("/")


def trusted(ca: str | os.PathLike[str] | None) -> ssl.SSLContext:
    """Return what checks the service's certificate: the system's authorities, or those of the file `ca` alone.

    Raises `InvalidValue` for a file that holds none.
    """
    try:
        return ssl.create_default_context(cafile=None if ca is None else os.fspath(ca))
    except OSError as error:
        raise InvalidValue(key="ca", value=repr(ca), reason=error.strerror or str(error)) from error
