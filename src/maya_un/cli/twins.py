"""The files by which `maya dmc fault` finds the virtual controllers that `maya dmc serve` runs."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

from maya_un import runtime
from maya_un.errors import TwinNotFound


class ServedTwin(NamedTuple):
    """A virtual controller that runs: where it listens, the port of its door for faults, its process."""

    host: str
    port: int
    control: int
    pid: int

    @property
    def address(self) -> str:
        """Where it listens, as people write it."""
        return f"{self.host}:{self.port}"


@contextmanager
def published(twin: ServedTwin) -> Iterator[None]:
    """Let others find a twin while the block runs; raises `FileUnwritable`."""
    name = _name(twin.pid)
    runtime.write(name, twin._asdict())
    try:
        yield
    finally:
        with suppress(OSError):
            (runtime.folder() / name).unlink()


def served() -> list[ServedTwin]:
    """Return the twins whose process still runs, by address."""
    return sorted(twin for path in runtime.folder().glob(_name("*")) if (twin := _read(path)) is not None)


def chosen(address: str | None) -> ServedTwin:
    """Return the twin at HOST:PORT or at PORT, with None the only one; raises `TwinNotFound`."""
    twins = served()
    fitting = [twin for twin in twins if address in {None, twin.address, str(twin.port)}]
    if len(fitting) == 1:
        return fitting[0]
    running = ", ".join(twin.address for twin in twins) or "none"
    unnamed = "several run" if twins else "none runs"
    raise TwinNotFound(reason=unnamed if address is None else f"none listens at {address}", running=running)


def _name(pid: int | str) -> str:
    return f"twin-{pid}.json"


def _read(path: Path) -> ServedTwin | None:
    found = runtime.read(path)
    try:
        twin = ServedTwin(str(found["host"]), int(found["port"]), int(found["control"]), int(found["pid"]))
        os.kill(twin.pid, 0)
    except (KeyError, TypeError, ValueError, OSError):
        return None
    return twin
