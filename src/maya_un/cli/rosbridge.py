"""The rosbridge endpoint of `maya up`: its port, whom it lets in, where it keeps what was carried out."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from maya_un.cli.remote import RemoteAccess
from maya_un.server.doors import bound_socket

if TYPE_CHECKING:
    from maya_un.rosbridge.alone import EndpointOptions

STEPS = "steps.db"
"""The file beside the queue's in which steps of others' processes are kept."""


@contextmanager
def rosbridge_at(port: int | None, journal: Path | None, remote: RemoteAccess) -> Iterator[EndpointOptions | None]:
    """Yield where the endpoint is to be served, on loopback only, or None without a port.

    Without a `journal` what it keeps ends with the block. Raises `AddressInUse` and `InvalidValue`.
    """
    if port is None:
        yield None
        return
    from maya_un.rosbridge.alone import EndpointOptions

    with bound_socket(port) as door, TemporaryDirectory(prefix="maya-steps-") as folder:
        steps = (Path(folder) if journal is None else journal.parent) / STEPS
        yield EndpointOptions(door, replace(remote.edge(), remote=False), steps)


def url_of(place: EndpointOptions) -> str:
    """Return the URL of the endpoint."""
    host, port = place.door.getsockname()[:2]
    return f"ws://{host}:{port}"
