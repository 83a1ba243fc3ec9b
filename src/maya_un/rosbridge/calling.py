"""Services that a client calls: those of the graph, and rosapi's."""

from __future__ import annotations

import asyncio
from math import isfinite
from typing import Any

from maya_un.errors import InvalidRequest, MayaError, ServiceFailed
from maya_un.graph.protocol import Message, Request
from maya_un.rosbridge.client import RosbridgeClient
from maya_un.rosbridge.fields import Fields
from maya_un.rosbridge.limits import LONGEST_MESSAGE, SMALLEST_FRAGMENT, UNDER_WAY
from maya_un.rosbridge.outgoing import COMPRESSIONS
from maya_un.rosbridge.rosapi import Rosapi
from maya_un.server.crash import written_down


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
                raise InvalidRequest(key="service", reason=f"at most {UNDER_WAY} calls of a client may be under way")
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
            call.fail(ServiceFailed(service=service, reason=f"it did not answer within {patience:g} s"))
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
        """Take a message that names a service and says what it is called; raises `InvalidRequest` for another."""
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
    raise InvalidRequest(key="args", reason="it is an object, or a list of the values of its fields")


def _patience(fields: Fields) -> float | None:
    """Return how long the client wants to wait [s], None for as long as it takes."""
    found = fields.get("timeout")
    if found is None:
        return None
    if not isinstance(found, int | float) or isinstance(found, bool) or not isfinite(found):
        raise InvalidRequest(key="timeout", reason="it is a number of seconds")
    return float(found) if found > 0.0 else None
