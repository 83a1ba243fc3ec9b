"""The origin policy: host names, web pages that may send commands, and request rates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from ipaddress import ip_address
from urllib.parse import SplitResult, urlsplit

from dmc41x3.i18n import phrase
from maya_un.errors import InvalidRequest, InvalidValue, MayaError


@dataclass(frozen=True, slots=True)
class Rate:
    """A rate limit: `per_second` requests in the long run, and `burst` at once."""

    per_second: float
    burst: float

    def times(self, factor: float) -> Rate:
        """Return a rate limit that is `factor` times as high."""
        return Rate(factor * self.per_second, factor * self.burst)


LOOPBACK = frozenset({"localhost", "127.0.0.1", "::1"})
"""Names of this computer's loopback interface."""

NEAR = Rate(500.0, 2000.0)
"""Rate limit of the clients on this computer."""

FAR = Rate(50.0, 200.0)
"""Rate limit of each other address."""

CLIENTS_EACH = 16
"""Number of clients behind one other address that the limits allow for. A client is a program, or a page in a browser.
"""

FILES = NEAR
"""Rate limit of each other address for files of pages, which are sent from memory and count for no other limit."""


@dataclass(frozen=True, slots=True)
class OriginPolicy:
    """Host names and web pages that are allowed besides clients on this computer that use a loopback name.

    With `remote`, the service is open to other computers: then IP addresses and `hosts` are allowed names, too. In a
    browser, pages of the service itself and of `origins` (like https://panel.example.org) may send commands. The limits
    of one other address are the rate `far`, `files` for files of pages, and its number of stream readers, `readers`.
    """

    remote: bool = False
    hosts: frozenset[str] = frozenset()
    origins: frozenset[str] = frozenset()
    near: Rate = NEAR
    far: Rate = FAR
    files: Rate = FILES
    readers: int = CLIENTS_EACH

    def refusal(self, headers: Mapping[str, str]) -> MayaError | None:
        """Return the error for a forbidden Host or Origin header, None if both are allowed.

        Otherwise a page of another site could reach the service through a browser with access, under that site's host
        name. Another port of this computer is another site: anything may listen there, like a page of a notebook.
        """
        host = _split(f"//{headers.get('host', '')}")
        if host is None or not self._is_ours(host.hostname or ""):
            reason = phrase("it is not a name of this machine's loopback")
            if self.remote:
                reason = phrase("it is no name of this robot; `maya up --origin URL` adds one")
            return InvalidRequest(key="Host", reason=reason)
        origin = headers.get("origin")
        if origin is not None and not self._may_command(origin, host):
            reason = phrase("pages of another address or port may not use the robot; `maya up --origin URL` allows one")
            return InvalidRequest(key="Origin", reason=reason)
        return None

    def _is_ours(self, name: str) -> bool:
        if name in LOOPBACK or name in self.hosts:
            return True
        return self.remote and _is_address(name)

    def _may_command(self, origin: str, host: SplitResult) -> bool:
        page = _split(origin)
        if page is None or not page.netloc:
            return False
        return origin in self.origins or page.netloc.lower() == host.netloc.lower()


def origin_of(url: str) -> str:
    """Return the origin in a URL in the form that a browser sends; raises `InvalidValue` if the URL has other parts."""
    page = _split(url)
    plain = page is not None and page.scheme in {"http", "https"} and page.hostname
    if page is None or not plain or page.path.strip("/") or page.query or page.fragment or page.username:
        raise InvalidValue(
            key="--origin", value=url, reason="it must be the origin of a web page, like https://panel.example.org"
        )
    return f"{page.scheme}://{page.netloc.lower()}"


def host_of(origin: str) -> str:
    """Return the host name in an origin."""
    return urlsplit(origin).hostname or ""


def _is_address(name: str) -> bool:
    try:
        ip_address(name)
    except ValueError:
        return False
    return True


def _split(url: str) -> SplitResult | None:
    try:
        found = urlsplit(url)
        _ = found.hostname, found.port
    except ValueError:  # unbalanced brackets, or an invalid port
        return None
    return found
