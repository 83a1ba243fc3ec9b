"""The client of the command line: sends the generated requests by http.client, and returns JSON unchanged.

It reports errors by the option of the command line, not by the key of the request. It imports neither the messages nor
an HTTP library, so that `maya status` and `maya stop` start fast.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from http.client import HTTPConnection, HTTPException, HTTPResponse
from typing import Any, cast
from urllib.parse import urlsplit

from dmc41x3.i18n import phrase
from maya_un import credentials, runtime
from maya_un.client import requests
from maya_un.client.request import TIMEOUT, Request
from maya_un.errors import (
    InvalidRequest,
    InvalidValue,
    LeaseLost,
    MayaError,
    NotSignedIn,
    ServiceNotAnswering,
    ServiceNotRunning,
    from_notice,
)


@contextmanager
def called(options: Mapping[str, str]) -> Iterator[None]:
    """Replace the key of a refusal in the block by its option, if `options` has one."""
    try:
        yield
    except (InvalidValue, InvalidRequest) as refusal:
        option = options.get(str(refusal.details.get("key")))
        if option is None:
            raise
        raise refusal.copy(key=option) from None


ANSWER = 5.0
"""Longest wait for an ordinary answer [s]."""

COMPUTED = 60.0
"""Longest wait for an answer that a worker computes [s]; on a slow computer its process may take seconds to start."""


class ServiceClient:
    """A client of the service at `url`.

    `timeout` [s] is the longest wait for the connection and for an ordinary answer. Raises `ServiceNotRunning` if `url`
    is not a URL. If `lease` is set, it is sent instead of the shell's.
    """

    def __init__(self, url: str, timeout: float = ANSWER) -> None:
        try:
            address = urlsplit(url)
            self.host, self.port = address.hostname or "127.0.0.1", address.port or 80
        except ValueError:
            raise ServiceNotRunning from None  # no program can listen there
        self.url = url
        self.lease = ""
        self._timeout = timeout
        self._ours = False

    @classmethod
    def find(cls, timeout: float = ANSWER) -> ServiceClient:
        """Return a client of the running `maya up`, which sends nothing after its end; raises `ServiceNotRunning`."""
        running = runtime.serving()
        if running is None:
            raise ServiceNotRunning
        client = cls(running.url, timeout)
        client._ours = True
        return client

    @classmethod
    def running(cls) -> ServiceClient | None:
        """Return a client of the running service, None if nothing listens; raises `ServiceNotAnswering`."""
        with suppress(ServiceNotRunning):
            client = cls.find()
            client.ask(requests.health())
            return client
        return None

    def ask(self, request: Request[Any], timeout: float | None = None) -> Any:
        """Return the decoded JSON of the answer.

        `timeout` [s] is the longest wait; by default the client's, or the request's if its operation takes longer than
        most. Raises `ServiceNotRunning` if no program listens, `ServiceNotAnswering` if no answer arrives in time or
        another program answers (Maya's answers have the header `Maya`), and the errors of the service. An ended lease
        of the shell is deleted.
        """
        if self._ours and runtime.serving() is None:
            raise ServiceNotRunning
        if timeout is None:
            timeout = request.timeout if request.timeout > TIMEOUT else self._timeout
        connection = HTTPConnection(self.host, self.port, timeout=timeout)
        shown = {"Content-Type": "application/json", **credentials.headers(self.url)}
        if self.lease:
            shown["Maya-Lease"] = self.lease
        if request.key:
            shown["Idempotency-Key"] = request.key
        try:
            payload = None if request.body is None else json.dumps(request.body)
            connection.request(request.method, request.target, payload, shown)
            response = connection.getresponse()
            if response.getheader("Maya") is None:
                raise ServiceNotAnswering(reason="another program answers at its address")
            return _decode(response, response.read())
        except NotSignedIn as refusal:
            raise _named(refusal) from refusal
        except LeaseLost:
            credentials.forget(shown.get("Maya-Lease", ""))
            raise
        except ConnectionRefusedError:
            raise ServiceNotRunning from None
        except (OSError, HTTPException, ValueError) as error:
            reason = str(error) or type(error).__name__
            raise ServiceNotAnswering(reason=reason) from error
        finally:
            connection.close()


def _named(refusal: NotSignedIn) -> NotSignedIn:
    """Return a refusal with the file or variable from which this computer's token comes."""
    origin = credentials.origin()
    reason = refusal.details["reason"]
    return (
        NotSignedIn(reason=phrase("{reason}; it comes from {origin}", reason=reason, origin=origin))
        if origin
        else refusal
    )


def _decode(response: HTTPResponse, text: bytes) -> Any:
    answer = json.loads(text)
    if response.status < 400:
        return answer
    raise _refusal(cast("dict[str, Any]", answer))


def _refusal(problem: dict[str, Any]) -> MayaError:
    try:
        return from_notice(int(problem["code"]), dict(problem["details"]), str(problem.get("detail", "")))
    except (KeyError, TypeError):
        return ServiceNotAnswering(reason=phrase("its answer is not understood: {answer}", answer=problem))
