"""The transport that both drivers share: address, credentials, lease, encoding, errors."""

from __future__ import annotations

import json
import os
import ssl
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple, TypeVar, cast
from urllib.parse import urlsplit

import httpx
from pydantic import TypeAdapter, ValidationError
from pydantic_core import to_json
from websockets.exceptions import InvalidStatus, WebSocketException

from dmc41x3.i18n import phrase
from maya_un import credentials, runtime
from maya_un.client.request import Answer, Request, get
from maya_un.errors import (
    CertificateRefused,
    InvalidRequest,
    InvalidValue,
    LeaseLost,
    MayaError,
    ServiceNotAnswering,
    ServiceNotRunning,
    by_code,
    from_notice,
    from_sentence,
)
from maya_un.validation import reason_of


@dataclass(frozen=True, slots=True)
class ServiceAddress:
    """The service's address, like "http://127.0.0.1:4133", and the credentials for it: a token, a control lease.

    Both are "" for none.
    """

    url: str
    token: str = ""
    lease: str = ""


Finder = Callable[[], ServiceAddress]
"""Returns the address of the service; a restarted `maya up` may have another port."""


def finder(url: str | None, token: str | None) -> Finder:
    """Return a function that finds the service: at `url`, else $MAYA_URL, else the running `maya up` of this user.

    The token is `token`, else this user's (`maya_un.credentials`); a lease taken in the shell is included. Raises
    `InvalidValue` for an address that is not http or https; the returned function raises `ServiceNotRunning`.
    """
    named = url or os.environ.get("MAYA_URL")
    checked = _checked(named) if named else None

    def find() -> ServiceAddress:
        where = _running() if checked is None else checked
        shown = credentials.token() if token is None else token
        taken = credentials.held()
        return ServiceAddress(where, shown, taken.id if taken is not None and taken.url == where else "")

    return find


def _running() -> str:
    found = runtime.serving()
    if found is None:
        raise ServiceNotRunning
    return found.url


def _checked(url: str) -> str:
    try:
        parts = urlsplit(url)
        usable = parts.scheme in {"http", "https"} and bool(parts.hostname) and parts.port != 0
    except ValueError:
        usable = False
    if not usable:
        raise InvalidValue(key="url", value=repr(url), reason="it is like http://127.0.0.1:4133")
    return url.rstrip("/")


def trusted(ca: str | os.PathLike[str] | None) -> ssl.SSLContext:
    """Return the TLS context that verifies the service by the system's authorities, or by the file `ca` alone.

    Raises `InvalidValue` for a file without certificates.
    """
    try:
        return ssl.create_default_context(cafile=None if ca is None else os.fspath(ca))
    except OSError as error:
        raise InvalidValue(key="ca", value=repr(ca), reason=error.strerror or str(error)) from error


class HeldLease:
    """The lease that a client sends, "" while it holds none."""

    def __init__(self) -> None:
        self.id = ""
        self._lost: LeaseLost | None = None

    @property
    def missed(self) -> bool:
        """Whether the lease was lost, and `require` has not raised the error yet."""
        return self._lost is not None

    def begin(self, lease: str) -> None:
        """Send `lease` from now on."""
        self.id = lease
        self._lost = None

    def end(self) -> None:
        """Send no lease from now on."""
        self.id = ""
        self._lost = None

    def lose(self, error: LeaseLost) -> None:
        """Record the loss of the lease. Requests still carry it until `end`, so that none runs under another lease."""
        if self.id:
            self._lost = error

    def require(self) -> None:
        """Raise `LeaseLost` once after a loss of the lease."""
        lost, self._lost = self._lost, None
        if lost is not None:
            raise lost


T = TypeVar("T")

VERSION_HEADER = "Maya"
"""Every answer of a Maya service has this header; it reveals another program that answers at an old port."""

_NOBODY = phrase("another program answers at its address")


class EncodedRequest(NamedTuple):
    """A request in the form in which it is sent."""

    url: str
    headers: dict[str, str]
    content: bytes


def identity(token: str) -> dict[str, str]:
    """Return the header that carries a token, {} for ""; raises `InvalidRequest` for one that a header cannot carry."""
    if not (token.isascii() and token.isprintable()):
        raise InvalidRequest(key="token", reason="it contains a character that no token has; copy the token again")
    return {"Authorization": f"Bearer {token}"} if token else {}


def encoded(request: Request[Any], service: ServiceAddress, lease: str) -> EncodedRequest:
    """Return an encoded request with this control lease; for "", with the lease of `service`, if any."""
    headers = {"Accept": "application/json", **identity(service.token)}
    if lease or service.lease:
        headers["Maya-Lease"] = lease or service.lease
    if request.key:
        headers["Idempotency-Key"] = request.key
    content = b""
    if request.body is not None:
        headers["Content-Type"] = "application/json"
        content = to_json(request.body)
    return EncodedRequest(service.url + request.target, headers, content)


def decoded(request: Request[T], status: int, headers: Mapping[str, str], content: bytes) -> T:
    """Return the content of an answer.

    Raises the error that the service answered, and `ServiceNotAnswering` for the answer of another program.
    """
    if VERSION_HEADER not in headers:
        raise ServiceNotAnswering(reason=_NOBODY)
    if status >= 400:
        raise refusal(content)
    if request.answer is type(None):
        return cast("T", None)
    if request.answer is bytes or request.answer is str:
        return cast("T", content if request.answer is bytes else content.decode())
    try:
        return adapter(request.answer).validate_json(content)
    except ValidationError as error:
        reason = phrase("its answer is not understood: {answer}", answer=reason_of(error.errors(include_url=False)[0]))
        raise ServiceNotAnswering(reason=reason) from error


def stream_url(service: ServiceAddress, path: str) -> str:
    """Return the address of a websocket."""
    return "ws" + service.url.removeprefix("http") + path


def decoded_message(text: str | bytes) -> dict[str, Any]:
    """Return a message of the websocket; raises the error in it, or `ServiceNotAnswering` for an invalid message."""
    try:
        found: dict[str, Any] = json.loads(text)
        if found["type"] != "error":
            return found
        error = from_notice(int(found["code"]), dict(found["details"]))
    except (KeyError, TypeError, ValueError, OverflowError, RecursionError) as problem:
        raise ServiceNotAnswering(
            reason=phrase("its message is not understood: {text!r}", text=text[:200])
        ) from problem
    raise error


def refusal(content: bytes) -> MayaError:
    """Return the error that an answer contains (problem+json)."""
    try:
        problem: dict[str, Any] = json.loads(content)
        return from_notice(int(problem["code"]), dict(problem["details"]), str(problem.get("detail", "")))
    except (KeyError, TypeError, ValueError, OverflowError, RecursionError):
        return ServiceNotAnswering(
            reason=phrase("its answer is not understood: {answer}", answer=content[:200].decode(errors="replace"))
        )


@cache
def adapter(kind: type[T] | Answer) -> TypeAdapter[T]:
    """Return the parser of JSON values of a type."""
    return TypeAdapter(kind.load() if isinstance(kind, Answer) else kind)


def as_error(code: int, message: str) -> MayaError:
    """Return the error of a report, which contains its code and its message but not its details.

    For an unknown code it is `ServiceNotAnswering`, with the message as its reason.
    """
    return from_sentence(code, message) if code in by_code() else ServiceNotAnswering(reason=message)


@contextmanager
def translated() -> Iterator[None]:
    """Raise `ServiceNotRunning` if the connection is refused, `ServiceNotAnswering` if no answer arrives.

    Raises `CertificateRefused` if no secure connection is established: then nothing was sent. A refused websocket
    raises the error in its answer.
    """
    try:
        yield
    except InvalidStatus as refusal:
        answer = refusal.response
        decoded(get("", type(None)), answer.status_code, answer.headers, bytes(answer.body))
        raise ServiceNotAnswering(reason=str(refusal)) from refusal
    except (httpx.TransportError, httpx.DecodingError, httpx.InvalidURL, WebSocketException, OSError) as error:
        if _refused(error):
            raise ServiceNotRunning from error
        if any(isinstance(one, ssl.SSLError) for one in _causes(error)):
            raise CertificateRefused(reason=_secret_reason(error)) from error
        raise ServiceNotAnswering(reason=str(error) or type(error).__name__) from error


def _refused(error: BaseException) -> bool:
    return any(isinstance(one, ConnectionRefusedError) for one in _causes(error))


def _secret_reason(error: BaseException) -> str:
    """Return the reason why a certificate was rejected, from OpenSSL."""
    found = [one.verify_message for one in _causes(error) if isinstance(one, ssl.SSLCertVerificationError)]
    return found[0] if found else str(error)


def _causes(error: BaseException | None) -> Iterator[BaseException]:
    while error is not None:
        yield error
        error = error.__cause__ or error.__context__
