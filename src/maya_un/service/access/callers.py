"""Callers: who sends a request, by which token, with which role, and after how many failed attempts.

Failed attempts to sign in, counted by source; all addresses of one machine are one source.

Tokens as they are written: `maya_<id>_<secret>`. The id is public and says which it is; the secret is shown once.

Authentication: from the credentials of a request to its caller, with secrets hashed by argon2.

The hash takes tens of milliseconds and megabytes: it is worked out beside the loop, one or two at a time, and never on
it.
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

from maya_un.errors import MayaError, NotSignedIn, TooManyRequests
from maya_un.service.access.operations import BYSTANDER, LOCAL, Caller, Operation, allowed
from maya_un.service.access.users import Calendar, OnChange, Token, User, UserRegistry

if TYPE_CHECKING:
    from argon2 import PasswordHasher

LOOPBACK = "127.0.0.1"
"""The one name of this machine for all of its loopback addresses."""


def counted(source: str) -> str:
    """Return the source of an address; text after a space is ignored.

    All of 127.0.0.0/8 and ::1 are this machine. An IPv6 address stands for its /64, because one machine may have all
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
"""Failed attempts of one source within `WINDOW`."""

WINDOW = 60.0
"""How long a failed attempt counts [s, real time]."""

_MOST_SOURCES = 10_000


class Attempts:
    """Counts attempts by source; `scale` is how fast the loop's clock runs.

    An attempt counts from its beginning, so that many at a time are not all let in before the first has failed.
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
        """Take the latest attempt back: it was right."""
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
        """The token whole."""
        return f"{PREFIX}_{self.id}_{self.secret}"


def new() -> PresentedToken:
    """Return a token that nobody can guess: 192 random bits."""
    return PresentedToken(secrets.token_hex(4), secrets.token_hex(24))


def parse(text: str) -> PresentedToken | None:
    """Return the parts of a token, None for what is none."""
    found = _FORM.fullmatch(text)
    return None if found is None else PresentedToken(found[1], found[2])


def of_header(authorization: str | None) -> str | None:
    """Return what `Authorization: Bearer …` carries, None where it carries nothing of the kind."""
    scheme, _, rest = (authorization or "").strip().partition(" ")
    return rest.strip() or None if scheme.lower() == _SCHEME else None


def hidden(text: str) -> str:
    """Return a text with the secrets of the tokens in it left out, for a log."""
    return _FORM.sub(r"maya_\1_…", text)


MEMORY = 12 * 1024
"""Memory of one hash [KiB]; with three passes one of the sets that OWASP's cheat sheet on password storage names."""

PASSES = 3


class Hasher:
    """Makes and checks argon2id hashes. Tests pass less `memory` [KiB] and fewer `passes`; they read each other's."""

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
        """Return whether `hashed` is of `secret`; "", which is the hash of nothing, takes as long as any other.

        A check that is `ahead` does not wait for the others.
        """
        async with self._ahead if ahead else self._turn:
            return await asyncio.get_running_loop().run_in_executor(None, self._matches_now, hashed, secret)

    def hash_now(self, secret: str) -> str:
        """Return the hash of a secret; holds whoever calls it for as long as that takes."""
        return self._hasher().hash(_bytes(secret))

    def _matches_now(self, hashed: str, secret: str) -> bool:
        from argon2.exceptions import Argon2Error, InvalidHashError  # noqa: PLC0415 - it is loaded when somebody signs in

        try:
            return self._hasher().verify(hashed or self._nobody(), _bytes(secret)) and hashed != ""
        except (Argon2Error, InvalidHashError):
            return False

    def _hasher(self) -> PasswordHasher:
        from argon2 import PasswordHasher  # noqa: PLC0415 - it is loaded when somebody signs in

        if self._made is None:
            self._made = PasswordHasher(time_cost=self._passes, memory_cost=self._memory, parallelism=1)
        return self._made

    def _nobody(self) -> str:
        """Return a hash that is nobody's, of the same cost as everybody's."""
        if not self._nobodys:
            self._nobodys = self.hash_now("")
        return self._nobodys


def _bytes(secret: str) -> bytes:
    """Return a secret as bytes, also where half a character is in it."""
    return secret.encode("utf-8", "surrogatepass")


FAILURE_COSTS = 0.5
"""How much longer a failed attempt takes than one that is right [s, real time]."""

_MOST_KNOWN = 4096

OnRefused = Callable[[str, str], None]
"""Told the name, "" where it is not known, and the source of a failed attempt."""


def _unheard(_name: str, _source: str) -> None:
    """Tell nobody."""


class Callers:
    """Tells who asks, from the `register` of users and tokens. Lives in the stack's loop: call it there.

    A token that was found right is known again at once, by a keyed hash of it, until it is revoked or expires.
    `speed` is how fast the loop's clock runs.
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
        """Whether users are kept; while none are, who sits at the machine is `LOCAL` and nobody else is let in."""
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
        """Return who asks.

        `authorization` and `lease` are the headers `Authorization` and `Maya-Lease` as they came ("" or None where they
        did not), `source` is shown in the audit log and counted by, `loopback` says that it came from this machine and
        from nobody behind it. With `stopping` it is for a stop or an abort, which from loopback needs no token.
        `alone` is the principal of this machine while no users exist.

        Call this for every request, on an open websocket too: a token may have been revoked meanwhile. Raises
        `NotSignedIn`, and `TooManyRequests` for a source that was wrong too often.
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
        """Return each caller with the current role, or the error if the rights have ended."""

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
        """Return the user whose password this is.

        Raises `NotSignedIn`, the same and after the same time whatever was wrong, and `TooManyRequests`.
        """
        self._attempts.begin(source, self._now())
        user = self._register.users.get(name)
        right = await self._hasher.matches("" if user is None else user.password, password)
        still = self._register.users.get(name)
        if not right or still is None or user is None or still.password != user.password:
            await self._fail("" if user is None else name, source)
        self._attempts.succeeded(source)
        return still

    def know(self, shown: PresentedToken) -> None:
        """Take a token that was just made for right."""
        self._keep(shown, self._register.tokens[shown.id])

    async def _verified(self, text: str, source: str) -> Token:
        """Return the token of a text that was not seen before; several requests that show it wait for one answer."""
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
        # An existing token has attempts of its own: those of others do not block a stop.
        counted = source if meant is None else f"{source} {meant.id}"
        self._attempts.begin(counted, self._now())
        found = await self._compared(shown, meant)
        if found is None or shown is None:
            return await self._fail("" if meant is None else meant.user, source)
        self._attempts.succeeded(counted)
        self._keep(shown, found)
        return found

    async def _compared(self, shown: PresentedToken | None, meant: Token | None) -> Token | None:
        """Return the token that somebody shows, None where it is not right; takes the same time either way.

        Tokens that there are go ahead of all that is made up: a stop must not wait behind that.
        """
        secret = "" if shown is None else shown.secret
        right = await self._hasher.matches("" if meant is None else meant.secret, secret, ahead=meant is not None)
        return self._valid(meant) if right and meant is not None else None

    async def _fail(self, name: str, source: str) -> NoReturn:
        self._refused(name, source)
        await asyncio.sleep(FAILURE_COSTS * self._scale)
        raise NotSignedIn(reason="its token is wrong, expired or revoked")

    def _recalled(self, text: str) -> Token | None:
        """Return the token of a text that was found right before, None where it was not, or is right no more."""
        digest = self._digest(text)
        known = self._known.get(digest)
        if known is None:
            return None
        token = self._valid(known)
        if token is None:
            del self._known[digest]
        return token

    def _valid(self, token: Token) -> Token | None:
        """Return a token as it is now, None where it was revoked or has expired."""
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
