"""Pallets and zones as the users of a client write them. Units are m."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from maya_un.client import requests
from maya_un.client.request import Request
from maya_un.client.targets import Spot, plain

if TYPE_CHECKING:
    from maya_un.config.zones import AnyZone
    from maya_un.schema.places import PalletInfo


def teach_pallet(
    name: str, corners: Sequence[Spot], rows: int, columns: int, *, replace: bool = False
) -> Request[PalletInfo]:
    """Keep a grid under `name`, spanned by three or four corners: names of poses, or points [m]."""
    grid = {"corners": [plain(corner) for corner in corners], "rows": rows, "columns": columns}
    return requests.teach_pallet(name, grid, replace=replace)


def keep_out(name: str, *, kind: str, **keys: object) -> Request[AnyZone]:
    """Keep out of one more zone for this run: a "box", "cylinder" or "half_space", with its keys as configured.

    Raises `InvalidRequest` for another kind or a wrong key, and `Busy` while something moves.
    """
    return requests.put_zone(name, {"kind": kind, **keys})
