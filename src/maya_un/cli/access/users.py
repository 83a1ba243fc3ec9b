"""`maya user`: who may what. Secrets are shown once, and asked for without being shown."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime, timedelta
from getpass import getpass
from typing import TYPE_CHECKING, Any

from maya_un import credentials
from maya_un.cli import output
from maya_un.cli.access import files
from maya_un.cli.access.words import word
from maya_un.cli.client import ServiceClient
from maya_un.cli.report import table
from maya_un.cli.settings import OutputSettings
from maya_un.client import requests
from maya_un.errors import InvalidCommandLine, InvalidValue

if TYPE_CHECKING:
    from maya_un.schema.bodies import RoleName

_ADMIN = "admin"


def me(settings: OutputSettings) -> int:
    """Tell as whom the running robot sees us; raises `NotSignedIn`, `ServiceNotRunning`."""
    found = ServiceClient.find().ask(requests.me())
    return output.answer(found, word("me" if found["users"] else "me_local", settings.language, **found), settings)


def add(name: str, role: RoleName, settings: OutputSettings, *, with_password: bool) -> int:
    """Add a user and show the first token; raises `InvalidValue`, `NotAllowed`.

    The first user of all is an administrator at this machine, whose commands need the token from then on: it is kept,
    and an old one of another robot or another time is set aside. Raises `FileUnwritable`.
    """
    client = ServiceClient.find()
    first = not client.ask(requests.me())["users"]
    password = _new_password(settings.language) if with_password else None
    made = client.ask(requests.add_user(name, role, password=password or None))
    text = f"{word('added', settings.language, **made)}\n{_secret(made, settings.language)}"
    if first:
        text = f"{text}\n{_kept_first(made['token'], settings.language)}"
    return output.answer({**made, "kept": first}, text, settings)


def _kept_first(token: str, language: str) -> str:
    """Store the first token of all, and return a note for its owner."""
    aside = files.set_aside()
    said = [word("kept", language, file=files.keep_token(token))]
    if aside is not None:
        said.append(word("aside", language, file=aside))
    if credentials.token() != token:
        said.append(word("other_token", language, name=credentials.TOKEN))
    return "\n".join(said)


def listed(settings: OutputSettings) -> int:
    """List all users; raises `NotAllowed`."""
    users = ServiceClient.find().ask(requests.users())
    head = _head(("user", "role", "since", "password", "tokens", "used"), settings.language)
    yes = word("yes", settings.language)
    rows = [
        (user["name"], user["role"], _day(user["created"]), yes if user["password"] else "", str(user["tokens"]),
         _minute(user["used"]))
        for user in users
    ]  # fmt: skip
    text = table(head, rows, right=(4,)) if rows else word("no_users", settings.language)
    return output.answer({"users": users}, text, settings)


def change_role(name: str, role: RoleName, settings: OutputSettings) -> int:
    """Give a user another role; raises `UnknownName`, and `NotAllowed` for the last administrator."""
    changed = ServiceClient.find().ask(requests.change_user(name, role=role))
    return output.answer(changed, word("changed", settings.language, **changed), settings)


def change_password(name: str | None, settings: OutputSettings, *, none: bool) -> int:
    """Give a user another password, or none; by default oneself. Raises `UnknownName`, `NotAllowed`, `NotSignedIn`."""
    client = ServiceClient.find()
    who = client.ask(requests.me())
    old = "" if who["role"] == _ADMIN else _asked("old_password", settings.language)
    password = "" if none else _new_password(settings.language)
    changed = client.ask(requests.change_user(name or who["name"], password=password, old=old))
    return output.answer(changed, word("password_changed", settings.language, **changed), settings)


def remove(name: str, settings: OutputSettings) -> int:
    """Remove a user with all tokens; raises `UnknownName`, and `NotAllowed` for the last administrator."""
    removed = ServiceClient.find().ask(requests.remove_user(name))
    return output.answer(removed, word("removed", settings.language, **removed), settings)


def make_token(name: str | None, note: str, expires: str, lasts: float | None, settings: OutputSettings) -> int:
    """Make one more token, by default for oneself, and show it; raises `UnknownName`, `NotAllowed`, `InvalidValue`."""
    if expires and lasts is not None:
        raise InvalidCommandLine(reason="--expires and --for say the same", command="maya user token")
    if lasts is not None:
        expires = _in(lasts)
    client = ServiceClient.find()
    owner = name or client.ask(requests.me())["name"]
    made = client.ask(requests.add_token(owner, note=note, expires=expires))
    return output.answer(made, _secret(made, settings.language), settings)


def tokens(name: str | None, settings: OutputSettings) -> int:
    """List the tokens of a user, by default one's own; raises `UnknownName`, `NotAllowed`."""
    client = ServiceClient.find()
    chosen = name or client.ask(requests.me())["name"]
    found = client.ask(requests.tokens(chosen))
    text = _tokens(found, settings.language) if found else word("no_tokens", settings.language, name=chosen)
    return output.answer({"tokens": found}, text, settings)


def revoke(token: str, settings: OutputSettings) -> int:
    """Make a token invalid at once, by its id or the token itself; raises `NotFound`."""
    parts = token.split("_")
    name = parts[1] if len(parts) == 3 else token
    removed = ServiceClient.find().ask(requests.revoke_token(name))
    return output.answer(removed, word("revoked", settings.language, **removed), settings)


def _tokens(found: Sequence[Mapping[str, Any]], language: str) -> str:
    head = _head(("token", "note", "since", "until", "used"), language)
    rows = [
        (
            one["id"],
            f"{word('session', language)} {one['note']}" if one["session"] else one["note"],
            _day(one["created"]),
            _minute(one["expires"]),
            _minute(one["used"]),
        )
        for one in found
    ]
    return table(head, rows)


def _secret(made: Mapping[str, Any], language: str) -> str:
    return word("secret", language, **made, file=credentials.token_file())


def _head(keys: Sequence[str], language: str) -> tuple[str, ...]:
    return tuple(word(key, language) for key in keys)


def _day(date: str) -> str:
    return date[:10]


def _minute(date: str) -> str:
    return date[:16].replace("T", " ")


def _in(seconds: float) -> str:
    try:
        return (datetime.now(UTC) + timedelta(seconds=seconds)).isoformat(timespec="seconds")
    except OverflowError:
        raise InvalidValue(key="--for", value=seconds, reason="it is too long") from None


def _new_password(language: str) -> str:
    """Ask for a password, twice on a terminal; raises `InvalidValue` where the two differ."""
    password = _asked("new_password", language)
    if sys.stdin.isatty() and _asked("again", language) != password:
        raise InvalidValue(key="password", value="…", reason="the second one differs from the first")
    return password


def _asked(key: str, language: str) -> str:
    """Ask for a secret without showing it; where there is no terminal, it is the next line of the input."""
    if sys.stdin.isatty():
        return getpass(word(key, language))
    return sys.stdin.readline().rstrip("\n")
