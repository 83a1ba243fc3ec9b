"""The database behind both protocols: the tree, who may what, and who listens."""

from __future__ import annotations

import base64
import json
import secrets
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from tests.secrecy import MARK, secret
from tests.system.rtdb.rules import Rules
from tests.system.rtdb.tree import Change, Path, Query, Tree, applied, at, exported

OWNER = "owner"
"""The token of the admin libraries when they talk to an emulator; it may do everything."""

TOKEN_LASTS = 3600


class DeniedError(Exception):
    """The rules do not allow this."""


class BadTokenError(Exception):
    """A token that is none, or no longer."""


@dataclass(frozen=True, slots=True)
class Caller:
    """The caller: `auth` as rules see it, None without a sign-in; the owner is above the rules."""

    auth: Mapping[str, Any] | None = None
    owner: bool = False
    token: str = ""


Deliver = Callable[[str, Path, Any], None]
"""Takes an event: put or patch with a path below the listener's and data, cancel, or auth_revoked."""


@dataclass(eq=False, slots=True)
class Listener:
    """A subscriber to changes at a path."""

    path: Path
    query: Query
    caller: Caller
    deliver: Deliver


@dataclass(slots=True)
class Store:
    """One database. `rules` None: everybody may do everything. `secret` is its database secret."""

    rules: Rules | None = None
    secret: str = field(default_factory=lambda: secret(secrets.token_hex(8)))
    users: dict[str, str] = field(default_factory=dict)
    tree: Tree = None
    listeners: list[Listener] = field(default_factory=list)
    revoked: set[str] = field(default_factory=set)
    writes: list[tuple[Path, Any]] = field(default_factory=list)
    written: Callable[[], object] = lambda: None

    def now(self) -> int:
        """Return the server's time [ms]."""
        return time.time_ns() // 1_000_000

    def read(self, path: Path, caller: Caller, query: Query | None = None) -> Tree:
        """Return what stands at a path; raises `DeniedError`."""
        if not self._may_read(path, caller):
            raise DeniedError
        return (query or Query()).of(at(self.tree, path))

    def write(self, path: Path, changes: Sequence[Change], caller: Caller, *, merge: bool) -> None:
        """Make changes together, at or below a path; raises `DeniedError`, `BadDataError`."""
        now = self.now()
        new = applied(self.tree, changes, now)
        if self.rules is not None and not caller.owner:
            for place, _ in changes:
                if not self.rules.may_write(place, caller.auth, self.tree, new, now):
                    raise DeniedError
        old, self.tree = self.tree, new
        self.writes.extend((place, exported(at(new, place))) for place, _ in changes)
        self.written()
        for listener in tuple(self.listeners):
            _tell(listener, old, new, path, [place for place, _ in changes], merge=merge)

    def listen(self, listener: Listener) -> Tree:
        """Begin to tell somebody; returns what stands there now; raises `DeniedError`."""
        tree = self.read(listener.path, listener.caller, listener.query)
        self.listeners.append(listener)
        return tree

    def leave(self, listener: Listener) -> None:
        """Tell somebody no longer."""
        if listener in self.listeners:
            self.listeners.remove(listener)

    def set_rules(self, rules: Rules | None) -> None:
        """Change the rules; notify readers who have lost their access."""
        self.rules = rules
        for listener in tuple(self.listeners):
            if not self._may_read(listener.path, listener.caller):
                self.leave(listener)
                listener.deliver("cancel", (), None)

    def sign_in(self, uid: str, lasts: float = TOKEN_LASTS, **claims: Any) -> str:
        """Return a new ID token of a user."""
        begun = int(time.time())
        payload = {"sub": uid, "user_id": uid, "iat": begun, "exp": begun + int(lasts), "jti": secrets.token_hex(8)}
        return ".".join((_part({"alg": "none", "typ": "JWT"}), _part({**payload, **claims}), MARK))

    def revoke_all(self) -> None:
        """Make every token that somebody uses invalid now, as when its hour is over."""
        for listener in tuple(self.listeners):
            if listener.caller.token not in {"", OWNER}:
                self.revoked.add(listener.caller.token)
                self.leave(listener)
                listener.deliver("auth_revoked", (), "credential is no longer valid")

    def caller(self, token: str) -> Caller:
        """Return whose token this is; raises `BadTokenError`."""
        if not token:
            return Caller()
        if token in {OWNER, self.secret}:
            return Caller(owner=True, token=token)
        if token in self.revoked:
            raise BadTokenError("Auth token is expired")
        try:
            payload = token.split(".")[1]
            claims = json.loads(base64.urlsafe_b64decode(payload + "=" * (-len(payload) % 4)))
            uid = str(claims.get("sub") or claims["user_id"])
        except (IndexError, KeyError, ValueError) as error:
            raise BadTokenError("Could not parse auth token.") from error
        if claims.get("exp", time.time() + 1) < time.time():
            raise BadTokenError("Auth token is expired")
        return Caller({"uid": uid, "provider": "password", "token": claims}, token=token)

    def _may_read(self, path: Path, caller: Caller) -> bool:
        return self.rules is None or caller.owner or self.rules.may_read(path, caller.auth, self.tree, self.now())


def _tell(listener: Listener, old: Tree, new: Tree, path: Path, places: Sequence[Path], *, merge: bool) -> None:
    """Tell a listener what changed for it."""
    here = listener.path
    if listener.query != Query():
        before, after = (listener.query.of(at(tree, here)) for tree in (old, new))
        if before != after:
            listener.deliver("put", (), exported(after))
        return
    if merge and path[: len(here)] == here:
        data = {"/".join(place[len(path) :]): exported(at(new, place)) for place in places}
        listener.deliver("patch", path[len(here) :], data)
        return
    for place in places:
        if place[: len(here)] == here:
            listener.deliver("put", place[len(here) :], exported(at(new, place)))
        elif here[: len(place)] == place and at(old, here) != at(new, here):
            listener.deliver("put", (), exported(at(new, here)))


def _part(data: object) -> str:
    return base64.urlsafe_b64encode(json.dumps(data).encode()).decode().rstrip("=")
