"""Look-up of the names in a job: parts, places, cells of pallets, taught poses, in this order.

The job's own names come before taught ones.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from typing import NamedTuple, NoReturn

from maya_un.errors import InvalidJob, InvalidValue, UnknownName
from maya_un.process.cells import EACH, NEXT, CellReference, cell_text, chosen, read_reference
from maya_un.process.job import Job
from maya_un.process.pallet import Cell, Pallet
from maya_un.process.spots import Coordinates, point_of
from maya_un.process.taught import TaughtPlaces
from maya_un.robot.primitives import PRIMITIVES
from maya_un.values import Joints, Point

Recall = Callable[[], TaughtPlaces]
"""Tells what has been taught; asked only for a name that the job does not explain."""


class NamedPlace(NamedTuple):
    """A place and how it is called."""

    point: Point
    name: str


class PalletLoop(NamedTuple):
    """The cell that a loop over the pallet has come to."""

    pallet: str
    cell: Cell


class NameResolver:
    """Finds what the names of one job stand for, and remembers which cells it has used."""

    def __init__(self, job: Job, grasp_height: float, recall: Recall) -> None:
        self._job = job
        self._grasp_height = grasp_height
        self._recall = recall
        self._places = job.place_points(grasp_height)
        self._pallets: dict[str, Pallet] = {}
        self._used: defaultdict[tuple[str, str], set[Cell]] = defaultdict(set)
        self._ahead: dict[tuple[str, str], Iterator[Cell]] = {}

    @cached_property
    def _taught(self) -> TaughtPlaces:
        return self._recall()

    def parts(self) -> dict[str, Point | None]:
        """Return where parts stand at the start: those named, and those on full pallets under their cells' names.

        Raises `InvalidJob` where both are called alike.
        """
        parts: dict[str, Point | None] = {**self._job.part_points(self._grasp_height)}
        for name, grid in self._job.pallets.items():
            if grid.full:
                pallet = self._pallet(name, f"pallets.{name}")
                cells = {cell_text(name, cell): pallet.place(cell) for cell in pallet.cells()}
                for both in sorted(cells.keys() & parts.keys()):
                    raise InvalidJob(key=f"parts.{both}", reason="a cell of a full pallet is called so")
                parts |= cells
        return parts

    @property
    def remarks(self) -> tuple[str, ...]:
        """Remarks about the shapes of the used pallets."""
        pallets = self._pallets.items()
        return tuple(f"{name}: {remark}" for name, pallet in pallets for remark in pallet.shape.remarks)

    def joints(self, name: str, key: str) -> Joints:
        """Return the joints of a taught pose (rad, m, m); raises `UnknownName`."""
        if name not in self._taught.poses:
            raise UnknownName(name=name, known=", ".join(self._taught.poses) or "no taught poses", key=key)
        return self._taught.poses[name].joints

    def cells(self, text: str, key: str) -> tuple[PalletLoop, ...]:
        """Return what a loop goes through; raises `InvalidJob` and `UnknownName`."""
        reference = read_reference(text) or CellReference(text, (None, None))
        if reference.pallet not in self._job.pallets and reference.pallet not in self._taught.pallets:
            known = (*self._job.pallets, *self._taught.pallets)
            raise UnknownName(name=text, known=", ".join(known) or "no pallets", key=key)
        pallet = self._pallet(reference.pallet, key)
        if isinstance(reference.which, str):
            raise InvalidJob(key=key, reason=f"a loop goes through {reference.pallet}, not through {text}")
        found = chosen(reference, pallet)
        if not found:
            raise InvalidJob(key=key, reason=f"there is no {text}: {pallet.extent}")
        return tuple(PalletLoop(reference.pallet, cell) for cell in found)

    def spot(
        self, text: str, parts: Mapping[str, Point | None], loop: PalletLoop | None, key: str, command: str
    ) -> NamedPlace:
        """Return the place that a name stands for in a step `command`, where `parts` are where they are now.

        Raises `UnknownName`, and `InvalidJob` for a part that nobody knows the place of and for a cell that is not
        there.
        """
        if text in self._job.parts:
            return NamedPlace(self._part(text, parts[text], key), text)
        if text in self._places:
            return NamedPlace(self._places[text], text)
        reference = read_reference(text)
        if reference is not None and self._is_pallet(reference.pallet):
            return self._on_pallet(reference, self._cell(reference, loop, key, command), key, command)
        return NamedPlace(self._pose(text, key), text)

    def _on_pallet(self, reference: CellReference, cell: Cell, key: str, command: str) -> NamedPlace:
        self._used[reference.pallet, command].add(cell)
        name = cell_text(reference.pallet, cell)
        try:
            return NamedPlace(self._pallet(reference.pallet, key).place(cell), name)
        except ValueError as error:
            raise InvalidJob(key=key, reason=f"there is no {name}: {error}") from error

    def _part(self, name: str, place: Point | None, key: str) -> Point:
        if place is None:
            raise InvalidJob(key=key, reason=f"nobody knows where {name!r} is since the gripper was opened on it")
        return place

    def _pose(self, name: str, key: str) -> Point:
        if self._is_pallet(name):
            raise InvalidJob(key=key, reason=f"{name} is a pallet; name a cell: {name}[1,1] or {name}[{NEXT}]")
        if name not in self._taught.poses:
            self._unknown(name, key)
        point = self._taught.poses[name].point
        if point is None:
            raise InvalidJob(key=key, reason=f"the lines of {name!r} cannot meet; teach it again")
        return point

    def _unknown(self, name: str, key: str) -> NoReturn:
        pallets = (f"{pallet}[row,column]" for pallet in (*self._job.pallets, *self._taught.pallets))
        known = (*self._job.parts, *self._job.places, *pallets, *self._taught.poses)
        raise UnknownName(name=name, known=", ".join(known) or "no parts and no places", key=key)

    def _is_pallet(self, name: str) -> bool:
        return name in self._job.pallets or name in self._taught.pallets

    def _pallet(self, name: str, key: str) -> Pallet:
        if name not in self._pallets:
            self._pallets[name] = self._spanned(name, key)
        return self._pallets[name]

    def _spanned(self, name: str, key: str) -> Pallet:
        try:
            if name not in self._job.pallets:
                return self._taught.pallet(name, self._grasp_height)
            grid = self._job.pallets[name]
            corners = [self._corner(corner, f"pallets.{name}.corners.{n}") for n, corner in enumerate(grid.corners)]
            return Pallet.spanned(corners, grid.rows, grid.columns)
        except (ValueError, InvalidValue) as error:
            reason = error.details["reason"] if isinstance(error, InvalidValue) else str(error)
            raise InvalidJob(key=f"pallets.{name}" if name in self._job.pallets else key, reason=str(reason)) from error

    def _corner(self, corner: str | Coordinates, key: str) -> Point:
        if not isinstance(corner, str):
            return point_of(corner, self._grasp_height)
        return self._places[corner] if corner in self._places else self._pose(corner, key)

    def _cell(self, reference: CellReference, loop: PalletLoop | None, key: str, command: str) -> Cell:
        name = reference.pallet
        if reference.which == EACH:
            if loop is None or loop.pallet != name:
                raise InvalidJob(key=key, reason=f"{name}[{EACH}] is for the steps of a loop over {name}")
            return loop.cell
        if reference.which == NEXT:
            return self._next(name, key, command)
        cell = reference.cell
        if cell is None:
            raise InvalidJob(key=key, reason=f"a step goes to one cell of {name}; * is for loops")
        return cell

    def _next(self, name: str, key: str, command: str) -> Cell:
        """Return the first cell of a pallet that no step `command` has been to."""
        if PRIMITIVES[command].harmless():
            raise InvalidJob(key=key, reason=f"{name}[{NEXT}] is for pick and place, which count their cells apart")
        pallet = self._pallet(name, key)
        ahead = self._ahead.setdefault((name, command), pallet.cells())
        used = self._used[name, command]
        free = next((cell for cell in ahead if cell not in used), None)
        if free is None:
            raise InvalidJob(key=key, reason=f"all {len(pallet)} cells of {name} have had their {command} already")
        return free
