"""The paths of the flight recorder's files."""

from __future__ import annotations

from fastapi import Response
from starlette.responses import FileResponse

from maya_un.api.access.operations import Operation
from maya_un.api.service import Service
from maya_un.errors import FileUnwritable, NotFound
from maya_un.schema.robot import Kept
from maya_un.server.asking import Ask
from maya_un.server.exchange import answer
from maya_un.server.routes import AT_REST, Routes

_TAG = "recordings"
_MCAP = "application/vnd.mcap"


def add_recordings(routes: Routes) -> None:
    """Add the paths."""

    @routes.add("GET", "/v1/recordings", Operation.READ, tag=_TAG, gives=list[Kept], client="recordings.all")
    async def recordings(ask: Ask) -> Response:
        """Return the recordings that are kept, newest first."""

        async def listed(service: Service) -> list[Kept]:
            return service.recorder.list()

        return answer(await ask(listed))

    @routes.add(
        "POST",
        "/v1/recordings",
        Operation.RECORD,
        tag=_TAG,
        gives=Kept,
        status=201,
        refuses=(FileUnwritable,),
        client="recordings.save",
        patience=AT_REST,
    )
    async def save_recording(ask: Ask) -> Response:
        """Save the last minutes as a recording now."""
        return answer(await ask(lambda service: service.recorder.save(ask.caller)), 201)

    @routes.add(
        "GET", "/v1/recordings/{name}", Operation.RECORD, tag=_TAG, gives=bytes, media=_MCAP, refuses=(NotFound,)
    )
    async def recording(ask: Ask, name: str) -> Response:
        """Return the file of a recording (MCAP)."""

        async def found(service: Service) -> FileResponse:
            return FileResponse(service.recorder.path(name), media_type=_MCAP, filename=name)

        return await ask(found)
