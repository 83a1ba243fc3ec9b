"""Talking to the running `maya up`: one request at a time by http.client, errors come back as themselves."""

from __future__ import annotations

import json
from contextlib import suppress
from http.client import HTTPConnection, HTTPException, HTTPResponse
from typing import Any, cast
from urllib.parse import urlsplit

from maya_un import credentials, runtime
from maya_un.errors import LeaseLost, MayaError, NotSignedIn, ServiceNotAnswering, ServiceNotRunning, from_notice


class Client:
    """A door to the service at `url`.

    `timeout` [s] is how long connecting and each answer may take. Raises `ServiceNotRunning` for what is no URL. A
    `lease` that is set is shown in place of the shell's.
    """

    def __init__(self, url: str, timeout: float = 5.0) -> None:
        try:
            address = urlsplit(url)
            self.host, self.port = address.hostname or "127.0.0.1", address.port or 80
        except ValueError:
            raise ServiceNotRunning from None  # nobody can listen there
        self.url = url
        self.lease = ""
        self._timeout = timeout

    @classmethod
    def find(cls, timeout: float = 5.0) -> Client:
        """Return the door to the running service; raises `ServiceNotRunning` where no file names one."""
        running = runtime.find()
        if running is None:
            raise ServiceNotRunning
        return cls(running.url, timeout)

    @classmethod
    def running(cls) -> Client | None:
        """Return the door to the running service, None where none answers; raises `ServiceNotAnswering`."""
        with suppress(ServiceNotRunning):
            client = cls.find()
            client.get("/v1/health")
            return client
        return None

    def get(self, path: str, timeout: float | None = None) -> Any:
        """Return the answer to GET `path`; raises as `request`."""
        return self.request("GET", path, timeout=timeout)

    def post(self, path: str, body: object = None, timeout: float | None = None) -> Any:
        """Return the answer to POST `path`; raises as `request`."""
        return self.request("POST", path, body, timeout)

    def request(self, method: str, path: str, body: object = None, timeout: float | None = None) -> Any:
        """Return the decoded answer.

        Raises `ServiceNotRunning` where nobody listens, `ServiceNotAnswering` without an answer in time or with one of
        somebody else at our old port (ours has the header `Maya`), and the service's own refusal as the error it is. A
        lease of the shell that has ended is forgotten.
        """
        connection = HTTPConnection(self.host, self.port, timeout=self._timeout if timeout is None else timeout)
        shown = {"Content-Type": "application/json", **credentials.headers(self.url)}
        if self.lease:
            shown["Maya-Lease"] = self.lease
        try:
            payload = None if body is None else json.dumps(body)
            connection.request(method, path, payload, shown)
            response = connection.getresponse()
            if response.getheader("Maya") is None:
                raise ServiceNotAnswering(reason="somebody else answers in its place")
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
    """Return a refusal of this machine's own token, with the file or variable that the token comes from."""
    origin = credentials.origin()
    said = refusal.details["reason"]
    return NotSignedIn(reason=f"{said}; it comes from {origin}") if origin else refusal


def _decode(response: HTTPResponse, text: bytes) -> Any:
    answer = json.loads(text)
    if response.status < 400:
        return answer
    raise _refusal(cast("dict[str, Any]", answer))


def _refusal(problem: dict[str, Any]) -> MayaError:
    try:
        return from_notice(int(problem["code"]), dict(problem["details"]), str(problem.get("detail", "")))
    except (KeyError, TypeError):
        return ServiceNotAnswering(reason=f"its answer is not understood: {problem}")
