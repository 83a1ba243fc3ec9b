"""Callers: authentication by token or password, roles, and limits on failed attempts.

Failed attempts to sign in are counted by source; all addresses of one computer are one source. A token is written as
`maya_<id>_<secret>`. The id is public and identifies the token; the secret is shown once. Secrets are hashed by argon2.
A hash takes tens of milliseconds and megabytes: it is computed outside the loop, at most two at a time.
"""

from __future__ import annotations

import asyncio
import hashlib
import hmac
import re
import secrets
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace
from ipaddress import IPv6Address, ip_address
from math import ceil
from typing import TYPE_CHECKING, NamedTuple, NoReturn

from dmc41x3.i18n import phrase
from maya_un.errors import MayaError, NotSignedIn, TooManyRequests
from maya_un.service.access.operations import BYSTANDER, LOCAL, Caller, Operation, allowed
from maya_un.service.access.users import Calendar, OnChange, Token, User, UserRegistry

if TYPE_CHECKING:
    from argon2 import PasswordHasher

LOOPBACK = "127.0.0.1"
"""The common name of all loopback addresses of this computer."""


def counted(source: str) -> str:
    """Return the source of an address; text after a space is ignored.

    All of 127.0.0.0/8 and ::1 are this computer. An IPv6 address stands for its /64, because one computer may use all
    of its addresses. An IPv4 address in IPv6 form is that IPv4 address. A text that is not an address is unchanged.
    """
    text, space, rest = source.partition(" ")
    try:
        address = ip_address(text.partition("%")[0])
    except ValueError:
        return source
    if isinstance(address, IPv6Address) and address.ipv4_mapped is not None:
        address = address.ipv4_mapped
    if address.is_loopback:
        return LOOPBACK + space + rest
    return (address.exploded[:19] if isinstance(address, IPv6Address) else str(address)) + space + rest


LIMIT = 10
"""Maximum number of failed attempts of one source within `WINDOW`."""

WINDOW = 60.0
"""Duration for which a failed attempt counts [s, real time]."""

_MOST_SOURCES = 10_000


class Attempts:
    """Counts attempts by source; `scale` is the speed of the loop's clock relative to real time.

    An attempt counts from its start, so that simultaneous attempts are limited, too.
    """

    def __init__(self, scale: float = 1.0) -> None:
        self._scale = max(1.0, scale)
        self._by_source: dict[str, deque[float]] = {}

    def begin(self, source: str, now: float) -> None:
        """Count an attempt at `now` [s, loop time]; raises `TooManyRequests`."""
        source = counted(source)
        window = WINDOW * self._scale
        past = self._by_source.pop(source, None) or deque[float]()
        self._by_source[source] = past
        while past and past[0] <= now - window:
            past.popleft()
        if len(past) >= LIMIT:
            wait = ceil((past[0] + window - now) / self._scale)
            raise TooManyRequests(limit=LIMIT, seconds=f"{WINDOW:.0f}", wait=wait)
        past.append(now)
        if len(self._by_source) > _MOST_SOURCES:
            del self._by_source[next(iter(self._by_source))]

    def succeeded(self, source: str) -> None:
        """Discard the latest attempt, which succeeded."""
        source = counted(source)
        past = self._by_source.get(source)
        if past:
            past.pop()
        if not past:
            self._by_source.pop(source, None)


PREFIX = "maya"
_FORM = re.compile(r"maya_([0-9a-f]{8})_([0-9a-f]{48})", re.ASCII)
_SCHEME = "bearer"


class PresentedToken(NamedTuple):
    """The two parts of a token as a client sends it: the public `id` and the `secret`."""

    id: str
    secret: str

    @property
    def text(self) -> str:
        """The whole token."""
        return f"{PREFIX}_{self.id}_{self.secret}"


def new() -> PresentedToken:
    """Return a random token of 192 bits."""
    return PresentedToken(secrets.token_hex(4), secrets.token_hex(24))


def parse(text: str) -> PresentedToken | None:
    """Return the parts of a token, None for an invalid text."""
    found = _FORM.fullmatch(text)
    return None if found is None else PresentedToken(found[1], found[2])


def of_header(authorization: str | None) -> str | None:
    """Return the token in the header `Authorization: Bearer …`, None if it contains none."""
    scheme, _, rest = (authorization or "").strip().partition(" ")
    return rest.strip() or None if scheme.lower() == _SCHEME else None


def hidden(text: str) -> str:
    """Return a text in which the secrets of tokens are masked, for a log."""
    return _FORM.sub(r"maya_\1_…", text)


MEMORY = 12 * 1024
"""Memory of one hash [KiB]; with three passes, one of the settings of OWASP's cheat sheet on password storage."""

PASSES = 3


class Hasher:
    """Creates and checks argon2id hashes.

    Tests use less `memory` [KiB] and fewer `passes`; the hashes are compatible.
    """

    def __init__(self, memory: int = MEMORY, passes: int = PASSES) -> None:
        self._memory = memory
        self._passes = passes
        self._made: PasswordHasher | None = None
        self._nobodys = ""
        self._turn = asyncio.Lock()
        self._ahead = asyncio.Lock()

    async def hashed(self, secret: str) -> str:
        """Return the hash of a secret, with its salt and cost in it."""
        async with self._turn:
            return await asyncio.get_running_loop().run_in_executor(None, self.hash_now, secret)

    async def matches(self, hashed: str, secret: str, *, ahead: bool = False) -> bool:
        """Return whether `hashed` is the hash of `secret`; for "", return False after the same time.

        A check that is `ahead` does not wait for other checks.
        """
        async with self._ahead if ahead else self._turn:
            return await asyncio.get_running_loop().run_in_executor(None, self._matches_now, hashed, secret)

    def hash_now(self, secret: str) -> str:
        """Return the hash of a secret; blocks the calling thread."""
        return self._hasher().hash(_bytes(secret))

    def _matches_now(self, hashed: str, secret: str) -> bool:
        from argon2.exceptions import Argon2Error, InvalidHashError  # noqa: PLC0415 - loaded at the first sign-in

        try:
            return self._hasher().verify(hashed or self._nobody(), _bytes(secret)) and hashed != ""
        except (Argon2Error, InvalidHashError):
            return False

    def _hasher(self) -> PasswordHasher:
        from argon2 import PasswordHasher  # noqa: PLC0415 - loaded at the first sign-in

        if self._made is None:
            self._made = PasswordHasher(time_cost=self._passes, memory_cost=self._memory, parallelism=1)
        return self._made

    def _nobody(self) -> str:
        """Return a hash that belongs to no user, of the usual cost."""
        if not self._nobodys:
            self._nobodys = self.hash_now("")
        return self._nobodys


def _bytes(secret: str) -> bytes:
    """Return a secret as bytes, even if it contains a lone surrogate."""
    return secret.encode("utf-8", "surrogatepass")


FAILURE_COSTS = 0.5
"""Additional time of a failed attempt compared with a successful one [s, real time]."""

_MOST_KNOWN = 4096

OnRefused = Callable[[str, str], None]
"""Called with the name ("" if unknown) and the source of a failed attempt."""


def _unheard(_name: str, _source: str) -> None:
    """Do nothing."""


class Callers:
    """Identifies callers by the `register` of users and tokens. Call it in the stack's loop.

    A verified token is recognised by a keyed hash, without argon2, until it is revoked or expires. `speed` is the speed
    of the loop's clock relative to real time.
    """

    def __init__(
        self,
        register: UserRegistry,
        calendar: Calendar,
        *,
        speed: float = 1.0,
        hasher: Hasher,
        refused: OnRefused = _unheard,
    ) -> None:
        self._register = register
        self._calendar = calendar
        self._scale = max(1.0, speed)
        self._hasher = hasher
        self._refused = refused
        self._attempts = Attempts(self._scale)
        self._key = secrets.token_bytes(32)
        self._known: dict[bytes, Token] = {}
        self._looked_at: dict[bytes, asyncio.Future[Token]] = {}

    @property
    def kept(self) -> bool:
        """Whether users exist; without users, a local caller is `LOCAL`, and remote callers are refused."""
        return bool(self._register.users)

    async def resolve(
        self,
        authorization: str | None,
        lease: str,
        source: str,
        loopback: bool,
        *,
        stopping: bool = False,
        alone: Caller = LOCAL,
    ) -> Caller:
        """Return the caller of a request.

        `authorization` and `lease` are the headers `Authorization` and `Maya-Lease` as received ("" or None without
        them). `source` appears in the audit log, and attempts are counted by it. `loopback` is True if the request came
        from this computer and was not forwarded. `stopping` marks a stop or an abort, which needs no token from
        loopback. `alone` is the local caller while no users exist.

        Call this for every request, also on an open websocket: a token may have been revoked meanwhile. Raises
        `NotSignedIn`, and `TooManyRequests` for a source with too many failed attempts.
        """
        if loopback and not self.kept:
            return replace(alone, source=source or alone.source, lease=lease)
        text = of_header(authorization)
        known = None if text is None else self._recalled(text)
        if known is not None:
            return self._caller(known, lease, source)
        if loopback and stopping:
            return replace(BYSTANDER, source=source or BYSTANDER.source)
        if text is None:
            raise NotSignedIn(reason="it has no token" if self.kept else "no users exist yet")
        return self._caller(await self._verified(text, source), lease, source)

    def current(self, caller: Caller) -> Caller:
        """Return a caller with the current role.

        Raises `NotSignedIn` if the token was revoked or has expired, or if users exist and there is no token.
        """
        if not caller.token:
            if self.kept:
                raise NotSignedIn(reason="it has no token")
            return caller
        token = self._register.tokens.get(caller.token)
        if token is None or token.user != caller.name or self._expired(token):
            raise NotSignedIn(reason="this one has expired or was revoked")
        role = self._register.users[token.user].role
        return replace(caller, role=role, implicit=caller.implicit and allowed(role, Operation.LEND))

    def current_of(self, asked: Sequence[Caller]) -> list[Caller | MayaError]:
        """Return each caller with the current role, or the error that ended the caller's rights."""

        def found(caller: Caller) -> Caller | MayaError:
            try:
                return self.current(caller)
            except MayaError as ended:
                return ended

        return [found(one) for one in asked]

    def heard_by(self, listener: OnChange) -> Callable[[], None]:
        """Call `listener` in this loop after each change of users and tokens; return a function that ends this."""
        return self._register.heard_by(listener)

    async def signed_in(self, name: str, password: str, source: str) -> User:
        """Return the user with this name and password.

        Raises `NotSignedIn`, with the same text and after the same time for every cause, and `TooManyRequests`.
        """
        self._attempts.begin(source, self._now())
        user = self._register.users.get(name)
        right = await self._hasher.matches("" if user is None else user.password, password)
        still = self._register.users.get(name)
        if not right or still is None or user is None or still.password != user.password:
            await self._fail("" if user is None else name, source, phrase("the name or the password is wrong"))
        self._attempts.succeeded(source)
        return still

    def know(self, shown: PresentedToken) -> None:
        """Record a new token as verified."""
        self._keep(shown, self._register.tokens[shown.id])

    async def _verified(self, text: str, source: str) -> Token:
        """Return the token of a text not verified before; simultaneous requests with the same text share one check."""
        digest = self._digest(f"{source} {text}")
        looked_at = self._looked_at.get(digest)
        if looked_at is None:
            looked_at = asyncio.ensure_future(self._looked_up(text, source))
            self._looked_at[digest] = looked_at
            looked_at.add_done_callback(lambda done: self._looked_at.pop(digest) and done.exception())
        found = self._valid(await asyncio.shield(looked_at))
        if found is None:
            raise NotSignedIn(reason="it was revoked just now")
        return found

    async def _looked_up(self, text: str, source: str) -> Token:
        shown = parse(text)
        meant = None if shown is None else self._register.tokens.get(shown.id)
        # An existing token has its own count of attempts: those with other tokens do not block a stop.
        counted = source if meant is None else f"{source} {meant.id}"
        self._attempts.begin(counted, self._now())
        found = await self._compared(shown, meant)
        if found is None or shown is None:
            return await self._fail(
                "" if meant is None else meant.user, source, phrase("its token is wrong, expired or revoked")
            )
        self._attempts.succeeded(counted)
        self._keep(shown, found)
        return found

    async def _compared(self, shown: PresentedToken | None, meant: Token | None) -> Token | None:
        """Return the token if its secret is right, else None; takes the same time either way.

        Checks of existing tokens do not wait for those of unknown ones, which must not delay a stop.
        """
        secret = "" if shown is None else shown.secret
        right = await self._hasher.matches("" if meant is None else meant.secret, secret, ahead=meant is not None)
        return self._valid(meant) if right and meant is not None else None

    async def _fail(self, name: str, source: str, reason: str) -> NoReturn:
        self._refused(name, source)
        await asyncio.sleep(FAILURE_COSTS * self._scale)
        raise NotSignedIn(reason=reason)

    def _recalled(self, text: str) -> Token | None:
        """Return the token of a text that was verified before, None if it was not, or is no longer valid."""
        digest = self._digest(text)
        known = self._known.get(digest)
        if known is None:
            return None
        token = self._valid(known)
        if token is None:
            del self._known[digest]
        return token

    def _valid(self, token: Token) -> Token | None:
        """Return the current entry of a token, None if it was revoked or has expired."""
        kept = self._register.tokens.get(token.id)
        return None if kept is None or kept.secret != token.secret or self._expired(kept) else kept

    def _expired(self, token: Token) -> bool:
        return bool(token.expires) and token.expires <= self._calendar.now()

    def _keep(self, shown: PresentedToken, token: Token) -> None:
        self._known[self._digest(shown.text)] = token
        while len(self._known) > _MOST_KNOWN:
            del self._known[next(iter(self._known))]

    def _caller(self, token: Token, lease: str, source: str) -> Caller:
        self._register.used(token, self._calendar.now())
        user = self._register.users[token.user]
        return Caller(user.name, user.role, source, lease, token=token.id)

    def _digest(self, text: str) -> bytes:
        return hmac.digest(self._key, text.encode("utf-8", "surrogatepass"), hashlib.sha256)

    def _now(self) -> float:
        return asyncio.get_running_loop().time()
