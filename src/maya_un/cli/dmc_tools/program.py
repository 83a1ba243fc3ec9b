"""`maya dmc upload` and `maya dmc download`: the program of a controller, to a file and back."""

from __future__ import annotations

import asyncio
import sys
from dataclasses import replace
from pathlib import Path

from dmc41x3 import files
from dmc41x3.driver import Driver
from dmc41x3.language.codes import ErrorCode
from dmc41x3.language.program import split
from dmc41x3.language.source import ProgramSource, prepared
from maya_un.cli import output
from maya_un.cli.configure import configuration
from maya_un.cli.dmc_tools import dial
from maya_un.cli.settings import OutputSettings
from maya_un.controller.guard_program import merged
from maya_un.errors import (
    CommandRejected,
    FileUnreadable,
    InvalidValue,
    MayaError,
    ProgramDiffers,
    ProgramLost,
    ProgramRuns,
)


def upload(address: str, file: str | None, settings: OutputSettings) -> int:
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


def download(address: str, file: str, source: ProgramSource, label: str | None, settings: OutputSettings) -> int:
    """Replace the controller's program by `source` of `file`, and run it from `label` (`` is line 0; None: not).

    Raises `InvalidValue`, `ControllerOwned`, and as `load`.
    """
    start = None if label is None else _start(label)
    asyncio.run(_download(dial.meant(address, settings), source.text, start))
    return output.answer(
        {"file": file, "lines": len(source.lines), "changes": list(source.changes), "started": start},
        f"{file}: {told(source)}{'' if start is None else f', {start}'}",
        settings,
    )


def told(source: ProgramSource) -> str:
    """Return a text with the number of downloaded lines and the changes made before."""
    return "; ".join((f"{lines(source.text)} downloaded", *source.changes))


def _start(label: str) -> str:
    name = label.removeprefix("#")
    if name and not (name.isascii() and name.isalnum() and len(name) <= 7):
        raise InvalidValue(key="--run", value=repr(label), reason="a label has up to 7 letters or digits")
    return f"XQ #{name}" if name else "XQ"


async def _download(place: str, text: str, start: str | None) -> None:
    async with dial.opened(place) as driver:
        await dial.require_free(driver, place)
        await load(driver, text)
        if start is not None:
            await driver.send(start)


async def load(driver: Driver, text: str) -> None:
    """Replace the controller's program; restore the former one if the controller refuses the new one.

    Raises `ProgramRuns`, `ProgramLost`, and as the driver does.
    """
    before = await _kept(driver)
    try:
        await driver.download(text)
    except (CommandRejected, ProgramDiffers) as refused:
        if refused.details.get("tc") == ErrorCode.NOT_WHILE_PROGRAM_RUNS:
            raise ProgramRuns from refused
        await _put_back(driver, before, refused)
        raise


async def _kept(driver: Driver) -> str | None:
    """Return the program in the controller, None if it is locked."""
    try:
        return await driver.upload()
    except CommandRejected:
        return None


async def _put_back(driver: Driver, before: str | None, refused: MayaError) -> None:
    if before is None:
        raise ProgramLost(reason=str(refused)) from refused
    try:
        await driver.download(before)
    except (CommandRejected, ProgramDiffers, InvalidValue) as error:
        raise ProgramLost(reason=str(refused)) from error


def guarded(file: str, settings: OutputSettings) -> ProgramSource:
    """Return the program in a file with Maya's guard behind it; raises `FileUnreadable` and `GuardBlocked`."""
    config = configuration(settings)
    letters = "".join(sorted(axis.letter for axis in (config.axes.a, config.axes.b, config.axes.c)))
    source = read(file)
    text = merged(source.text, config.safety.guard_time or type(config.safety)().guard_time, letters)
    return replace(source, lines=split(text))


def read(file: str) -> ProgramSource:
    """Return the program in a file, made ready for a controller; raises `FileUnreadable`."""
    path = Path(file)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise FileUnreadable(path=path, reason=error.strerror or str(error)) from error
    source = prepared(_decoded(data))
    for number, line in enumerate(source.lines):
        if not line.isascii():
            reason = (
                f"line {number} has characters outside its comment that are not ASCII; a controller accepts only ASCII"
            )
            raise FileUnreadable(path=path, reason=reason)
    return source


def _decoded(data: bytes) -> str:
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def write(path: Path, text: str) -> None:
    """Write a program to a file; raises `FileUnwritable`."""
    files.write(path, text, encoding="ascii")


def lines(text: str) -> str:
    """Return how long a program is, in words."""
    count = len(text.splitlines())
    return f"{count} line" if count == 1 else f"{count} lines"
