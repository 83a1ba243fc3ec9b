"""`dmc capture`: a go-between that writes down what a client and a controller say to each other."""

from __future__ import annotations

import asyncio
import os
from pathlib import Path
from typing import TextIO

from dmc41x3.cli import dial, output
from dmc41x3.cli.dial import Dial
from dmc41x3.cli.settings import OutputSettings
from dmc41x3.cli.signals import asked_to_end
from dmc41x3.errors import AddressInUse, FileUnwritable, MachineError
from dmc41x3.files import open_own, writable_place
from dmc41x3.i18n import translate
from dmc41x3.listening import Listener, listen
from dmc41x3.wire.transcript import Side, WirePiece, header
from dmc41x3.wire.transport import Transport

_PIECE = 65536
"""Most bytes taken at once."""


def capture(address: str, host: str, port: int, out: str, settings: OutputSettings) -> int:
    """Pass bytes between clients on `host`:`port` and a controller, and write them to `out`, until Ctrl-C.

    Prints where it listens. Each client gets a connection of its own to the controller. Only TCP is passed on: what a
    controller sends by UDP goes past. Raises `FileUnwritable` and `AddressInUse`.
    """
    place = dial.meant(address, settings)
    try:
        descriptor = open_own(writable_place(Path(out)), os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666)
        with os.fdopen(descriptor, "w", encoding="utf-8", buffering=1) as file:
            print(header(place), file=file)
            asyncio.run(_capture(place, host, port, file, settings))
    except OSError as error:
        raise FileUnwritable(path=out, reason=error.strerror or str(error)) from error
    return output.DONE


async def _capture(place: str, host: str, port: int, file: TextIO, settings: OutputSettings) -> None:
    async with dial.reached(place, settings.site) as way:
        between = CaptureProxy(way, file)
        try:
            listening = await between.listen(host, port)
            text = translate(
                "Listening on {address} for {controller}. Ctrl-C ends the recording.",
                settings.language,
                address=listening,
                controller=place,
            )
            output.answer({"address": listening, "controller": place}, text, settings)
            await asked_to_end()
        finally:
            await between.close()


class CaptureProxy:
    """Clients on one side, a controller on the other, and a recording of what passes."""

    def __init__(self, dial: Dial, file: TextIO) -> None:
        self._dial = dial
        self._file = file
        self._start = asyncio.get_running_loop().time()
        self._server: Listener | None = None
        self._count = 0
        self._links: set[asyncio.Task[None]] = set()

    async def listen(self, host: str, port: int) -> str:
        """Take clients from now on and return the address; raises `AddressInUse`."""
        try:
            self._server = await listen(host, port, self._connected)
        except OSError as error:
            raise AddressInUse(address=f"{host}:{port}") from error
        name, number = self._server.address
        return f"{name}:{number}"

    def _connected(self) -> asyncio.StreamReaderProtocol:
        return asyncio.StreamReaderProtocol(asyncio.StreamReader(), self._client)

    async def close(self) -> None:
        """Take no more clients and end those there are."""
        if self._server is not None:
            self._server.close()
        for task in tuple(self._links):
            task.cancel()
        if self._links:
            await asyncio.wait(set(self._links))

    async def _client(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._links.add(task)
        self._count += 1
        try:
            await self._carry(self._count, reader, writer)
        except asyncio.CancelledError:
            pass  # the end of the recording is the end of every connection
        finally:
            self._links.discard(task)
            writer.close()

    async def _carry(self, link: int, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._note(link, "client", event="open")
        try:
            controller = await self._dial()
        except MachineError:
            self._note(link, "controller", event="end")
            return
        ways = [
            asyncio.create_task(self._from_client(link, reader, controller)),
            asyncio.create_task(self._from_controller(link, controller, writer)),
        ]
        try:
            await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for way in ways:
                way.cancel()
            await asyncio.wait(ways)
            await controller.close()

    async def _from_client(self, link: int, reader: asyncio.StreamReader, controller: Transport) -> None:
        try:
            while data := await reader.read(_PIECE):
                self._note(link, "client", data)
                controller.write(data)
        except (OSError, MachineError):
            pass  # one side broke off; that it ended is all there is to write down
        self._note(link, "client", event="end")

    async def _from_controller(self, link: int, controller: Transport, writer: asyncio.StreamWriter) -> None:
        try:
            while data := await controller.read():
                self._note(link, "controller", data)
                writer.write(data)
                await writer.drain()
        except (OSError, MachineError):
            pass
        self._note(link, "controller", event="end")

    def _note(self, link: int, side: Side, data: bytes = b"", event: str = "") -> None:
        time = asyncio.get_running_loop().time() - self._start
        print(WirePiece(time, link, side, data, event).line(), file=self._file)
