"""From what a request shows to who asks: one function for every edge."""

from __future__ import annotations

import asyncio
import hashlib
import hmac
import secrets
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NoReturn

from maya_un.api.access import tokens
from maya_un.api.access.attempts import Attempts
from maya_un.api.access.caller import BYSTANDER, LOCAL, Caller
from maya_un.api.access.hashing import Hasher
from maya_un.api.access.operations import Operation, allowed
from maya_un.api.access.register import Calendar, OnChange, UserRegistry
from maya_un.api.access.store import Token, User
from maya_un.errors import MayaError, NotSignedIn

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
        text = tokens.of_header(authorization)
        known = None if text is None else self._recalled(text)
        if known is not None:
            return self._caller(known, lease, source)
        if loopback and stopping:
            return replace(BYSTANDER, source=source or BYSTANDER.source)
        if text is None:
            raise NotSignedIn(reason="the request has none" if self.kept else "no users are kept yet")
        return self._caller(await self._verified(text, source), lease, source)

    def current(self, caller: Caller) -> Caller:
        """Return a caller with the current role.

        Raises `NotSignedIn` if the token was revoked or has expired, or if users exist and there is no token.
        """
        if not caller.token:
            if self.kept:
                raise NotSignedIn(reason="the request has none")
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

    def know(self, shown: tokens.PresentedToken) -> None:
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
        shown = tokens.parse(text)
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

    async def _compared(self, shown: tokens.PresentedToken | None, meant: Token | None) -> Token | None:
        """Return the token that somebody shows, None where it is not right; takes the same time either way.

        Tokens that there are go ahead of all that is made up: a stop must not wait behind that.
        """
        secret = "" if shown is None else shown.secret
        right = await self._hasher.matches("" if meant is None else meant.secret, secret, ahead=meant is not None)
        return self._valid(meant) if right and meant is not None else None

    async def _fail(self, name: str, source: str) -> NoReturn:
        self._refused(name, source)
        await asyncio.sleep(FAILURE_COSTS * self._scale)
        raise NotSignedIn(reason="what was shown is wrong, has expired or was revoked")

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

    def _keep(self, shown: tokens.PresentedToken, token: Token) -> None:
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
