"""How a robot shows the Realtime Database who it is: a ready token, or a Firebase user who signs in.

A user signs in with e-mail and password at Google's Identity Toolkit, and gets an ID token for an hour. The token is
refreshed before it ends. FIREBASE_AUTH_EMULATOR_HOST moves both addresses, as in Firebase's own libraries. There is no
sign-in by service account: it would give the robot all rights, and needs signatures by a library more.
"""

from __future__ import annotations

import asyncio
import json
import os
from typing import Protocol

import httpx

_EARLY = 60.0
"""A token is refreshed so long before it ends [s]."""

_TOOLKIT = "identitytoolkit.googleapis.com"
_TOKENS = "securetoken.googleapis.com"


class NoToken(Exception):
    """No token can be had; the text says why, without a credential."""


class TokenSource(Protocol):
    """The source of the tokens."""

    @property
    def secrets(self) -> tuple[str, ...]:
        """Secrets that must not be shown."""
        ...

    async def token(self, http: httpx.AsyncClient) -> str:
        """Return the token to show now, "" for none; raises `NoToken`, `httpx.HTTPError`."""
        ...

    def refused(self) -> bool:
        """Note that the database refused the token; return whether another one can be had."""
        ...


class FixedToken:
    """A token that does not change: a database secret, or one that another program made; "" for none."""

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
        """Return that there is no other."""
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
        """Return the ID token; signs in or refreshes if that is due."""
        async with self._one:
            if not self._id_token or asyncio.get_running_loop().time() > self._ends - _EARLY:
                await self._renew(http)
            return self._id_token

    def refused(self) -> bool:
        """Let the next request get another token."""
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
            raise NoToken(f"the user {self._email} cannot sign in: {message_of(answer.content)}")
        self._note(answer, "idToken", "refreshToken", "expiresIn")

    def _note(self, answer: httpx.Response, id_token: str, refresh_token: str, lasts: str) -> None:
        try:
            data = answer.json()
            self._id_token, self._refresh_token = str(data[id_token]), str(data[refresh_token])
            self._ends = asyncio.get_running_loop().time() + float(data[lasts])
        except (KeyError, RecursionError, TypeError, ValueError) as error:
            raise NoToken("the server of users answers what is no token") from error


def message_of(body: bytes) -> str:
    """Return the sentence in an error of Firebase, a short one."""
    try:
        found = json.loads(body)["error"]
        text = found["message"] if isinstance(found, dict) else found
    except (KeyError, TypeError, ValueError, RecursionError):
        return "no reason is given"
    return str(text)[:200]


def _url(host: str, path: str) -> str:
    emulator = os.environ.get("FIREBASE_AUTH_EMULATOR_HOST")
    return f"http://{emulator}/{host}/v1/{path}" if emulator else f"https://{host}/v1/{path}"
