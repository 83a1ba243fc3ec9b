"""Checks of the running service, as its client: the robot, the queue and the control lease."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from http.client import HTTPConnection, HTTPException
from typing import Any, cast
from urllib.parse import urlsplit

from maya_un import __version__, runtime
from maya_un.cli.client import ServiceClient
from maya_un.client import requests
from maya_un.client.request import Request
from maya_un.errors import MayaError
from maya_un.http.doctor.finding import Finding, fail, ok, skipped, warn
from maya_un.http.doctor.robot import lease, queue, readiness, robot

PATIENCE = 3.0
"""Longest wait for each answer [s]."""


class RunningService:
    """The running service, after it has answered."""

    def __init__(self, running: runtime.Running, client: ServiceClient, language: str) -> None:
        self.running = running
        self._client = client
        self._language = language

    def ask(self, request: Request[Any]) -> dict[str, Any]:
        """Return an answer; raises as `ServiceClient.ask`."""
        answer = self._client.ask(request, timeout=PATIENCE)
        return cast("dict[str, Any]", answer) if isinstance(answer, dict) else {}

    def findings(self) -> Iterator[Finding]:
        """Yield the results of all checks of the service."""
        yield ok("service", "service_runs", pid=self.running.pid, url=self.running.url)
        for look in (self._readiness, self._robot, self._lease, self._queue):
            try:
                yield from look()
            except MayaError as error:
                yield warn("service", "service_refuses", message=error.text(self._language))
                return

    def _readiness(self) -> Iterator[Finding]:
        status = None
        with suppress(MayaError):  # the check of the robot reports a refusal
            status = self.ask(requests.status())
        yield from readiness(_reasons(self.running.url, self._language), status)

    def _robot(self) -> Iterator[Finding]:
        status = self.ask(requests.status())
        yield _version(str(status["version"]))
        yield from robot(status, self.ask(requests.datum()))

    def _lease(self) -> Iterator[Finding]:
        yield from lease(self.ask(requests.lease()))

    def _queue(self) -> Iterator[Finding]:
        yield from queue(self.ask(requests.queue()))


def found(language: str) -> tuple[RunningService | None, list[Finding]]:
    """Return the running service, or the reason why it cannot be checked."""
    running = runtime.find()
    if running is None:
        return None, [skipped("service", "service_none")]
    try:
        client = ServiceClient(running.url, PATIENCE)
        ours = _marked(client)
    except MayaError:
        return None, [fail("service", "service_gone", pid=running.pid, url=running.url)]
    except (OSError, HTTPException) as error:
        if isinstance(error, ConnectionRefusedError):
            return None, [fail("service", "service_gone", pid=running.pid, url=running.url)]
        reason = str(error) or type(error).__name__
        return None, [fail("service", "service_hangs", pid=running.pid, url=running.url, reason=reason)]
    if not ours or runtime.serving() is None:
        return None, [fail("service", "service_stranger", url=running.url)]
    return RunningService(running, client, language), []


def _marked(client: ServiceClient) -> bool:
    """Return whether the answer comes from Maya: every answer of Maya has the header `Maya`."""
    connection = HTTPConnection(client.host, client.port, timeout=PATIENCE)
    try:
        connection.request("GET", requests.health().path)
        return connection.getresponse().headers["Maya"] is not None
    finally:
        connection.close()


def _reasons(url: str, language: str) -> list[str]:
    """Return the reasons why commands are refused, as text."""
    import json

    place = urlsplit(url)
    connection = HTTPConnection(place.hostname or "127.0.0.1", place.port or 80, timeout=PATIENCE)
    with suppress(OSError, HTTPException, ValueError, KeyError, TypeError):
        connection.request("GET", requests.ready().path, headers={"Accept-Language": language})
        found = json.loads(connection.getresponse().read())
        connection.close()
        return [str(reason["message"]) for reason in found["reasons"]]
    connection.close()
    return []


def _version(of_service: str) -> Finding:
    if of_service == __version__:
        return ok("version", "version_same", version=__version__)
    return warn("version", "version_differs", own=__version__, version=of_service)
