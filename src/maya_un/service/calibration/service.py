"""Points of a calibration that people measure at the present position of the robot, and the fit to them."""

from __future__ import annotations

import asyncio
import hashlib
from collections.abc import Callable, Sequence
from math import dist
from pathlib import Path
from typing import TypeVar

import numpy as np

from dmc41x3.files import unwritable
from dmc41x3.i18n import phrase
from maya_un.config import Config
from maya_un.config.files import replace
from maya_un.controller.protocol import Controller
from maya_un.errors import InvalidRequest, InvalidValue, NotFound
from maya_un.kinematics.calibration import FittedConstants, model, named
from maya_un.schema.calibration import CalibrationFit, CalibrationPoint, CalibrationView
from maya_un.service.access.operations import LOCAL, Caller
from maya_un.service.calibration.fit import fit_points
from maya_un.service.calibration.points import (
    Counts,
    PointFile,
    PointNotebook,
    content,
    deviation,
    holds_rows,
    is_there,
    parsed,
    require_same_origin,
)
from maya_un.service.computing import Computing
from maya_un.service.places import at_rest
from maya_un.values import Joints, Point
from maya_un.workers import Workers

T = TypeVar("T")

SAME_POINT = 1e-6
"""Points that are closer than this are the same [m]; files have fewer digits."""

MOST_POINTS = 500
"""Maximum number of points."""


class CalibrationService:
    """Collects measured points in the file at `path`, and fits the constants to them, in `workers` if given.

    The file is that of `maya calibrate collect`, so `maya calibrate FILE --apply` reads it. Without a `path`, every
    method raises `NotFound`; each may raise `FileUnreadable`, and `InvalidValue` for a file with an error.
    """

    def __init__(self, path: Path | None, controller: Controller, config: Config, workers: Workers | None) -> None:
        self._path = path
        self._controller = controller
        self._config = config
        self._computing = Computing(workers)
        self._alone = asyncio.Lock()
        self._fitted: tuple[str, CalibrationFit] | None = None

    async def view(self) -> CalibrationView:
        """Return the points and the last fit to them."""
        return await self._in_thread(self._viewed)

    async def add(self, point: Point) -> CalibrationView:
        """Add a point [m] that was measured at the present position; the robot is homed and at rest.

        Raises `NotConnected`, `NotHomed`, `Busy`, `InvalidValue` for a point that is not plausible, `InvalidRequest`
        if the other points were measured with another configuration or are too many, and `FileUnwritable`.
        """
        self._place()
        deviation(point, self._controller.mechanism.fk(at_rest(self._controller)))
        counts = self._controller.state.counts
        return await self._in_thread(lambda: self._added(counts, point))

    async def remove(self, row: int, measured: Sequence[float] = ()) -> CalibrationView:
        """Remove the point in a row; the rows of the others stay.

        `measured` is the point that the caller has seen there [m]: another one stays. Raises `NotFound` and
        `FileUnwritable`.
        """
        return await self._in_thread(lambda: self._removed(row, measured))

    async def clear(self) -> CalibrationView:
        """Remove all points; their file is kept with the ending .old. Raises `FileUnwritable`."""
        return await self._in_thread(self._cleared)

    async def fit(self, hold: Sequence[str] = (), by: Caller = LOCAL) -> CalibrationFit:
        """Fit the constants to the points, except those to `hold`; nothing is changed.

        Raises `UnknownName`, `NotIdentifiable` if the points do not determine the constants, and with workers
        `TooMuchAsked`, `TakesTooLong` and `WorkerFailed`.
        """
        path, kept = self._place(), [named(name) for name in hold]
        data = await self._in_thread(lambda: _content(path))
        found = await self._computing.value(by, fit_points, data, path, self._config, kept)
        self._fitted = (_digest(data), found)
        return found

    def _place(self) -> Path:
        if self._path is None:
            raise NotFound(what="measured point", number="here")
        return self._path

    async def _in_thread(self, work: Callable[[], T]) -> T:
        """Read and write the file in a worker thread, one request after another."""
        async with self._alone:
            return await asyncio.get_running_loop().run_in_executor(None, work)

    def _viewed(self) -> CalibrationView:
        path = self._place()
        data = _content(path)
        measured = _parsed(data, path, self._config)
        points = () if measured is None else tuple(_points(measured, self._config))
        fit = self._fitted[1] if self._fitted is not None and self._fitted[0] == _digest(data) else None
        return CalibrationView(str(path), points, self._extendable(measured), fit)

    def _extendable(self, measured: PointFile | None) -> bool:
        try:
            if measured is not None:
                require_same_origin(measured, self._place(), self._config)
        except InvalidValue:
            return False
        return True

    def _added(self, counts: Counts, point: Point) -> CalibrationView:
        path = self._place()
        measured = _parsed(_content(path), path, self._config)
        if not self._extendable(measured):
            raise InvalidRequest(key="point", reason="the other points have another configuration; remove them first")
        if measured is not None and len(measured.observations) >= MOST_POINTS:
            raise InvalidRequest(key="point", reason=phrase("there are {most} points already", most=MOST_POINTS))
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            if measured is None:
                path.unlink(missing_ok=True)  # a head without points may be that of another configuration
        except OSError as error:
            raise unwritable(path, error) from error
        PointNotebook(path, self._config).add(counts, point)
        return self._viewed()

    def _removed(self, row: int, seen: Sequence[float]) -> CalibrationView:
        path = self._place()
        data = _content(path)
        measured = _parsed(data, path, self._config)
        if measured is None or not _holds(measured, row, seen):
            raise NotFound(what="measured point", number=row)
        lines = data.decode("utf-8-sig").splitlines()
        lines[row - 1] = f"# removed: {lines[row - 1]}"
        replace(path, "".join(f"{line}\n" for line in lines))
        return self._viewed()

    def _cleared(self) -> CalibrationView:
        path = self._place()
        try:
            if is_there(path):
                path.replace(path.with_name(f"{path.name}.old"))
        except OSError as error:
            raise unwritable(path, error) from error
        return self._viewed()


def _content(path: Path) -> bytes:
    return content(path) if is_there(path) else b""


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def _parsed(data: bytes, path: Path, config: Config) -> PointFile | None:
    """Return the points in the content of a file, None if it has none."""
    if not data or not holds_rows(data.decode("utf-8", errors="replace")):
        return None
    return parsed(data, path, config)


def _holds(measured: PointFile, row: int, seen: Sequence[float]) -> bool:
    """Return whether a row holds a point: the one that somebody has `seen` there [m], or any if that is empty."""
    rows = list(measured.observations.rows)
    if row not in rows:
        return False
    point = measured.observations.points[rows.index(row)]
    return not seen or (len(seen) == len(point) and dist(seen, point) < SAME_POINT)


def _points(measured: PointFile, config: Config) -> list[CalibrationPoint]:
    seen, constants = measured.observations, FittedConstants.of(config)
    joints, expected = model.joints(constants, seen.counts), model.points(constants, seen.counts)
    off = np.linalg.norm(expected - seen.points, axis=1)
    columns = (seen.counts.tolist(), joints.tolist(), seen.points.tolist(), expected.tolist(), off.tolist())
    return [
        CalibrationPoint(row, (a, b, c), Joints(*at), Point(*place), Point(*meant), far)
        for row, (a, b, c), at, place, meant, far in zip(seen.rows, *columns, strict=True)
    ]
