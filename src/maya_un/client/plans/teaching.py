"""Taught poses and pallets, and zones to keep out of. Units are m and rad."""

from __future__ import annotations

from collections.abc import Sequence
from urllib.parse import quote

from maya_un.api.teaching import PalletInfo
from maya_un.client.jobs import Spot
from maya_un.client.steps import Request, get
from maya_un.config.zones import KINDS, AnyZone
from maya_un.errors import UnknownName
from maya_un.process.taught import TaughtPose

_NONE = type(None)


def poses() -> Request[list[TaughtPose]]:
    """Return all poses, in the order in which they were taught."""
    return get("/v1/poses", list[TaughtPose])


def pose(name: str) -> Request[TaughtPose]:
    """Return a pose; raises `NotTaught`."""
    return get(f"/v1/poses/{quote(name)}", TaughtPose)


def teach(name: str, *, replace: bool = False) -> Request[TaughtPose]:
    """Keep where the robot stands under `name`; raises `NameTaken` unless it is to `replace`."""
    return Request("PUT", f"/v1/poses/{quote(name)}", TaughtPose, {"replace": replace})


def forget_pose(name: str) -> Request[None]:
    """Forget a pose; raises `NotTaught`."""
    return Request("DELETE", f"/v1/poses/{quote(name)}", _NONE)


def rename_pose(old: str, new: str) -> Request[TaughtPose]:
    """Give a pose another name; raises `NotTaught`, `NameTaken`."""
    return Request("PATCH", f"/v1/poses/{quote(old)}", TaughtPose, body={"name": new})


def pallets() -> Request[list[PalletInfo]]:
    """Return all pallets, in the order in which they were taught."""
    return get("/v1/pallets", list[PalletInfo])


def pallet(name: str) -> Request[PalletInfo]:
    """Return a pallet; raises `NotTaught`."""
    return get(f"/v1/pallets/{quote(name)}", PalletInfo)


def teach_pallet(
    name: str, corners: Sequence[Spot], rows: int, columns: int, *, replace: bool = False
) -> Request[PalletInfo]:
    """Keep a grid under `name`, spanned by three or four corners: names of poses, or points [m]."""
    plain = [corner if isinstance(corner, str) else list(corner) for corner in corners]
    body = {"corners": plain, "rows": rows, "columns": columns}
    return Request("PUT", f"/v1/pallets/{quote(name)}", PalletInfo, {"replace": replace}, body)


def forget_pallet(name: str) -> Request[None]:
    """Forget a pallet; the poses at its corners stay."""
    return Request("DELETE", f"/v1/pallets/{quote(name)}", _NONE)


def rename_pallet(old: str, new: str) -> Request[PalletInfo]:
    """Give a pallet another name; raises `NotTaught`, `NameTaken`."""
    return Request("PATCH", f"/v1/pallets/{quote(old)}", PalletInfo, body={"name": new})


def zones() -> Request[list[AnyZone]]:
    """Return the zones that the robot keeps out of."""
    return get("/v1/zones", list[AnyZone])


def keep_out(name: str, *, kind: str, **keys: object) -> Request[AnyZone]:
    """Keep out of one more zone for this run: a "box", "cylinder" or "half_space", with its keys as configured.

    Raises `UnknownName` for another kind, `InvalidRequest`, and `Busy` while something moves.
    """
    if kind not in KINDS:
        raise UnknownName(name=kind, known=", ".join(KINDS))
    return Request("PUT", f"/v1/zones/{quote(name)}", KINDS[kind], body={"kind": kind, **keys})


def allow(name: str) -> Request[None]:
    """Keep out of a zone no longer, for this run; raises `NotFound`."""
    return Request("DELETE", f"/v1/zones/{quote(name)}", _NONE)
