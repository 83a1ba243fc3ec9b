"""Operations of users and tokens, and of the control lease.

Secrets are shown once, when they are created; only their hashes are stored. The control lease can be taken, offered and
released; a held jog ends with it.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from math import isfinite

from dmc41x3.i18n import phrase
from maya_un.errors import InvalidValue, LastAdministrator, NotFound, NotSignedIn, UnknownName
from maya_un.process.lease import LeaseHolder
from maya_un.schema.people import LONGEST, PATIENCE, LeaseTaken, LeaseView, Me, NewToken, TokenLine, UserLine
from maya_un.service.access import callers
from maya_un.service.access.control import AccessControl, require_note
from maya_un.service.access.operations import LOCAL, RESERVED, Caller, Operation, Role, allowed, require
from maya_un.service.access.users import Change, Token, User

SESSION = 12 * 3600.0
"""Duration of a session [s]."""

MOST_TOKENS = 100
"""Maximum number of tokens of one user."""

MOST_SESSIONS = 20
"""Maximum number of sessions of one user; a new one ends the oldest."""

_NAME = re.compile(r"[a-z][a-z0-9._-]{0,31}", re.ASCII)
_DATE = re.compile(
    r"(\d{4}-(?:0[1-9]|1[0-2])-(?:0[1-9]|[12]\d|3[01]))(?:T([01]\d|2[0-3])(:[0-5]\d:[0-5]\d)(?:Z|\+00:00))?", re.ASCII
)
_PASSWORD = range(12, 257)
_DIFFERENT = 5

OnEnded = Callable[[str, str, str], None]
"""Called when a token, or with "" the right of a user to drive, has ended: token, name, reason."""


class UserService:
    """Manages the users of `access`; `ended` is called when rights end."""

    def __init__(self, access: AccessControl, ended: OnEnded) -> None:
        self._register = access.register
        self._callers = access.callers
        self._calendar = access.calendar
        self._hasher = access.hasher
        self._audit = access.audit
        self._ended = ended

    async def me(self, by: Caller) -> Me:
        """Return the caller."""
        return Me(by.name, by.role.word, by.token, by.source, bool(self._register.users))

    async def list(self) -> list[UserLine]:
        """Return all users, by name."""
        return [self._line(user) for _, user in sorted(self._register.users.items())]

    async def add(self, name: str, role: str, password: str | None = None) -> NewToken:
        """Add a user and return the user's first token; the first user must be an administrator.

        Raises `InvalidValue`, `StorageFailed`.
        """
        chosen = Role.of(role)
        checked_name(name)
        hashed = "" if password is None else await self._password(password)
        async with self._register.turn:
            if name in self._register.users:
                raise InvalidValue(key="name", value=repr(name), reason="there is a user of this name")
            if not self._register.users and chosen is not Role.ADMIN:
                raise InvalidValue(key="role", value=repr(role), reason="the first user is an administrator (admin)")
            first = not self._register.users
            made = await self._give(User(name, chosen, self._calendar.now(), hashed), "first", "", new=True)
        if first:
            self._ended("", LOCAL.name, phrase("users exist now"))
        return made

    async def change(
        self, name: str, *, role: str | None = None, password: str | None = None, old: str = "", by: Caller
    ) -> UserLine:
        """Change the role of a user, or the password ("" for none), which ends all sessions.

        Administrators change any user. Others change only their own password, and must give the `old` one, so that a
        stolen token is not sufficient. The last administrator cannot lose this role. Raises `UnknownName`,
        `NotAllowed`, `NotSignedIn` for a wrong old password, `TooManyRequests`, `InvalidValue`, `LastAdministrator`,
        `StorageFailed`.
        """
        if role is not None or name != by.name:
            require(by, Operation.USERS)
        elif password is not None and not allowed(by.role, Operation.USERS):
            await self._callers.signed_in(name, old, by.source)
        chosen = None if role is None else Role.of(role)
        hashed = None if password is None else await self._password(password) if password else ""
        async with self._register.turn:
            user = self._user(name)
            if chosen is not None and chosen is not Role.ADMIN:
                self._require_another_admin(user)
            changed = replace(user, role=chosen or user.role, password=user.password if hashed is None else hashed)
            sessions = () if password is None else tuple(one.id for one in self._register.of(name) if one.session)
            await self._register.change(Change(users=(changed,), without_tokens=sessions))
        for session in sessions:
            self._ended(session, name, phrase("the password was changed"))
        if changed.role < user.role:
            self._ended("", name, phrase("{name} is {role} now", name=name, role=changed.role.word))
        return self._line(changed)

    async def remove(self, name: str) -> None:
        """Remove a user with all tokens; raises `UnknownName`, `StorageFailed`, `LastAdministrator`."""
        async with self._register.turn:
            self._require_another_admin(self._user(name))
            self._ended("", name, phrase("{name} was removed", name=name))
            await self._register.change(Change(without_users=(name,)))

    async def tokens(self, name: str, by: Caller) -> list[TokenLine]:
        """Return the tokens of a user, oldest first; only administrators may read those of others.

        Raises `UnknownName`, `NotAllowed`.
        """
        if name != by.name:
            require(by, Operation.USERS)
        self._user(name)
        return [self._token_line(token) for token in self._register.of(name)]

    async def token(self, name: str, *, note: str = "", expires: str = "", by: Caller) -> NewToken:
        """Create a token for a user; `expires` is a date in UTC, or a date and time, "" for never.

        Administrators create tokens for any user; others for themselves, valid no longer than the token of the request.
        Raises `UnknownName`, `NotAllowed`, `InvalidValue`, `StorageFailed`.
        """
        until = self._date(expires)
        require_note(note)
        if not allowed(by.role, Operation.USERS):
            if name != by.name:
                require(by, Operation.USERS)
            own = self._register.tokens.get(by.token)
            limit = "" if own is None else own.expires
            if limit and (not until or until > limit):
                raise InvalidValue(
                    key="expires", value=repr(expires), reason=phrase("the token shown ends at {limit}", limit=limit)
                )
        async with self._register.turn:
            user = self._user(name)
            if sum(not token.session for token in self._register.of(name)) >= MOST_TOKENS:
                raise InvalidValue(key="tokens", value=MOST_TOKENS, reason="revoke some first")
            return await self._give(user, note, until)

    async def revoke(self, token: str, by: Caller) -> None:
        """Revoke a token at once, by its id; only administrators may revoke those of others.

        Raises `NotFound`, also for a token of another user, and `StorageFailed`; then the token is still invalid until
        the next start.
        """
        async with self._register.turn:
            found = self._register.tokens.get(token)
            if found is None or (found.user != by.name and not allowed(by.role, Operation.USERS)):
                raise NotFound(what="token", number=token)
            self._ended(token, found.user, phrase("its token was revoked"))
            await self._register.change(Change(without_tokens=(token,)))

    async def sign_in(self, name: str, password: str, source: str) -> NewToken:
        """Return a session token; raises `NotSignedIn` for any wrong credential, `TooManyRequests`, `StorageFailed`."""
        user = await self._callers.signed_in(name, password, source)
        async with self._register.turn:
            if self._register.users.get(name) is not user:
                raise NotSignedIn(reason="the user was changed meanwhile")
            sessions = [token.id for token in self._register.of(name) if token.session]
            spare = tuple(sessions[: max(0, len(sessions) - MOST_SESSIONS + 1)])
            made = await self._give(user, source, self._calendar.after(SESSION), session=True, instead_of=spare)
        self._audit.signed_in(name, user.role.word, source)
        return made

    async def sign_out(self, by: Caller) -> None:
        """Revoke the token of the request; raises `NotFound` for a request without one, `StorageFailed`."""
        await self.revoke(by.token, by)

    async def _give(
        self,
        user: User,
        note: str,
        expires: str,
        *,
        session: bool = False,
        new: bool = False,
        instead_of: tuple[str, ...] = (),
    ) -> NewToken:
        """Create a token, store it, and record it as verified."""
        shown = callers.new()
        while shown.id in self._register.tokens:
            shown = callers.new()
        hashed = await self._hasher.hashed(shown.secret)
        token = Token(shown.id, user.name, hashed, note, self._calendar.now(), expires, session=session)
        users = (user,) if new else ()
        await self._register.change(Change(users=users, tokens=(token,), without_tokens=instead_of))
        self._callers.know(shown)
        return NewToken(token.id, user.name, user.role.word, shown.text, note, expires)

    async def _password(self, password: str) -> str:
        if len(password) not in _PASSWORD:
            reason = phrase("it needs {least} to {most} characters", least=_PASSWORD.start, most=_PASSWORD.stop - 1)
            raise InvalidValue(key="password", value="…", reason=reason)
        if len(set(password)) < _DIFFERENT:
            raise InvalidValue(
                key="password",
                value="…",
                reason=phrase("it needs at least {least} different characters", least=_DIFFERENT),
            )
        return await self._hasher.hashed(password)

    def _user(self, name: str) -> User:
        user = self._register.users.get(name)
        if user is None:
            raise UnknownName(name=name, known=", ".join(sorted(self._register.users)) or "none")
        return user

    def _require_another_admin(self, user: User) -> None:
        """Raise `LastAdministrator` if `user` is the only administrator, because no one could reverse the change."""
        admins = [name for name, one in self._register.users.items() if one.role is Role.ADMIN]
        if admins == [user.name]:
            raise LastAdministrator(name=user.name)

    def _date(self, text: str) -> str:
        """Return a date as it is stored; raises `InvalidValue` for an invalid or a past date."""
        found = _DATE.fullmatch(text)
        if text and found is None:
            reason = phrase("it is a date in UTC, like 2027-01-31 or 2027-01-31T12:00:00Z")
            raise InvalidValue(key="expires", value=repr(text), reason=reason)
        date = "" if found is None else f"{found[1]}T{found[2] or '00'}{found[3] or ':00:00'}+00:00"
        if date and date <= self._calendar.now():
            raise InvalidValue(key="expires", value=repr(text), reason="it is past")
        return date

    def _line(self, user: User) -> UserLine:
        mine = [self._token_line(token) for token in self._register.of(user.name)]
        used = max((line.used for line in mine), default="")
        valid = sum(line.valid for line in mine)
        return UserLine(user.name, user.role.word, user.created, bool(user.password), valid, used)

    def _token_line(self, token: Token) -> TokenLine:
        valid = not token.expires or token.expires > self._calendar.now()
        return TokenLine(
            token.id, token.user, token.note, token.created, token.expires, token.used, token.session, valid
        )


def checked_name(name: str) -> str:
    """Return a valid user name; raises `InvalidValue` for an invalid one."""
    if _NAME.fullmatch(name) is None or name in RESERVED:
        reason = phrase(
            "it must have at most 32 characters (a to z, 0 to 9, . _ -), begin with a letter, and not be reserved"
        )
        raise InvalidValue(key="name", value=repr(name), reason=reason)
    return name


class LeaseService:
    """Reads and changes the lease of `access`.

    `halt` stops held jogs: it is called whenever the driver changes.
    """

    def __init__(self, access: AccessControl, halt: Callable[[], None]) -> None:
        self._lease = lease = access.lease
        self._register = access.register
        self._halt = halt
        self._driver = ""
        self._token = ""
        lease.on_change.insert(0, self._changed)

    async def view(self, by: Caller) -> LeaseView:
        """Return the holder of the control lease, its times, offer and request, and whether `by` holds it."""
        lease, holder = self._lease, self._lease.holder
        nobody = LeaseHolder("", "", 0.0)
        shown = holder or nobody
        return LeaseView(
            shown.name,
            shown.source,
            lease.held_for,
            shown.note,
            shown.implicit,
            lease.expires_in,
            lease.offered_to,
            lease.asked_by,
            yours=holder is not None and _shows(by, holder),
        )

    async def take(self, by: Caller, *, note: str = "", patience: float = PATIENCE, force: bool = False) -> LeaseTaken:
        """Take the lease; it lasts while it is renewed within `patience` [s, real time].

        Operators take the free lease; students take one that an operator offers. With `force`, users take their own
        lease again, operators take back a lent one, and administrators take it from anyone; the activity of the former
        driver ends. Raises `LeaseHeld`, `NotAllowed`, `InvalidValue`.
        """
        require_note(note)
        if not (isfinite(patience) and 1.0 <= patience <= LONGEST):
            raise InvalidValue(key="patience", value=patience, reason=phrase("it is 1 s to {most:.0f} s", most=LONGEST))
        holder = self._lease.holder
        again = force and holder is not None and holder.name == by.name and not holder.implicit
        if self._lease.offered_to != by.name and not again:
            require(by, Operation.LEND)
        if force and holder is not None:
            self._require_power(by, holder)
        taken = self._lease.take(by.name, by.source, note=note, patience=patience, force=force)
        self._token = by.token
        return LeaseTaken(taken.id, taken.name, taken.note, patience)

    async def renew(self, by: Caller) -> LeaseView:
        """Renew the lease; raises `LeaseLost`, `LeaseNeeded`, `LeaseHeld`."""
        self._lease.renew(by.lease, by.name)
        return await self.view(by)

    async def release(self, by: Caller, *, lost: bool = False) -> LeaseView:
        """Release the lease, or with `lost` end it as expired, if its holder disconnected. Raises as `renew` does."""
        self._lease.release(by.lease, by.name, lost=lost)
        return await self.view(by)

    async def offer(self, to: str, by: Caller) -> LeaseView:
        """Allow `to` to take the lease within a minute; for its holder, or for an operator while it is free or lent.

        Raises `UnknownName`, `NotAllowed`, and `LeaseHeld` if another user holds it.
        """
        require(by, Operation.LEND)
        holder = self._lease.holder
        if holder is not None and not holder.implicit and not _shows(by, holder):
            self._require_power(by, holder)
        names = self._register.drivers()
        if to not in names:
            raise UnknownName(name=to, known=", ".join(names) or "no users")
        self._lease.offer(to, by.name)
        return await self.view(by)

    async def ask(self, by: Caller) -> LeaseView:
        """Publish that the caller wants to drive."""
        self._lease.ask(by.name)
        return await self.view(by)

    def rights_ended(self, token: str, name: str, why: str) -> None:
        """End the lease of `name`, who may no longer drive; with a `token`, only if the lease was taken with it."""
        if not token or token == self._token:
            self._lease.drop(name, why)

    def _require_power(self, by: Caller, holder: LeaseHolder) -> None:
        """Raise `NotAllowed` if `by` may not take the lease from `holder`."""
        lent = bool(holder.lender) and by.role >= Role.OPERATOR
        if holder.name != by.name and not lent:
            require(by, Operation.BREAK)

    def _changed(self, _why: str) -> None:
        holder = self._lease.holder
        driver = "" if holder is None else holder.name
        if driver != self._driver:
            self._driver = driver
            self._token = ""
            self._halt()


def _shows(by: Caller, holder: LeaseHolder) -> bool:
    return holder.name == by.name and bool(by.lease) and holder.id == by.lease
