"""`dmc upload` and `dmc download`: the program of a controller, to a file and back."""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path

from dmc41x3 import files
from dmc41x3.cli import connection, console
from dmc41x3.cli.console import OutputSettings, Site
from dmc41x3.driver import Driver
from dmc41x3.errors import (
    CodedError,
    CommandRejected,
    FileUnreadable,
    InvalidValue,
    ProgramDiffers,
    ProgramLost,
    ProgramRuns,
)
from dmc41x3.i18n import phrase
from dmc41x3.language.codes import ErrorCode
from dmc41x3.language.transfer import ProgramSource, prepared


def upload(address: str, file: str | None, settings: OutputSettings) -> int:
    """Write the controller's program to `file`, or to the screen without one; return the exit code.

    Raises `FileUnwritable` and the driver's errors.
    """
    text = asyncio.run(_upload(connection.meant(address, settings), settings.site))
    if file is not None:
        write(Path(file), text)
        return console.answer({"file": file, "lines": text.count("\n")}, f"{file}: {lines(text)}", settings)
    if settings.json:
        console.emit({"program": text})
    else:
        sys.stdout.write(text)
    return console.DONE


async def _upload(place: str, site: Site) -> str:
    async with connection.opened(place, site) as driver:
        return await driver.upload()


def download(address: str, file: str, source: ProgramSource, label: str | None, settings: OutputSettings) -> int:
    """Replace the controller's program by `source` of `file`; run it from `label` ("" is line 0) unless that is None.

    Raises `InvalidValue`, `ControllerOwned`, and the errors of `load`.
    """
    start = None if label is None else _start(label)
    asyncio.run(_download(connection.meant(address, settings), source.text, start, settings.site))
    return console.answer(
        {"file": file, "lines": len(source.lines), "changes": list(source.changes), "started": start},
        f"{file}: {told(source)}{'' if start is None else f', {start}'}",
        settings,
    )


def told(source: ProgramSource) -> str:
    """Return a text with the number of downloaded lines and the changes made before the download."""
    return "; ".join((f"{lines(source.text)} downloaded", *source.changes))


def _start(label: str) -> str:
    name = label.removeprefix("#")
    if name and not (name.isascii() and name.isalnum() and len(name) <= 7):
        raise InvalidValue(key="--run", value=repr(label), reason="a label has up to 7 letters or digits")
    return f"XQ #{name}" if name else "XQ"


async def _download(place: str, text: str, start: str | None, site: Site) -> None:
    async with connection.opened(place, site) as driver:
        await site.require_free(driver, place)
        await load(driver, text)
        if start is not None:
            await driver.send(start)


async def load(driver: Driver, text: str) -> None:
    """Replace the controller's program; restore the former one if the controller refuses the new one.

    Raises `ProgramRuns`, `ProgramLost`, and the driver's errors.
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


async def _put_back(driver: Driver, before: str | None, refused: CodedError) -> None:
    if before is None:
        raise ProgramLost(reason=str(refused)) from refused
    try:
        await driver.download(before)
    except (CommandRejected, ProgramDiffers, InvalidValue) as error:
        raise ProgramLost(reason=str(refused)) from error


def read(file: str) -> ProgramSource:
    """Return the program in a file, prepared for a controller; raises `FileUnreadable`."""
    path = Path(file)
    source = prepared(_decoded(files.read_bytes(path)))
    for number, line in enumerate(source.lines):
        if not line.isascii():
            reason = phrase(
                "line {number} has characters outside its comment that are not ASCII; a controller accepts only ASCII",
                number=number,
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
    """Return the number of lines of a program as text."""
    count = len(text.splitlines())
    return f"{count} line" if count == 1 else f"{count} lines"
