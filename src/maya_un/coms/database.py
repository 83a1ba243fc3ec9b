"""Requests to a Firebase Realtime Database over REST: credentials, redirects, and bounds on what is read."""

from __future__ import annotations

import json
import logging
from collections.abc import AsyncIterator, Collection, Mapping
from contextlib import asynccontextmanager
from typing import Any, NoReturn
from urllib.parse import parse_qs, quote, urljoin, urlsplit

import httpx

from maya_un.coms.firebase_auth import NoToken, TokenSource, message_of
from maya_un.coms.settings import where_of
from maya_un.errors import SupervisorsNotReached

_MOST_REDIRECTS = 5
_UNAUTHORISED = 401
_CHANGED = 412
_MOST_READ = 10_000
"""Bytes that are read of an answer to a write, or of an error."""

_TAGGED = {"X-Firebase-ETag": "true"}

logging.getLogger("httpx").setLevel(logging.WARNING)  # below that it writes addresses, which hold the token


class Database:
    """A database at a URL, or a part of it; `patience` is for an answer [s], `silence` for a stream [s]."""

    def __init__(self, url: str, credentials: TokenSource, patience: float, silence: float) -> None:
        parts = urlsplit(url)
        self._base = where_of(url).rstrip("/")
        self._namespace = {key: values[0] for key, values in parse_qs(parts.query).items() if key == "ns"}
        self._credentials = credentials
        self._http = httpx.AsyncClient(timeout=httpx.Timeout(patience))
        self._stream_timeout = httpx.Timeout(patience, read=silence)

    @property
    def where(self) -> str:
        """Its address without credentials."""
        return self._base

    async def close(self) -> None:
        """Close every connection."""
        await self._http.aclose()

    async def read(self, path: tuple[str, ...], most: int, **query: str) -> bytes:
        """Return the JSON text at a path; of a longer one, the first `most` + 1 bytes."""
        async with self._answer("GET", path, query) as answer:
            return await self._start_of(answer, most + 1)

    async def write(self, method: str, path: tuple[str, ...], value: object) -> None:
        """Write a value at a path (PUT), or several below it at once (PATCH)."""
        async with self._answer(method, path, {"print": "silent"}, json.dumps(value)) as answer:
            await self._start_of(answer)

    async def read_tagged(self, path: tuple[str, ...], most: int) -> tuple[bytes, str | None]:
        """Return the JSON text at a path, as `read` does, and the tag of this state."""
        async with self._answer("GET", path, {}, headers=_TAGGED) as answer:
            return await self._start_of(answer, most + 1), answer.headers.get("etag")

    async def write_if(self, path: tuple[str, ...], value: object, tag: str, most: int) -> tuple[bool, str | None]:
        """Write a value at a path if its state still has this tag; return whether, and its new tag.

        The answer holds the value. At most so many bytes of it are read.
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
        """Send a request and yield its answer; raises `SupervisorsNotReached` for one that is no success.

        `accepted` are the other states of HTTP that the caller wants to see.
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
        except (httpx.HTTPError, httpx.InvalidURL, NoToken) as error:
            self._fail(error)
        raise SupervisorsNotReached(where=self.where, reason=f"it redirects more than {_MOST_REDIRECTS} times")

    def _redirected(self, url: str, location: str) -> str:
        """Return where a redirect leads; refuses one from https to http, which would show the token to everybody."""
        target = urljoin(url, location)
        if urlsplit(url).scheme == "https" and urlsplit(target).scheme != "https":
            raise SupervisorsNotReached(where=self.where, reason="it redirects to an address without TLS")
        return target

    async def _refuse(self, answer: httpx.Response, asked: str) -> NoReturn:
        """Raise for an answer that is no success."""
        reason = f"it answers {asked} with {answer.status_code}: {message_of(await self._start_of(answer))}"
        raise SupervisorsNotReached(where=self.where, reason=self._plain(reason))

    async def _start_of(self, answer: httpx.Response, most: int = _MOST_READ) -> bytes:
        """Return the first bytes of an answer. If the whole answer is read, its connection serves the next request."""
        body = bytearray()
        async for chunk in self._chunks(answer):
            body += chunk[: most - len(body)]
            if len(body) >= most:
                break
        return bytes(body)

    def _fail(self, error: Exception) -> NoReturn:
        """Raise for a request that got no answer, without what an error may hold of its address."""
        reason = "it does not answer in time" if isinstance(error, httpx.TimeoutException) else str(error)
        raise SupervisorsNotReached(where=self.where, reason=self._plain(reason or type(error).__name__)) from None

    def _plain(self, text: str) -> str:
        for secret in self._credentials.secrets:
            text = text.replace(secret, "***")
        return text


def data_of(text: bytes) -> Any:
    """Return JSON text as data; raises `ValueError` for what is none or is nested too deep."""
    try:
        return json.loads(text)
    except RecursionError as error:
        raise ValueError("nested too deep") from error
