"""Client of a Firebase Realtime Database over REST, with sign-in and server-sent events.

A user signs in with e-mail and password at Google's Identity Toolkit and gets an ID token that is valid for an hour.
The client refreshes it before it expires. FIREBASE_AUTH_EMULATOR_HOST moves both addresses, as in Firebase's own
libraries. There is no sign-in by service account: it would give the robot all rights, and needs another library for
signatures.
"""

from __future__ import annotations

import asyncio
import functools
import json
import logging
import os
import ssl
from collections.abc import AsyncGenerator, AsyncIterator, Collection, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn, Protocol
from urllib.parse import parse_qs, quote, urljoin, urlsplit

import httpx

from dmc41x3.i18n import phrase
from maya_un.coms.settings import where_of
from maya_un.errors import SupervisorsNotReached

_EARLY = 60.0
"""The client refreshes a token this long before it expires [s]."""

_TOOLKIT = "identitytoolkit.googleapis.com"
_TOKENS = "securetoken.googleapis.com"


def tls_context() -> ssl.SSLContext:
    """Return the TLS settings of an HTTP client of this package. Certificates are read again only if they change.

    Reading takes 20 ms, in which the loop could do nothing else at each connect.
    """
    places = (os.environ.get("SSL_CERT_FILE", ""), os.environ.get("SSL_CERT_DIR", ""))
    return _context_of(tuple((place, _changed(place)) for place in places))


@functools.lru_cache(maxsize=1)
def _context_of(_certificates: tuple[tuple[str, int], ...]) -> ssl.SSLContext:
    return httpx.create_ssl_context()


def _changed(place: str) -> int:
    """Return when a file or folder was last changed [ns], 0 if there is none."""
    try:
        return Path(place).stat().st_mtime_ns
    except OSError:
        return 0


class NoToken(Exception):
    """No token is available; the text gives the reason, without a credential."""


class TokenSource(Protocol):
    """A source of tokens."""

    @property
    def secrets(self) -> tuple[str, ...]:
        """Secrets that must not appear in messages."""
        ...

    async def token(self, http: httpx.AsyncClient) -> str:
        """Return the token to send now, "" for none; raises `NoToken`, `httpx.HTTPError`."""
        ...

    def refused(self) -> bool:
        """Record that the database refused the token; return whether another token is available."""
        ...


class FixedToken:
    """A constant token: a database secret, or a token that another program issued; "" for none."""

    def __init__(self, token: str) -> None:
        self._token = token

    @property
    def secrets(self) -> tuple[str, ...]:
        """The token."""
        return (self._token,) if self._token else ()

    async def token(self, http: httpx.AsyncClient) -> str:
        """Return the token."""
        del http
        return self._token

    def refused(self) -> bool:
        """Return False: no other token is available."""
        return False


class FirebaseUser:
    """A Firebase user; `api_key` is that of the project."""

    def __init__(self, email: str, password: str, api_key: str) -> None:
        self._email = email
        self._password = password
        self._api_key = api_key
        self._id_token = ""
        self._refresh_token = ""
        self._ends = 0.0
        self._one = asyncio.Lock()

    @property
    def secrets(self) -> tuple[str, ...]:
        """The password, the key and the tokens."""
        found = (self._password, self._api_key, self._id_token, self._refresh_token)
        return tuple(secret for secret in found if secret)

    async def token(self, http: httpx.AsyncClient) -> str:
        """Return the ID token; sign in or refresh first if necessary."""
        async with self._one:
            if not self._id_token or asyncio.get_running_loop().time() > self._ends - _EARLY:
                await self._renew(http)
            return self._id_token

    def refused(self) -> bool:
        """Discard the token, so that the next request gets a new one; return True."""
        self._id_token = ""
        return True

    async def _renew(self, http: httpx.AsyncClient) -> None:
        if self._refresh_token:
            wanted = {"grant_type": "refresh_token", "refresh_token": self._refresh_token}
            answer = await http.post(_url(_TOKENS, "token"), params={"key": self._api_key}, data=wanted)
            if answer.is_success:
                self._note(answer, "id_token", "refresh_token", "expires_in")
                return
            self._refresh_token = ""  # the user's password may have changed: sign in
        wanted = {"email": self._email, "password": self._password, "returnSecureToken": "true"}
        url = _url(_TOOLKIT, "accounts:signInWithPassword")
        answer = await http.post(url, params={"key": self._api_key}, json=wanted)
        if not answer.is_success:
            raise NoToken(
                phrase(
                    "the user {user} cannot sign in: {message}", user=self._email, message=message_of(answer.content)
                )
            )
        self._note(answer, "idToken", "refreshToken", "expiresIn")

    def _note(self, answer: httpx.Response, id_token: str, refresh_token: str, lasts: str) -> None:
        try:
            data = answer.json()
            self._id_token, self._refresh_token = str(data[id_token]), str(data[refresh_token])
            self._ends = asyncio.get_running_loop().time() + float(data[lasts])
        except (KeyError, RecursionError, TypeError, ValueError) as error:
            raise NoToken(phrase("the server of users did not return a token")) from error


def message_of(body: bytes) -> str:
    """Return the message in an error of Firebase, at most 200 characters."""
    try:
        found = json.loads(body)["error"]
        text = found["message"] if isinstance(found, dict) else found
    except (KeyError, TypeError, ValueError, RecursionError):
        return "no reason is given"
    return str(text)[:200]


def _url(host: str, path: str) -> str:
    emulator = os.environ.get("FIREBASE_AUTH_EMULATOR_HOST")
    return f"http://{emulator}/{host}/v1/{path}" if emulator else f"https://{host}/v1/{path}"


@dataclass(frozen=True, slots=True)
class ServerSentEvent:
    """A server-sent event; if its data exceeded the limit, `whole` is False and `data` must not be used."""

    name: str
    data: bytes
    whole: bool = True


async def events(chunks: AsyncIterator[bytes], most: int) -> AsyncGenerator[ServerSentEvent]:
    """Yield the events in a stream of bytes, each with at most `most` bytes of data."""
    name, data, whole = "", bytearray(), True
    async for line, complete in _lines(chunks, most + len(b"data: ")):
        if not line and complete:
            if name or data:
                yield ServerSentEvent(name, bytes(data), whole)
            name, data, whole = "", bytearray(), True
            continue
        field, _, value = line.partition(b":")
        value = value.removeprefix(b" ")
        if field == b"event":
            name = value.decode(errors="replace")
        elif field == b"data":
            whole = whole and complete and len(data) + len(value) <= most
            if whole:
                data += (b"\n" if data else b"") + value


async def _lines(chunks: AsyncIterator[bytes], most: int) -> AsyncGenerator[tuple[bytes, bool]]:
    """Yield each line up to `most` bytes, and whether it is complete."""
    line, complete = bytearray(), True
    async for chunk in chunks:
        first, *others = chunk.split(b"\n")
        complete = _add(line, first, most) and complete
        for part in others:
            yield bytes(line).removesuffix(b"\r"), complete
            line.clear()
            complete = _add(line, part, most)


def _add(line: bytearray, part: bytes, most: int) -> bool:
    """Append the bytes that fit; return whether all did."""
    room = most - len(line)
    line += part[:room]
    return len(part) <= room


_MOST_REDIRECTS = 5
_UNAUTHORISED = 401
_CHANGED = 412
_MOST_READ = 10_000
"""Maximum number of bytes read from an answer to a write, or from an error."""

_TAGGED = {"X-Firebase-ETag": "true"}

logging.getLogger("httpx").setLevel(logging.WARNING)  # below that level it logs URLs, which contain the token


class Database:
    """A database at a URL, or a part of it; `patience` is the timeout of an answer, `silence` that of a stream [s]."""

    def __init__(self, url: str, credentials: TokenSource, patience: float, silence: float) -> None:
        parts = urlsplit(url)
        self._base = where_of(url).rstrip("/")
        self._namespace = {key: values[0] for key, values in parse_qs(parts.query).items() if key == "ns"}
        self._credentials = credentials
        self._http = httpx.AsyncClient(timeout=httpx.Timeout(patience), verify=tls_context())
        self._stream_timeout = httpx.Timeout(patience, read=silence)

    @property
    def where(self) -> str:
        """The address without credentials."""
        return self._base

    async def close(self) -> None:
        """Close every connection."""
        await self._http.aclose()

    async def read(self, path: tuple[str, ...], most: int, **query: str) -> bytes:
        """Return the JSON text at a path; if it is longer than `most` bytes, return its first `most` + 1 bytes."""
        async with self._answer("GET", path, query) as answer:
            return await self._start_of(answer, most + 1)

    async def write(self, method: str, path: tuple[str, ...], value: object) -> None:
        """Write a value at a path (PUT), or several values below the path at once (PATCH)."""
        async with self._answer(method, path, {"print": "silent"}, json.dumps(value)) as answer:
            await self._start_of(answer)

    async def read_tagged(self, path: tuple[str, ...], most: int) -> tuple[bytes, str | None]:
        """Return the JSON text at a path, as `read` does, and the ETag of this state."""
        async with self._answer("GET", path, {}, headers=_TAGGED) as answer:
            return await self._start_of(answer, most + 1), answer.headers.get("etag")

    async def write_if(self, path: tuple[str, ...], value: object, tag: str, most: int) -> tuple[bool, str | None]:
        """Write a value at a path if its ETag is still `tag`; return whether the write succeeded, and the new ETag.

        The answer contains the value; at most `most` + 1 bytes of the answer are read.
        """
        headers = {**_TAGGED, "if-match": tag}
        async with self._answer("PUT", path, {}, json.dumps(value), headers=headers, accepted={_CHANGED}) as answer:
            await self._start_of(answer, most + 1)
            written = answer.status_code != _CHANGED
            return written, answer.headers.get("etag") if written else None

    @asynccontextmanager
    async def stream(self, path: tuple[str, ...]) -> AsyncIterator[AsyncIterator[bytes]]:
        """Open the stream of events at a path."""
        async with self._answer("GET", path, {}, stream=True) as answer:
            yield self._chunks(answer)

    async def _chunks(self, answer: httpx.Response) -> AsyncIterator[bytes]:
        try:
            async for chunk in answer.aiter_bytes():
                yield chunk
        except httpx.HTTPError as error:
            self._fail(error)

    @asynccontextmanager
    async def _answer(
        self,
        method: str,
        path: tuple[str, ...],
        query: Mapping[str, str],
        content: str | None = None,
        *,
        stream: bool = False,
        headers: Mapping[str, str] | None = None,
        accepted: Collection[int] = (),
    ) -> AsyncIterator[httpx.Response]:
        """Send a request and yield its answer; raises `SupervisorsNotReached` for an unsuccessful one.

        `accepted` are further HTTP status codes that the caller handles.
        """
        if headers is None:
            headers = {"Accept": "text/event-stream"} if stream else {}
        url = f"{self._base}/{'/'.join(quote(part, safe='') for part in path)}.json"
        answer = await self._sent(method, url, query, content, headers, stream=stream)
        if answer.status_code == _UNAUTHORISED and self._credentials.refused():
            await answer.aclose()
            answer = await self._sent(method, url, query, content, headers, stream=stream)
        try:
            if not answer.is_success and answer.status_code not in accepted:
                await self._refuse(answer, f"{method} {'/'.join(path)}")
            yield answer
        finally:
            await answer.aclose()

    async def _sent(
        self,
        method: str,
        url: str,
        query: Mapping[str, str],
        content: str | None,
        headers: Mapping[str, str],
        *,
        stream: bool,
    ) -> httpx.Response:
        """Send a request and follow redirects, each with the credentials."""
        headers = {"Content-Type": "application/json", **headers}
        timeout = self._stream_timeout if stream else self._http.timeout
        try:
            token = await self._credentials.token(self._http)
            shown = {**self._namespace, **query, **({"auth": token} if token else {})}
            for _ in range(_MOST_REDIRECTS):
                wanted = httpx.URL(url).copy_merge_params(shown)
                request = self._http.build_request(method, wanted, content=content, headers=headers, timeout=timeout)
                answer = await self._http.send(request, stream=True)
                if not answer.has_redirect_location:
                    return answer
                await answer.aclose()
                url = self._redirected(url, answer.headers["location"])
        except (httpx.HTTPError, httpx.InvalidURL, UnicodeError, NoToken) as error:
            self._fail(error)
        raise SupervisorsNotReached(
            where=self.where, reason=phrase("it redirects more than {most} times", most=_MOST_REDIRECTS)
        )

    def _redirected(self, url: str, location: str) -> str:
        """Return the target of a redirect; refuse one from https to http, which would expose the token."""
        target = urljoin(url, location)
        if urlsplit(url).scheme == "https" and urlsplit(target).scheme != "https":
            raise SupervisorsNotReached(where=self.where, reason="it redirects to an address without TLS")
        return target

    async def _refuse(self, answer: httpx.Response, asked: str) -> NoReturn:
        """Raise `SupervisorsNotReached` for an unsuccessful answer to the request `asked`."""
        reason = phrase(
            "it answers {request} with {status}: {message}",
            request=asked,
            status=answer.status_code,
            message=message_of(await self._start_of(answer)),
        )
        raise SupervisorsNotReached(where=self.where, reason=masked(reason, self._credentials.secrets))

    async def _start_of(self, answer: httpx.Response, most: int = _MOST_READ) -> bytes:
        """Return the first bytes of an answer. Reading it to the end lets its connection serve the next request."""
        body = bytearray()
        async for chunk in self._chunks(answer):
            body += chunk[: most - len(body)]
            if len(body) >= most:
                break
        return bytes(body)

    def _fail(self, error: Exception) -> NoReturn:
        """Raise `SupervisorsNotReached` for a request without an answer; secrets in the text of `error` are masked."""
        reason = phrase("it does not answer in time") if isinstance(error, httpx.TimeoutException) else str(error)
        plain = masked(reason or type(error).__name__, self._credentials.secrets)
        raise SupervisorsNotReached(where=self.where, reason=plain) from None


def masked(text: str, secrets: Collection[str]) -> str:
    """Return a text without secrets in any form in which a message shows them: plain, in a URL, or escaped."""
    forms = {form for secret in secrets for form in (secret, secret.strip(), quote(secret, safe="", errors="replace"))}
    forms |= {repr(form)[1:-1] for form in forms} | {repr(form.encode(errors="replace"))[2:-1] for form in forms}
    for form in sorted(forms - {""}, key=len, reverse=True):
        text = text.replace(form, "***")
    return text


def data_of(text: bytes) -> Any:
    """Return JSON text as data; raises `ValueError` for text that is not JSON or is nested too deep."""
    try:
        return json.loads(text)
    except RecursionError as error:
        raise ValueError("nested too deep") from error
