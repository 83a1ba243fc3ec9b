"""Routes of the calibration: measured points, and the fit of the constants to them."""

from __future__ import annotations

from typing import Annotated

from fastapi import Path, Query, Response

from maya_un.errors import (
    Busy,
    FileUnreadable,
    FileUnwritable,
    InvalidValue,
    NotConnected,
    NotFound,
    NotHomed,
    NotIdentifiable,
    TakesTooLong,
    TooMuchAsked,
    UnknownName,
    WorkerFailed,
)
from maya_un.http.exchange import answer, sent
from maya_un.http.request_context import Ask
from maya_un.http.routing import AT_REST, Routes
from maya_un.schema.calibration import CalibrationFit, CalibrationView, FitRequest, MeasuredPoint
from maya_un.schema.encoding import MOST
from maya_un.service.access.operations import Operation
from maya_un.values import Point

PointBody = Annotated[MeasuredPoint, sent(MeasuredPoint)]
FitBody = Annotated[FitRequest, sent(FitRequest, optional=True)]
Row = Annotated[int, Path(ge=1, le=MOST, description="row of a point")]
Seen = Annotated[
    list[float],
    Query(max_length=3, description="the coordinates [m] that you have read in this row; another point stays"),
]

_CALIBRATION = "calibration"
_FILE = (NotFound, FileUnreadable, InvalidValue)
_WRITING = (*_FILE, FileUnwritable)
_COMPUTING = (TooMuchAsked, TakesTooLong, WorkerFailed)


def add_calibration(routes: Routes) -> None:
    """Add the routes of the calibration."""
    add = routes.add

    @add("GET", "/v1/calibration", Operation.READ, tag=_CALIBRATION, gives=CalibrationView, refuses=_FILE)
    async def calibration(ask: Ask) -> Response:
        """Return the measured points, and the last fit to them in this run."""
        return answer(await ask(lambda service: service.calibration.view()))

    @add("DELETE", "/v1/calibration", Operation.CALIBRATE, tag=_CALIBRATION, gives=CalibrationView, refuses=_WRITING)
    async def clear_calibration(ask: Ask) -> Response:
        """Remove all measured points; their file is kept with the ending .old."""
        return answer(await ask(lambda service: service.calibration.clear()))

    @add(
        "POST",
        "/v1/calibration/points",
        Operation.CALIBRATE,
        tag=_CALIBRATION,
        gives=CalibrationView,
        status=201,
        refuses=(*_WRITING, NotConnected, NotHomed, Busy),
        examples={"measured with a total station": {"point": [1.1023, 0.6931, 0.8127]}},
    )
    async def add_calibration_point(ask: Ask, body: PointBody) -> Response:
        """Add a point that you have measured at the present position of the robot; the robot is homed and at rest."""
        return answer(await ask(lambda service: service.calibration.add(Point(*body.point))), 201)

    @add(
        "DELETE",
        "/v1/calibration/points/{row}",
        Operation.CALIBRATE,
        tag=_CALIBRATION,
        gives=CalibrationView,
        refuses=_WRITING,
    )
    async def remove_calibration_point(ask: Ask, row: Row, measured: Seen = []) -> Response:  # noqa: B006
        """Remove a measured point; the rows of the others stay.

        Send `measured` of the point that you have read: if another point is in its row now, the error is 4004 NotFound.
        """
        return answer(await ask(lambda service: service.calibration.remove(row, measured)))

    @add(
        "POST",
        "/v1/calibration/fit",
        Operation.CALIBRATE,
        tag=_CALIBRATION,
        gives=CalibrationFit,
        refuses=(*_FILE, UnknownName, NotIdentifiable, *_COMPUTING),
        examples={"keep what is known": {"hold": ["delta"]}},
        patience=AT_REST,
    )
    async def fit_calibration(ask: Ask, body: FitBody) -> Response:
        """Fit the constants of the machine to the measured points, and return them; nothing is changed.

        `toml` of the answer goes into the configuration file; `maya calibrate FILE --apply` writes it.
        """
        return answer(await ask(lambda service: service.calibration.fit(body.hold or (), ask.caller)))
