"""Transport errors, as errors of Maya."""

from __future__ import annotations

import ssl
from collections.abc import Iterator
from contextlib import contextmanager

import httpx
from websockets.exceptions import InvalidStatus, WebSocketException

from maya_un.client import codec
from maya_un.client.request import get
from maya_un.errors import CertificateRefused, ServiceNotAnswering, ServiceNotRunning


@contextmanager
def translated() -> Iterator[None]:
    """Raise `ServiceNotRunning` where nobody listens, `ServiceNotAnswering` where no answer comes.

    Raises `CertificateRefused` where no secure connection comes about: nothing was sent, and the robot is as it was. A
    websocket that is refused raises why.
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
        if any(isinstance(one, ssl.SSLError) for one in _causes(error)):
            raise CertificateRefused(reason=_secret_reason(error)) from error
        raise ServiceNotAnswering(reason=str(error) or type(error).__name__) from error


def _refused(error: BaseException) -> bool:
    return any(isinstance(one, ConnectionRefusedError) for one in _causes(error))


def _secret_reason(error: BaseException) -> str:
    """Return what is wrong with a certificate, as OpenSSL says it."""
    found = [one.verify_message for one in _causes(error) if isinstance(one, ssl.SSLCertVerificationError)]
    return found[0] if found else str(error)


def _causes(error: BaseException | None) -> Iterator[BaseException]:
    while error is not None:
        yield error
        error = error.__cause__ or error.__context__
