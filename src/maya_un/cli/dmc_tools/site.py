"""The plug-in of the tools in `maya dmc`: the configuration, Maya's twin, and the owner of the controller."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from maya_un.cli.settings import OutputSettings

if TYPE_CHECKING:  # every command of `maya` imports this module
    from pathlib import Path

    from dmc41x3.driver import Driver
    from dmc41x3.language.transfer import ProgramSource
    from dmc41x3.twin.wire.server import VirtualController


def guarded(file: str, settings: OutputSettings) -> ProgramSource:
    """Return the program in a file followed by Maya's guard; raises `FileUnreadable` and `GuardBlocked`."""
    from dmc41x3.cli.program import read
    from dmc41x3.language.transfer import program_lines
    from maya_un.cli.configure import configuration
    from maya_un.controller.watchdog_program import merged

    config = configuration(settings)
    letters = "".join(sorted(axis.letter for axis in (config.axes.a, config.axes.b, config.axes.c)))
    source = read(file)
    text = merged(source.text, config.safety.guard_time or type(config.safety)().guard_time, letters)
    return replace(source, lines=program_lines(text))


class MayaSite:
    """The site (`dmc41x3.cli.console.Site`) of the tools in `maya dmc`."""

    command = "maya dmc"
    real = "the controller of the configuration"

    def meant(self, address: str, config: str | None) -> str:
        """Return `address`, or for `real` the one in the configuration; raises `FileUnreadable`, `InvalidConfig`."""
        from dmc41x3.address import meant
        from maya_un.cli.configure import configuration

        return meant(address, configuration(OutputSettings(config=config)).controller.address)

    def twin(self) -> VirtualController:
        """Return the twin of the configuration; raises `FileUnreadable`, `InvalidConfig`."""
        from maya_un.assembly.controller import make_twin
        from maya_un.cli.configure import configuration

        return make_twin(configuration(OutputSettings())).controller

    async def require_free(self, driver: Driver, address: str) -> None:
        """Raise `ControllerOwned` if the controller belongs to another program that still runs."""
        from maya_un.controller.ownership import living_owner
        from maya_un.errors import ControllerOwned

        holder = await living_owner(driver)
        if holder:
            raise ControllerOwned(address=address, holder=holder)

    def history(self) -> Path:
        """Return the path of the command history, beside the log."""
        from maya_un.http.log import log_path

        return log_path().with_name("dmc_history")


MAYA = MayaSite()
"""The site of every command of `maya`."""
