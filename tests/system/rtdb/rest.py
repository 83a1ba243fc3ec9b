"""REST and server-sent events, and the three calls by which users sign in."""

from __future__ import annotations

import asyncio
import json
import secrets
import time
from collections.abc import AsyncIterator, Mapping
from typing import Any

from starlette.requests import Request
from starlette.responses import JSONResponse, Response, StreamingResponse

from tests.system.rtdb.store import TOKEN_LASTS, BadTokenError, Caller, DeniedError, Listener, Store
from tests.system.rtdb.tree import BadDataError, Path, Query, at, changes_of, etag, exported, parts, shallow

_LETTERS = "-0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZ_abcdefghijklmnopqrstuvwxyz"


class PushKeys:
    """Makes keys whose order is that of their time."""

    def __init__(self) -> None:
        self._last = 0

    def next(self) -> str:
        """Return a key."""
        self._last = max(self._last + 1, time.time_ns() // 1_000_000)
        number, letters = self._last, ""
        for _ in range(8):
            number, digit = divmod(number, 64)
            letters = _LETTERS[digit] + letters
        return letters + "".join(secrets.choice(_LETTERS) for _ in range(12))


class Rest:
    """Answers requests; `keep_alive` is the pause between signs of life in a stream [s]."""

    def __init__(self, store: Store, keep_alive: float = 30.0) -> None:
        self.store = store
        self.keep_alive = keep_alive
        self.mute = False
        self.backwards = False
        self.token_lasts = TOKEN_LASTS
        self.sign_ins = 0
        self.streams = 0
        self._keys = PushKeys()

    async def answer(self, request: Request) -> Response:
        """Return the answer to a request for data."""
        try:
            caller = self.store.caller(_token(request))
            path = parts(request.path_params["path"])
            if request.method == "GET":
                return self._read(request, path, caller)
            return await self._write(request, path, caller)
        except BadTokenError as error:
            return JSONResponse({"error": str(error)}, 401)
        except DeniedError:
            return JSONResponse({"error": "Permission denied"}, 401)
        except (BadDataError, ValueError) as error:
            return JSONResponse({"error": str(error)}, 400)

    def _read(self, request: Request, path: Path, caller: Caller) -> Response:
        asked = request.query_params
        query = query_of(asked)
        if "text/event-stream" in request.headers.get("accept", ""):
            events: asyncio.Queue[tuple[str, Any]] = asyncio.Queue()
            listener = Listener(path, query, caller, lambda *event: events.put_nowait(_event(*event)))
            tree = self.store.listen(listener)
            data = exported(tree)
            if self.backwards and isinstance(data, dict):
                data = dict(reversed(data.items()))
            events.put_nowait(_event("put", (), data))
            return StreamingResponse(self._stream(listener, events), media_type="text/event-stream")
        tree = self.store.read(path, caller, query)
        if asked.get("shallow") == "true":
            return _json(shallow(tree))
        tag = etag(tree)
        known = request.headers.get("if-none-match")
        if known == tag:
            return Response(status_code=304)
        wanted = known is not None or request.headers.get("x-firebase-etag") == "true"
        headers = {"ETag": tag} if wanted else {}
        return _json(exported(tree), asked, headers)

    async def _stream(self, listener: Listener, events: asyncio.Queue[tuple[str, Any]]) -> AsyncIterator[bytes]:
        self.streams += 1
        try:
            while True:
                try:
                    async with asyncio.timeout(self.keep_alive):
                        name, data = await events.get()
                except TimeoutError:
                    name, data = "keep-alive", None
                if self.mute:
                    continue
                text = data if name == "auth_revoked" else json.dumps(data)
                yield f"event: {name}\ndata: {text}\n\n".encode()
                if name in {"cancel", "auth_revoked"}:
                    return
        finally:
            self.streams -= 1
            self.store.leave(listener)

    async def _write(self, request: Request, path: Path, caller: Caller) -> Response:
        body = await request.body()
        value = None if request.method == "DELETE" else json.loads(body)
        here = at(self.store.tree, path)
        wanted = request.headers.get("if-match")
        if wanted is not None and wanted != etag(here):
            return _json(exported(here), {}, {"ETag": etag(here)}, 412)
        answer = value
        if request.method == "PATCH":
            if not isinstance(value, dict):
                raise BadDataError("Invalid data; couldn't parse JSON object.")
            self.store.write(path, changes_of(path, value), caller, merge=True)
        else:
            if request.method == "POST":
                key = self._keys.next()
                path, answer = (*path, key), {"name": key}
            self.store.write(path, [(path, value)], caller, merge=False)
        if request.method == "PUT":
            answer = exported(at(self.store.tree, path))
        tagged = request.headers.get("x-firebase-etag") == "true"
        return _json(answer, request.query_params, {"ETag": etag(at(self.store.tree, path))} if tagged else {})

    async def sign_in(self, request: Request) -> Response:
        """Answer accounts:signInWithPassword."""
        asked = await request.json()
        email = str(asked.get("email"))
        if self.store.users.get(email) != asked.get("password"):
            return JSONResponse({"error": {"code": 400, "message": "INVALID_LOGIN_CREDENTIALS"}}, 400)
        self.sign_ins += 1
        return JSONResponse(
            {
                "kind": "identitytoolkit#VerifyPasswordResponse",
                "localId": _uid(email),
                "email": email,
                "registered": True,
                "idToken": self.store.sign_in(_uid(email), email=email),
                "refreshToken": f"refresh {email}",
                "expiresIn": str(self.token_lasts),
            }
        )

    async def look_up(self, request: Request) -> Response:
        """Answer accounts:lookup."""
        caller = self.store.caller((await request.json())["idToken"])
        assert caller.auth is not None
        found = {"localId": caller.auth["uid"], "email": caller.auth["token"].get("email")}
        return JSONResponse({"kind": "identitytoolkit#GetAccountInfoResponse", "users": [found]})

    async def refresh(self, request: Request) -> Response:
        """Answer the exchange of a refresh token."""
        form = dict(pair.split("=", 1) for pair in (await request.body()).decode().split("&"))
        email = form.get("refresh_token", "").replace("+", " ").replace("%20", " ").replace("%40", "@")
        email = email.removeprefix("refresh ")
        if form.get("grant_type") != "refresh_token" or email not in self.store.users:
            return JSONResponse({"error": {"code": 400, "message": "INVALID_REFRESH_TOKEN"}}, 400)
        token = self.store.sign_in(_uid(email), email=email)
        return JSONResponse(
            {
                "id_token": token,
                "access_token": token,
                "refresh_token": f"refresh {email}",
                "expires_in": str(self.token_lasts),
                "token_type": "Bearer",
                "user_id": _uid(email),
            }
        )


def query_of(asked: Mapping[str, str]) -> Query:
    """Return the query in the parameters of a request; raises `BadDataError`."""
    if "orderBy" not in asked:
        return Query()
    found = {
        name: json.loads(asked[name])
        for name in ("orderBy", "startAt", "startAfter", "endAt", "endBefore", "equalTo", "limitToFirst", "limitToLast")
        if name in asked
    }
    limit = found.get("limitToFirst", found.get("limitToLast"))
    if limit is not None and (not isinstance(limit, int) or limit < 1):
        raise BadDataError("limitToFirst and limitToLast must be positive integers")
    start = end = None
    for name in ("startAt", "startAfter", "equalTo"):
        if name in found:
            start = (found[name], None, name != "startAfter")
    for name in ("endAt", "endBefore", "equalTo"):
        if name in found:
            end = (found[name], None, name != "endBefore")
    index = str({"$key": ".key", "$value": ".value"}.get(found["orderBy"], found["orderBy"]))
    return Query(index, start, end, limit, "limitToLast" in found)


def _uid(email: str) -> str:
    return email.partition("@")[0]


def _token(request: Request) -> str:
    asked = request.query_params
    return asked.get("auth") or asked.get("access_token") or bearer(request.headers.get("authorization", ""))


def bearer(header: str) -> str:
    return header.removeprefix("Bearer ") if header.startswith("Bearer ") else ""


def _event(name: str, path: Path, data: Any) -> tuple[str, Any]:
    return name, {"path": "/" + "/".join(path), "data": data} if name in {"put", "patch"} else data


def _json(data: Any, asked: Mapping[str, str] = {}, headers: Mapping[str, str] = {}, status: int = 200) -> Response:
    if asked.get("print") == "silent" and status == 200:
        return Response(status_code=204, headers=dict(headers))
    return Response(
        json.dumps(data, indent=2 if asked.get("print") == "pretty" else None),
        status,
        dict(headers),
        "application/json",
    )
