"""Services that a client calls, and services that a client offers to others."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Callable
from typing import Any

from dmc41x3.i18n import phrase
from maya_ros.graph.protocol import GraphHandle, Message, Request
from maya_ros.rosbridge import outgoing
from maya_ros.rosbridge.client import ROWS, RosbridgeClient, StatusLevel
from maya_ros.rosbridge.incoming import Fields
from maya_ros.rosbridge.limits import LONGEST_MESSAGE, SERVED, SMALLEST_FRAGMENT, UNDER_WAY
from maya_ros.rosbridge.outgoing import COMPRESSIONS
from maya_ros.rosbridge.rosapi import Rosapi
from maya_un.errors import InvalidRequest, MayaError, ServiceFailed
from maya_un.http.log import written_down


class ClientCalls:
    """The calls of one client that are under way."""

    def __init__(self, client: RosbridgeClient, rosapi: Rosapi) -> None:
        self._client = client
        self._rosapi = rosapi
        self._under_way = 0
        self.ops = {"call_service": self.call_service}

    def call_service(self, fields: Fields) -> None:
        """Carry out `call_service`; the answer follows later.

        A refused call that names a service is answered as well, because its caller waits for that.
        """
        call = _Call(self._client, fields)
        try:
            _, service = fields.name("service")
            patience, arguments = call.read(fields), fields.get("args")
            if self._under_way >= UNDER_WAY:
                raise InvalidRequest(
                    key="service", reason=phrase("at most {most} calls of a client may be under way", most=UNDER_WAY)
                )
        except MayaError as error:
            call.fail(error)
            return
        self._under_way += 1
        self._client.spawn(self._carry_out(call, service, arguments, patience), f"call {service}")

    async def _carry_out(self, call: _Call, service: str, arguments: Any, patience: float | None) -> None:
        try:
            async with asyncio.timeout(patience):
                call.answer(await self._answered(service, arguments), done=True)
        except TimeoutError:
            call.fail(
                ServiceFailed(
                    service=service, reason=phrase("it did not answer within {seconds:g} s", seconds=patience)
                )
            )
        except MayaError as error:
            call.fail(error)
        except Exception as defect:  # noqa: BLE001 - a client gets one sentence, the log the rest
            call.fail(written_down(defect))
        finally:
            self._under_way -= 1

    async def _answered(self, service: str, arguments: Any) -> Message:
        request = request_of(arguments)
        question = self._rosapi.question(service)
        if question is not None:
            return await question(request)
        return await self._client.graph.call(service, request)


class _Call:
    """A call of a client, and how to answer it."""

    def __init__(self, client: RosbridgeClient, fields: Fields) -> None:
        """Read the service and id of a message; raises `InvalidRequest`."""
        self._client = client
        self._said = fields.text("service")
        self._name = fields.id
        self._compression = "none"
        self._fragment = 0

    def read(self, fields: Fields) -> float | None:
        """Read the options of the answer, and return the longest wait of the caller [s]; raises `InvalidRequest`.

        The answer is JSON, or a picture of it: rosbridge clients cannot read an answer in CBOR.
        """
        self._compression = "png" if fields.one_of("compression", COMPRESSIONS, "none") == "png" else "none"
        self._fragment = fields.whole("fragment_size", 0, SMALLEST_FRAGMENT, LONGEST_MESSAGE)
        return _patience(fields)

    def answer(self, values: Any, *, done: bool) -> None:
        """Send the answer."""
        message = {"op": "service_response", **({} if self._name is None else {"id": self._name})}
        self._client.say(
            {**message, "service": self._said, "values": values, "result": done},
            self._compression, self._fragment, self._name,
        )  # fmt: skip

    def fail(self, error: MayaError) -> None:
        """Send a failure."""
        self.answer(self._client.words(error), done=False)


def request_of(arguments: Any) -> Request:
    """Return the request from `args`: an object, a list, or nothing; raises `InvalidRequest`."""
    if arguments is None:
        return {}
    if isinstance(arguments, dict | list):
        return arguments
    raise InvalidRequest(key="args", reason="it must be an object, or a list of the values of its fields")


_NEVER = 2**63
"""A timeout must be less [s]: whole numbers of JSON have no limit, and those of the clock have one."""


def _patience(fields: Fields) -> float | None:
    """Return the longest wait of the client [s], None without a limit."""
    found = fields.get("timeout")
    if found is None:
        return None
    if not isinstance(found, int | float) or isinstance(found, bool) or not abs(found) < _NEVER:
        raise InvalidRequest(key="timeout", reason="it must be a number of seconds")
    return float(found) if found > 0.0 else None


_numbers = itertools.count(1)


class _ClientService:
    """One service that a client answers."""

    def __init__(self, client: RosbridgeClient, said: str, service: str, kind: str) -> None:
        self._client = client
        self._said = said
        self._service = service
        self._request = f"{kind}Request"  # ROS alone may know the type; `Graph.serve` refuses unknown types
        self._asked: dict[str, asyncio.Future[Message]] = {}
        self.held: GraphHandle | None = None

    async def answer(self, request: Message) -> Message:
        """Return what the client answers."""
        if len(self._asked) >= UNDER_WAY:
            raise ServiceFailed(service=self._service, reason="too many wait for its answer already")
        name = f"service_request:{self._said}:{next(_numbers)}"
        asked = self._asked[name] = asyncio.get_running_loop().create_future()
        args = outgoing.as_plain(self._request, request)
        self._client.say({"op": "call_service", "id": name, "service": self._said, "args": args})
        try:
            return await asked
        finally:
            del self._asked[name]

    def answered(self, name: Any) -> asyncio.Future[Message]:
        """Return the future of the answer to a request; raises `InvalidRequest`."""
        found = self._asked.get(name) if isinstance(name, str) else None
        if found is None or found.done():
            raise InvalidRequest(key="id", reason="no request of this name waits for an answer")
        return found

    def close(self, reason: str) -> None:
        """Stop serving; requests under way fail with `reason`."""
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
        """Carry out `advertise_service`; a service that another server answers is refused."""
        said, service = fields.name("service")
        kind = fields.kind()
        if len(self._services) >= SERVED:
            raise InvalidRequest(key="service", reason=phrase("a client serves at most {most}", most=SERVED))
        ours = self._services.pop(service, None)
        if ours is not None:
            ours.close(phrase("it was advertised again"))
        if service in ROWS or service in await self._client.graph.directory.service_names():
            raise InvalidRequest(key="service", reason=phrase("{name} is served already", name=service))
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
        one.close(phrase("its server unadvertised it"))
        self._client.tell(StatusLevel.info, f"unadvertised service {said}", fields.id)

    def service_response(self, fields: Fields) -> None:
        """Carry out `service_response`: pass the client's answer to the caller."""
        said, service = fields.name("service")
        one = self._services.get(service)
        if one is None:
            raise InvalidRequest(key="service", reason=phrase("{name} is not served by this client", name=said))
        asked = one.answered(fields.get("id"))
        if fields.flag("result", default=True):
            asked.set_result(fields.record("values"))
        else:
            reason = fields.get("values")
            said_why = reason if isinstance(reason, str) and reason else phrase("its server gave no reason")
            asked.set_exception(ServiceFailed(service=service, reason=said_why[:500]))

    def close(self) -> None:
        """Stop serving all services."""
        for one in self._services.values():
            one.close(phrase("its server disconnected"))
        self._services.clear()
