"""Taught poses and pallets, as messages. Units are m and rad."""

from __future__ import annotations

from dataclasses import dataclass

from maya_un.values import Joints, Point


@dataclass(frozen=True, slots=True)
class TaughtPose:
    """Position of the gripper on the day `taught` (as the one who taught it wrote it; ISO 8601 by ours).

    `joints` (rad, m, m) are what was taught. `point` [m] is what they come to with the constants in force: where
    those have been corrected since, the same lengths of line still lead to the same place of the real table, and the
    point as it was computed then does not. None where lines of these lengths cannot meet.
    """

    name: str
    joints: Joints
    point: Point | None
    taught: str


@dataclass(frozen=True, slots=True)
class PalletInfo:
    """A taught pallet: cells (1, 1), (1, columns), (rows, 1) and (rows, columns) [m], None where they span none now.

    `flatness` is how far its corners lie from a plane [m], `squareness` how far its angles are from right ones
    [rad]; `remarks` say in words what of that, or of its corners, is not as it should be.
    """

    name: str
    rows: int
    columns: int
    corners: tuple[Point, ...] | None
    flatness: float | None
    squareness: float | None
    remarks: tuple[str, ...]
    taught: str
