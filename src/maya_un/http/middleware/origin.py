"""The origin policy: host names, web pages that may send commands, and request rates."""

from __future__ import annotations

from dataclasses import dataclass
from ipaddress import ip_address
from math import ceil
from urllib.parse import SplitResult, urlsplit

from starlette.datastructures import Headers

from maya_un.errors import InvalidRequest, InvalidValue, MayaError, TooManyRequests
from maya_un.service.access.attempts import counted

_MOST_SOURCES = 10_000


@dataclass(frozen=True, slots=True)
class Rate:
    """So many requests a second in the long run, and `burst` at once."""

    per_second: float
    burst: float


class Buckets:
    """The buckets of all sources. A source whose bucket is full again is forgotten."""

    def __init__(self, rate: Rate) -> None:
        self._rate = rate
        self._left: dict[str, tuple[float, float]] = {}

    def __len__(self) -> int:
        return len(self._left)

    def take(self, source: str, now: float) -> None:
        """Take one request of `source` at `now` [s, loop time]; raises `TooManyRequests`."""
        name = counted(source)
        burst = self._rate.burst
        left, then = self._left.pop(name, (burst, now))
        left = min(burst, left + (now - then) * self._rate.per_second)
        if left < 1.0:
            self._left[name] = (left, now)
            wait = ceil((1.0 - left) / self._rate.per_second)
            seconds = f"{burst / self._rate.per_second:g}"
            raise TooManyRequests(limit=round(burst), seconds=seconds, wait=wait)
        self._left[name] = (left - 1.0, now)
        if len(self._left) > _MOST_SOURCES:
            del self._left[next(iter(self._left))]  # the source of the oldest request has the most in its bucket


LOOPBACK = frozenset({"localhost", "127.0.0.1", "::1"})
"""Names of this machine's loopback."""

NEAR = Rate(500.0, 2000.0)
"""How often this machine's own clients may ask."""

FAR = Rate(50.0, 200.0)
"""How often each other machine may ask."""


@dataclass(frozen=True, slots=True)
class OriginPolicy:
    """Names and pages that are allowed besides this machine's own clients by a name of loopback.

    `remote` says that the service is open to other machines: then its addresses and `hosts` are allowed names, too.
    Pages of `origins` (like https://panel.example.org) may send commands from a browser.
    """

    remote: bool = False
    hosts: frozenset[str] = frozenset()
    origins: frozenset[str] = frozenset()
    near: Rate = NEAR
    far: Rate = FAR

    def refusal(self, headers: Headers, *, local: bool) -> MayaError | None:
        """Return why a request is refused for how it calls this machine, or for the page it comes from.

        A page from another site could reach the service through a browser that may, under its own host name.
        """
        host = _split(f"//{headers.get('host', '')}")
        if host is None or not self._is_ours(host.hostname or ""):
            reason = "it is not a name of this machine's loopback"
            if self.remote:
                reason = "it is no name of this robot; `maya up --origin URL` adds one"
            return InvalidRequest(key="Host", reason=reason)
        origin = headers.get("origin")
        if origin is not None and not self._may_command(origin, host, local=local):
            reason = "pages from elsewhere may not command the robot; `maya up --origin URL` lets one"
            return InvalidRequest(key="Origin", reason=reason)
        return None

    def _is_ours(self, name: str) -> bool:
        if name in LOOPBACK or name in self.hosts:
            return True
        return self.remote and _is_address(name)

    def _may_command(self, origin: str, host: SplitResult, *, local: bool) -> bool:
        page = _split(origin)
        if page is None or not page.netloc:
            return False
        if origin in self.origins or (local and page.hostname in LOOPBACK):
            return True
        return self.remote and page.netloc == host.netloc


def origin_of(url: str) -> str:
    """Return a page's origin as a browser sends it, of what an administrator wrote; raises `InvalidValue`."""
    page = _split(url)
    plain = page is not None and page.scheme in {"http", "https"} and page.hostname
    if page is None or not plain or page.path.strip("/") or page.query or page.fragment or page.username:
        raise InvalidValue(key="--origin", value=url, reason="it is a page's origin, like https://panel.example.org")
    return f"{page.scheme}://{page.netloc.lower()}"


def host_of(origin: str) -> str:
    """Return the name in an origin."""
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
    except ValueError:  # brackets that do not close, a port that is none
        return None
    return found
