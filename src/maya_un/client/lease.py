"""The control lease as a block: taken at its beginning, renewed while it runs, given back at its end."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager, suppress

from maya_un.client import requests
from maya_un.client.awaiting import AwaitingDriver
from maya_un.client.blocking import BlockingDriver
from maya_un.client.methods import LeaseMethods
from maya_un.client.plans import leasing
from maya_un.client.resources import AsyncResource, Resource
from maya_un.errors import MayaError
from maya_un.schema.people import LeaseTaken


class Lease(LeaseMethods, Resource):
    """The control lease: `with client.lease(note="calibration"): ...` drives while the block runs."""

    def __init__(self, client: BlockingDriver) -> None:
        super().__init__(client)
        self._driver = client

    @contextmanager
    def __call__(self, note: str = "", *, force: bool = False) -> Iterator[LeaseTaken]:
        """Drive while the block runs; with `force` also where somebody else does.

        A thread renews the lease. Once it is lost, the next thing that is asked for inside raises `LeaseLost`, or the
        end of the block does. Raises `LeaseHeld`, `NotAllowed`.
        """
        held = self._driver.held
        taken = self.perform(requests.take_lease(note=note, force=force))
        held.begin(taken.id)
        keeper = self._driver.beside()
        thread = threading.Thread(target=_keep, args=(keeper, taken), name="maya lease", daemon=True)
        thread.start()
        try:
            yield taken
            held.require()
        finally:
            keeper.close()
            thread.join()
            try:
                with suppress(MayaError):  # it is lost, or ends by itself
                    self.perform(leasing.give_back())
            finally:
                held.end()


def _keep(keeper: BlockingDriver, taken: LeaseTaken) -> None:
    with suppress(MayaError):  # the block has ended
        keeper.perform(leasing.kept(keeper.held, taken))


class AsyncLease(LeaseMethods, AsyncResource):
    """The control lease: `async with client.lease(note="calibration"): ...` drives while the block runs."""

    def __init__(self, client: AwaitingDriver) -> None:
        super().__init__(client)
        self._driver = client

    @asynccontextmanager
    async def __call__(self, note: str = "", *, force: bool = False) -> AsyncIterator[LeaseTaken]:
        """Drive while the block runs; with `force` also where somebody else does.

        A task renews the lease. Once it is lost, the next thing that is asked for inside raises `LeaseLost`, or the end
        of the block does. Raises `LeaseHeld`, `NotAllowed`.
        """
        held = self._driver.held
        taken = await self.perform(requests.take_lease(note=note, force=force))
        held.begin(taken.id)
        keeper = asyncio.create_task(self.perform(leasing.kept(held, taken)), name="maya lease")
        try:
            yield taken
            held.require()
        finally:
            keeper.cancel()
            await asyncio.wait({keeper})
            try:
                with suppress(MayaError):  # it is lost, or ends by itself
                    await self.perform(leasing.give_back())
            finally:
                held.end()
