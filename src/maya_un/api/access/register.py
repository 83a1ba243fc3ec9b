"""The register of users and tokens: in memory to be asked, in a store to last."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import replace
from typing import Protocol

from maya_un.api.access.operations import Operation, allowed
from maya_un.api.access.store import Change, Store, Token, User
from maya_un.errors import StorageFailed

_TO_THE_MINUTE = 16

OnChange = Callable[[], None]
"""Called after a change of users or tokens."""


class Calendar(Protocol):
    """The present date: no module below the edges reads a clock. Dates are ISO 8601 in UTC, to the second."""

    def now(self) -> str:
        """Return the date of now."""
        ...

    def after(self, seconds: float) -> str:
        """Return the date in so many seconds."""
        ...


class UserRegistry:
    """Users by name and tokens by id. A caller that reads first and changes then holds `turn` meanwhile.

    A removal takes effect at once, even if it cannot be written; a grant takes effect when it is on the disk.
    """

    def __init__(self, store: Store) -> None:
        self._store = store
        self._used: dict[str, str] = {}
        self.users: dict[str, User] = {}
        self.tokens: dict[str, Token] = {}
        self.turn = asyncio.Lock()
        self._listeners: list[OnChange] = []

    async def open(self) -> None:
        """Read what the store keeps; raises `StorageFailed` and its kin."""
        users, tokens = await self._store.load()
        self.users = {user.name: user for user in users}
        self.tokens = {token.id: token for token in tokens if token.user in self.users}

    async def read_again(self) -> None:
        """Read the store again, because another process may have changed it; raises as `open`."""
        await self.open()
        self._tell()

    def of(self, name: str) -> list[Token]:
        """Return the tokens of a user, oldest first."""
        return [token for token in self.tokens.values() if token.user == name]

    def drivers(self) -> list[str]:
        """Return the names of the users who could drive, in order."""
        return sorted(user.name for user in self.users.values() if allowed(user.role, Operation.LEASE))

    def heard_by(self, listener: OnChange) -> Callable[[], None]:
        """Call `listener` after each change, before other tasks continue; return a function that ends this."""
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener)

    async def change(self, change: Change) -> None:
        """Change users and tokens; raises `StorageFailed`."""
        for name in change.without_users:
            self.users.pop(name, None)
            for token in self.of(name):
                del self.tokens[token.id]
        for key in change.without_tokens:
            self.tokens.pop(key, None)
        if change.without_users or change.without_tokens:
            self._tell()
        used, self._used = self._used, {}
        noted = tuple(token for token in map(self.tokens.get, used) if token is not None)
        await self._store.apply(replace(change, tokens=noted + change.tokens))
        self.users.update({user.name: user for user in change.users})
        self.tokens.update({token.id: token for token in change.tokens})
        if change.users:
            self._tell()

    def _tell(self) -> None:
        for listener in tuple(self._listeners):
            listener()

    def used(self, token: Token, date: str) -> None:
        """Note that a token was shown; it is written with the next change, or at the end."""
        if token.used[:_TO_THE_MINUTE] != date[:_TO_THE_MINUTE] and token.id in self.tokens:
            self.tokens[token.id] = replace(token, used=date)
            self._used[token.id] = date

    async def close(self) -> None:
        """Write when tokens were used last, which is no loss where it cannot be written, and close the store."""
        async with self.turn:
            try:
                if self._used:
                    await self.change(Change())
            except StorageFailed:
                self._used.clear()
            finally:
                await self._store.close()
