"""`maya dmc upload` and `maya dmc download`: the program of a controller, to a file and back."""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path

from maya_un import files
from maya_un.cli import output
from maya_un.cli.configure import configuration
from maya_un.cli.dmc_tools import dial
from maya_un.cli.settings import Settings
from maya_un.controller.guard_program import merged
from maya_un.errors import CommandRejected, FileUnreadable, InvalidValue, ProgramRuns
from maya_un.galil.codes import ErrorCode
from maya_un.galil.driver import Driver


def upload(address: str, file: str | None, settings: Settings) -> int:
    """Write the controller's program to `file`, or to the screen without one; return the exit code.

    Raises `FileUnwritable` and as the driver does.
    """
    text = asyncio.run(_upload(dial.meant(address, settings)))
    if file is not None:
        write(Path(file), text)
        return output.answer({"file": file, "lines": text.count("\n")}, f"{file}: {lines(text)}", settings)
    if settings.json:
        output.emit({"program": text})
    else:
        sys.stdout.write(text)
    return output.DONE


async def _upload(place: str) -> str:
    async with dial.opened(place) as driver:
        return await driver.upload()


def download(address: str, file: str, text: str, label: str | None, settings: Settings) -> int:
    """Replace the controller's program by `text` of `file`, and run it from `label` (`` is line 0; None: not).

    Raises `InvalidValue`, `ProgramDiffers`, and as the driver does.
    """
    start = None if label is None else _start(label)
    asyncio.run(_download(dial.meant(address, settings), text, start))
    begun = "" if start is None else f", {start}"
    return output.answer(
        {"file": file, "lines": text.count("\n"), "started": start},
        f"{file}: {lines(text)} downloaded{begun}",
        settings,
    )


def _start(label: str) -> str:
    name = label.removeprefix("#")
    if name and not (name.isascii() and name.isalnum() and len(name) <= 7):
        raise InvalidValue(key="--run", value=repr(label), reason="a label has up to 7 letters or digits")
    return f"XQ #{name}" if name else "XQ"


async def _download(place: str, text: str, start: str | None) -> None:
    async with dial.opened(place) as driver:
        await load(driver, text)
        if start is not None:
            await driver.send(start)


async def load(driver: Driver, text: str) -> None:
    """Replace the controller's program; raises `ProgramRuns`, and as the driver does."""
    try:
        await driver.download(text)
    except CommandRejected as refused:
        if refused.details["tc"] == ErrorCode.NOT_WHILE_PROGRAM_RUNS:
            raise ProgramRuns from refused
        raise


def guarded(file: str, settings: Settings) -> str:
    """Return the program in a file with Maya's guard behind it; raises `FileUnreadable` and `GuardBlocked`."""
    config = configuration(settings)
    letters = "".join(sorted(axis.letter for axis in (config.axes.a, config.axes.b, config.axes.c)))
    return merged(read(file), config.safety.guard_time or type(config.safety)().guard_time, letters)


def read(file: str) -> str:
    """Return the program in a file; raises `FileUnreadable`."""
    path = Path(file)
    try:
        return path.read_text(encoding="ascii")
    except OSError as error:
        raise FileUnreadable(path=path, reason=error.strerror or str(error)) from error
    except UnicodeDecodeError as error:
        raise FileUnreadable(
            path=path, reason=f"byte {error.start} is not ASCII, and a controller knows no other"
        ) from error


def write(path: Path, text: str) -> None:
    """Write a program to a file; raises `FileUnwritable`."""
    files.write(path, text, encoding="ascii")


def lines(text: str) -> str:
    """Return how long a program is, in words."""
    count = len(text.splitlines())
    return f"{count} line" if count == 1 else f"{count} lines"
