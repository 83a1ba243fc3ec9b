"""Services that a client answers to others in the graph."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Callable
from typing import Any

from maya_un.errors import InvalidRequest, ServiceFailed
from maya_un.graph.protocol import GraphHandle, Message
from maya_un.rosbridge import forms
from maya_un.rosbridge.client import ROWS, RosbridgeClient, StatusLevel
from maya_un.rosbridge.fields import Fields
from maya_un.rosbridge.limits import SERVED, UNDER_WAY

_numbers = itertools.count(1)


class _ClientService:
    """One service whose answers a client gives."""

    def __init__(self, client: RosbridgeClient, said: str, service: str, kind: str) -> None:
        self._client = client
        self._said = said
        self._service = service
        self._request = f"{kind}Request"  # of a type that only ROS knows as well; `Graph.serve` refuses unknown ones
        self._asked: dict[str, asyncio.Future[Message]] = {}
        self.held: GraphHandle | None = None

    async def answer(self, request: Message) -> Message:
        """Return what the client answers."""
        if len(self._asked) >= UNDER_WAY:
            raise ServiceFailed(service=self._service, reason="too many wait for its answer already")
        name = f"service_request:{self._said}:{next(_numbers)}"
        asked = self._asked[name] = asyncio.get_running_loop().create_future()
        args = forms.as_plain(self._request, request)
        self._client.say({"op": "call_service", "id": name, "service": self._said, "args": args})
        try:
            return await asked
        finally:
            del self._asked[name]

    def answered(self, name: Any) -> asyncio.Future[Message]:
        """Return what waits for the answer to a request; raises `InvalidRequest`."""
        found = self._asked.get(name) if isinstance(name, str) else None
        if found is None or found.done():
            raise InvalidRequest(key="id", reason="no request of this name waits for an answer")
        return found

    def close(self, reason: str) -> None:
        """Answer nothing any more; who waits is told why."""
        if self.held is not None:
            self.held.close()
        for asked in self._asked.values():
            if not asked.done():
                asked.set_exception(ServiceFailed(service=self._service, reason=reason))


class ClientServices:
    """The services that one client answers."""

    def __init__(self, client: RosbridgeClient) -> None:
        self._client = client
        self._services: dict[str, _ClientService] = {}
        self.ops: dict[str, Callable[[Fields], Any]] = {
            "advertise_service": self.advertise_service,
            "unadvertise_service": self.unadvertise_service,
            "service_response": self.service_response,
        }

    async def advertise_service(self, fields: Fields) -> None:
        """Carry out `advertise_service`; what others answer cannot be taken from them."""
        said, service = fields.name("service")
        kind = fields.kind()
        if len(self._services) >= SERVED:
            raise InvalidRequest(key="service", reason=f"a client serves at most {SERVED}")
        ours = self._services.pop(service, None)
        if ours is not None:
            ours.close("it was advertised anew")
        if service in ROWS or service in await self._client.graph.directory.service_names():
            raise InvalidRequest(key="service", reason=f"{service} is served already")
        one = _ClientService(self._client, said, service, kind)
        one.held = self._client.graph.serve(service, kind, one.answer)
        self._services[service] = one
        self._client.tell(StatusLevel.info, f"advertised service {said}", fields.id)

    def unadvertise_service(self, fields: Fields) -> None:
        """Carry out `unadvertise_service`."""
        said, service = fields.name("service")
        one = self._services.pop(service, None)
        if one is None:
            self._client.tell(StatusLevel.warning, f"{said} is not served by this client", fields.id)
            return
        one.close("whoever answered it does so no more")
        self._client.tell(StatusLevel.info, f"unadvertised service {said}", fields.id)

    def service_response(self, fields: Fields) -> None:
        """Carry out `service_response`: hand a client's answer to whoever asked."""
        said, service = fields.name("service")
        one = self._services.get(service)
        if one is None:
            raise InvalidRequest(key="service", reason=f"{said} is not served by this client")
        asked = one.answered(fields.get("id"))
        if fields.flag("result", default=True):
            asked.set_result(fields.record("values"))
        else:
            reason = fields.get("values")
            said_why = reason if isinstance(reason, str) and reason else "its server says so"
            asked.set_exception(ServiceFailed(service=service, reason=said_why[:500]))

    def close(self) -> None:
        """Answer nothing any more."""
        for one in self._services.values():
            one.close("whoever answered it has gone")
        self._services.clear()
