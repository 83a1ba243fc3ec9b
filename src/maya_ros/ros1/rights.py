"""The rights of a node: ROS 1 has no sign-in, so the node's token makes all its clients one principal.

The file that $MAYA_GRAPH_TOKEN_FILE names holds the token. A ROS parameter is unsuitable: every node of the graph can
set it. Users are read from the state folder, whichever process writes them.
"""

from __future__ import annotations

import asyncio
import logging
import os
from collections.abc import AsyncGenerator, Callable, Sequence
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path

from dmc41x3.i18n import phrase
from maya_ros.graph.access import Guest, TokenChecker
from maya_un import credentials
from maya_un.config.state_folder import queue_file
from maya_un.errors import FileUnreadable, MayaError, NotSignedIn
from maya_un.http import dates
from maya_un.service.access.callers import Callers, Hasher
from maya_un.service.access.operations import BYSTANDER, ROS, RULES, STOPPING, Caller, Operation, allowed, require
from maya_un.service.access.users import ReadOnlyStore, UserRegistry

TOKEN_FILE = "MAYA_GRAPH_TOKEN_FILE"
"""The variable that names the file with the token of the graph."""

LOOK_AGAIN = 1.0
"""Period of the check whether users have changed [s, real time]."""

_log = logging.getLogger("maya_ros.graph")

_NOBODY = replace(BYSTANDER, name=ROS.name, source=ROS.source)
_NO_TOKEN = phrase(
    "users exist, but the nodes of this ROS graph have none; start them with ${variable}", variable=TOKEN_FILE
)


class GraphRights:
    """The present rights of a graph with `token` ("": none), according to `callers`."""

    def __init__(self, callers: Callers, token: str) -> None:
        self._callers = callers
        self._token = token
        self._caller: Caller | None = None
        self._why: MayaError = NotSignedIn(reason=_NO_TOKEN)

    async def look(self) -> None:
        """Resolve the token again."""
        if not self._token or not self._callers.kept:
            return
        try:
            found = await self._callers.resolve(f"Bearer {self._token}", "", ROS.source, loopback=True)
        except MayaError as refusal:
            self._caller, self._why = None, refusal
        else:
            self._caller = found

    def permit(self, operation: Operation) -> None:
        """Raise `NotSignedIn` or `NotAllowed` if the graph may not request an operation.

        Requests in a graph carry no lease, so operations that drive need a role that may take the lease.
        """
        if operation in STOPPING or not self._callers.kept:
            return
        if self._caller is None:
            raise self._why
        caller = self._callers.current(self._caller)
        require(caller, operation)
        if RULES[operation].drives:
            require(caller, Operation.LEND)

    async def who(self) -> Caller:
        """Return the principal of the graph at a gate; without one, a principal that may only stop."""
        if not self._callers.kept:
            return ROS
        try:
            caller = self._callers.current(self._caller or _NOBODY)
        except MayaError:
            return _NOBODY
        return replace(caller, implicit=allowed(caller.role, Operation.LEND))


class FolderTokenChecker:
    """Users and tokens of the state folder, read only; a `guest.TokenChecker`."""

    def __init__(self, speed: float) -> None:
        self._store = ReadOnlyStore(queue_file())
        self._register = UserRegistry(self._store)
        self._speed = max(1.0, speed)
        self.callers = Callers(self._register, dates, speed=speed, hasher=Hasher())

    async def open(self) -> None:
        """Read them; raises `StorageDamaged` and related errors."""
        await self._register.read_again()

    async def follow(self) -> None:
        """Read them again after every change of the file, until cancelled; after an error, keep the former ones."""
        while True:
            await asyncio.sleep(LOOK_AGAIN * self._speed)
            if await self._store.changed():
                try:
                    await self._register.read_again()
                except MayaError as error:
                    context = {"message": f"users were not read again: {error}"}
                    asyncio.get_running_loop().call_exception_handler(context)

    async def caller(
        self,
        authorization: str | None,
        lease: str,
        source: str,
        *,
        loopback: bool,
        stopping: bool,
        alone: Caller = ROS,
    ) -> Caller:
        """Return the caller of a token; see `Callers.resolve`."""
        return await self.callers.resolve(authorization, lease, source, loopback, stopping=stopping, alone=alone)

    async def current(self, asked: Sequence[Caller]) -> list[Caller | MayaError]:
        """Return each caller with the current role, or the error if the rights have ended."""
        return self.callers.current_of(asked)

    def heard_by(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call `listener` after each change; return a function that ends this."""
        return self.callers.heard_by(listener)


@asynccontextmanager
async def looked(speed: float = 1.0) -> AsyncGenerator[FolderTokenChecker]:
    """Yield the users of the state folder, which are read again after each change while the block runs.

    `speed` is how fast the loop's clock runs. Raises `StorageDamaged` and related errors.
    """
    found = FolderTokenChecker(speed)
    await found.open()
    following = asyncio.create_task(found.follow(), name="follow stored users")
    try:
        yield found
    finally:
        following.cancel()
        await asyncio.gather(following, return_exceptions=True)


@asynccontextmanager
async def graph_rights(callers: Callers) -> AsyncGenerator[GraphRights]:
    """Yield the rights of the graph, which follow each change of users and tokens while the block runs.

    Raises `FileUnreadable` if the named file holds no token, or other users can read it.
    """
    rights = GraphRights(callers, token_of_graph())
    await rights.look()
    news = asyncio.Event()
    end = callers.heard_by(news.set)

    async def follow() -> None:
        while True:
            await news.wait()
            news.clear()
            await rights.look()

    following = asyncio.create_task(follow(), name="rights of the graph")
    try:
        yield rights
    finally:
        end()
        following.cancel()
        await asyncio.gather(following, return_exceptions=True)


@asynccontextmanager
async def rights_of_node(speed: float) -> AsyncGenerator[GraphRights]:
    """Yield the rights of the graph for a node that stores no users; raises as `looked` and `graph_rights` do."""
    async with looked(speed) as users, graph_rights(users.callers) as rights:
        yield rights


@asynccontextmanager
async def graph_guest(users: TokenChecker, source: str) -> AsyncGenerator[Guest]:
    """Yield the guest that all clients of an edge without sign-in are; its rights are those of the graph's token.

    They follow each change of users and tokens while the block runs. Raises `FileUnreadable` as `graph_rights` does.
    """
    guest, token = Guest(source), token_of_graph() or None
    news = asyncio.Event()
    news.set()

    async def follow() -> None:
        while await news.wait():
            news.clear()
            try:
                await guest.introduce(users, token)
            except MayaError as refusal:
                _log.warning("clients of %s may only stop the robot: %s %s", source, refusal.code, refusal)

    end = users.heard_by(news.set)
    following = asyncio.create_task(follow(), name=f"rights of {source}")
    try:
        yield guest
    finally:
        end()
        following.cancel()
        await asyncio.gather(following, return_exceptions=True)


def token_of_graph() -> str:
    """Return the token of the graph, "" if no file is named; raises `FileUnreadable`."""
    named = os.environ.get(TOKEN_FILE)
    if not named:
        return ""
    found = credentials.kept_in(Path(named))
    if not found:
        reason = phrase("it must belong to this user, be unreadable for others (chmod 600), and hold a token")
        raise FileUnreadable(path=named, reason=reason)
    return found
