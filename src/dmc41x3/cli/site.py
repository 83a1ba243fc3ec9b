"""The surroundings of the tools: the configured controller, the twin that `sim` means, and the owner of a controller.

`dmc` uses `Alone`; a program that is built on this package has a site of its own.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from dmc41x3.address import REAL
from dmc41x3.errors import InvalidValue

if TYPE_CHECKING:
    from dmc41x3.driver import Driver
    from dmc41x3.twin.wire.server import VirtualController

ADDRESS = "DMC_ADDRESS"
"""The environment variable that names the controller for `real`."""


class Site(Protocol):
    """The facts that the tools ask the program about that they are part of."""

    @property
    def command(self) -> str:
        """The words before the name of a tool on the command line."""
        ...

    def meant(self, address: str, config: str | None) -> str:
        """Return `address`, or for `real` that of the configured controller.

        `config` is the configuration file named on the command line. Raises `InvalidValue`, `InvalidConfig`.
        """
        ...

    def twin(self) -> VirtualController:
        """Make the twin that `sim` means, in the running loop."""
        ...

    async def require_free(self, driver: Driver, address: str) -> None:
        """Raise `ControllerOwned` if the controller belongs to another program that still runs."""
        ...

    def history(self) -> Path:
        """Return the file for the history of the terminal."""
        ...


class Alone:
    """The site of the command `dmc`: the twin is a bench, and no program owns a controller."""

    command = "dmc"

    def meant(self, address: str, config: str | None) -> str:
        """Return `address`, or for `real` the one in $DMC_ADDRESS; raises `InvalidValue` if that is not set."""
        del config
        if address != REAL:
            return address
        named = os.environ.get(ADDRESS, "")
        if not named:
            raise InvalidValue(key="HOST", value=repr(REAL), reason=f"${ADDRESS} does not name a controller")
        return named

    def twin(self) -> VirtualController:
        """Return a DMC-4133 with three servo motors on a bench."""
        from dmc41x3.cli.bench import bench

        return bench(3)

    async def require_free(self, driver: Driver, address: str) -> None:
        """Accept every controller."""

    def history(self) -> Path:
        """Return a file in $XDG_STATE_HOME."""
        state = os.environ.get("XDG_STATE_HOME", "")
        return (Path(state) if state else Path.home() / ".local" / "state") / "dmc41x3" / "history"


ALONE = Alone()
"""The site of every command of `dmc`."""
