"""What goes wrong on the way to the service, as errors of the house."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import httpx
from websockets.exceptions import InvalidStatus, WebSocketException

from maya_un.client import codec
from maya_un.client.steps import get
from maya_un.errors import ServiceNotAnswering, ServiceNotRunning


@contextmanager
def translated() -> Iterator[None]:
    """Raise `ServiceNotRunning` where nobody listens, `ServiceNotAnswering` where no answer comes.

    A websocket that is refused raises why.
    """
    try:
        yield
    except InvalidStatus as refusal:
        answer = refusal.response
        codec.read(get("", type(None)), answer.status_code, answer.headers, bytes(answer.body))
        raise ServiceNotAnswering(reason=str(refusal)) from refusal
    except (httpx.TransportError, httpx.InvalidURL, WebSocketException, OSError) as error:
        if _refused(error):
            raise ServiceNotRunning from error
        raise ServiceNotAnswering(reason=str(error) or type(error).__name__) from error


def _refused(error: BaseException | None) -> bool:
    while error is not None:
        if isinstance(error, ConnectionRefusedError):
            return True
        error = error.__cause__ or error.__context__
    return False
