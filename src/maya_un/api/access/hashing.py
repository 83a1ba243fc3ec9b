"""Hashes of secrets by argon2: slow on purpose, so that whoever steals the file cannot try words one after the other.

The hash takes tens of milliseconds and megabytes: it is worked out beside the loop, one or two at a time, and never on
it.
"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from argon2 import PasswordHasher

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
        """Tell whether `hashed` is of `secret`; "", which is the hash of nothing, takes as long as any other.

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
