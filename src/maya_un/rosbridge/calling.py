"""Services that a client calls: those of the graph, and rosapi's."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from math import isfinite
from typing import Any

from maya_un.errors import InvalidRequest, MayaError, ServiceFailed
from maya_un.graph.protocol import Message
from maya_un.rosbridge.client import Client
from maya_un.rosbridge.fields import Fields
from maya_un.rosbridge.limits import LONGEST_MESSAGE, SMALLEST_FRAGMENT, UNDER_WAY
from maya_un.rosbridge.rosapi import Rosapi
from maya_un.server.crash import written_down


class Calling:
    """The calls of one client that are under way."""

    def __init__(self, client: Client, rosapi: Rosapi) -> None:
        self._client = client
        self._rosapi = rosapi
        self._under_way = 0
        self.ops = {"call_service": self.call_service}

    def call_service(self, fields: Fields) -> None:
        """Carry out `call_service`; its answer comes when it is there."""
        said, service = fields.name("service")
        compression = fields.one_of("compression", ("none", "png"), "none")
        fragment = fields.whole("fragment_size", 0, SMALLEST_FRAGMENT, LONGEST_MESSAGE)
        name, patience, arguments = fields.id, _patience(fields), fields.get("args")

        def answer(values: Any, *, done: bool) -> None:
            message = {"op": "service_response", **({} if name is None else {"id": name})}
            self._client.say(
                {**message, "service": said, "values": values, "result": done}, compression, fragment, name
            )

        def failed(error: MayaError) -> None:
            answer(self._client.words(error), done=False)

        if self._under_way >= UNDER_WAY:
            failed(InvalidRequest(key="service", reason=f"at most {UNDER_WAY} calls of a client may be under way"))
            return
        self._under_way += 1
        self._client.spawn(self._call(service, arguments, patience, answer, failed), f"call {service}")

    async def _call(
        self,
        service: str,
        arguments: Any,
        patience: float | None,
        answer: Callable[..., None],
        failed: Callable[[MayaError], None],
    ) -> None:
        try:
            async with asyncio.timeout(patience):
                answer(await self._answered(service, arguments), done=True)
        except TimeoutError:
            failed(ServiceFailed(service=service, reason=f"it did not answer within {patience:g} s"))
        except MayaError as error:
            failed(error)
        except Exception as defect:  # noqa: BLE001 - a client gets one sentence, the log the rest
            failed(written_down(defect))
        finally:
            self._under_way -= 1

    async def _answered(self, service: str, arguments: Any) -> Message:
        question = self._rosapi.question(service)
        if question is not None:
            return await question(arguments)
        return await self._client.graph.call(service, _request(arguments))


def _request(arguments: Any) -> Message:
    """Return a request of what stands under `args`: an object, nothing, or as older clients send it, in a list."""
    if arguments is None or arguments == []:
        return {}
    if isinstance(arguments, list) and len(arguments) == 1:
        return _request(arguments[0])
    if isinstance(arguments, dict):
        return arguments
    raise InvalidRequest(key="args", reason="it is an object")


def _patience(fields: Fields) -> float | None:
    """Return how long the client wants to wait [s], None for as long as it takes."""
    found = fields.get("timeout")
    if found is None:
        return None
    if not isinstance(found, int | float) or isinstance(found, bool) or not isfinite(found):
        raise InvalidRequest(key="timeout", reason="it is a number of seconds")
    return float(found) if found > 0.0 else None
