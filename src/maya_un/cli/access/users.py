"""`maya user`: list, add, change and remove users and their tokens. Secrets are shown once, and entered without echo.

`maya user reset` restores access for the owner of the queue's file if the administrator's token is lost. A user who may
write this file could change it in any other way too, so the command requires no other right. The service must not run
meanwhile, because it locks the file.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from getpass import getpass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dmc41x3.i18n import marked, translate
from dmc41x3.loops import run
from maya_un import credentials
from maya_un.cli import output
from maya_un.cli.access import files
from maya_un.cli.client import ServiceClient
from maya_un.cli.report import table
from maya_un.cli.settings import OutputSettings
from maya_un.client import requests
from maya_un.config.state_folder import own_queue_file
from maya_un.errors import InvalidCommandLine, InvalidValue
from maya_un.http.dates import now
from maya_un.process.journal import file
from maya_un.service.access import callers
from maya_un.service.access.callers import Hasher
from maya_un.service.access.operations import Role
from maya_un.service.access.users import Change, FileStore, Token, User
from maya_un.service.people import checked_name

if TYPE_CHECKING:
    from maya_un.schema.choices import RoleName

_ADMIN = "admin"


def me(settings: OutputSettings) -> int:
    """Print the caller's identity at the running robot; raises `NotSignedIn`, `ServiceNotRunning`."""
    found = ServiceClient.find().ask(requests.me())
    return output.answer(
        found,
        translate(
            "You are {name} ({role}), by token {token}, from {source}."
            if found["users"]
            else "No users exist: you have full access on this machine ({role}). `maya user add NAME --role admin`"
            " adds the first user.",
            settings.language,
            **found,
        ),
        settings,
    )


def add(name: str, role: RoleName, settings: OutputSettings, *, with_password: bool) -> int:
    """Add a user and show the first token; raises `InvalidValue`, `NotAllowed`.

    The first user is an administrator on this computer, whose commands need the token from then on: it is stored, and
    the file of an earlier token is renamed. Raises `FileUnwritable`.
    """
    client = ServiceClient.find()
    first = not client.ask(requests.me())["users"]
    password = _new_password(settings.language) if with_password else None
    made = client.ask(requests.add_user(name, role, password=password))
    text = added_text(made, credentials.token_file(), settings.language)
    if first:
        text = f"{text}\n{_kept_first(made['token'], settings.language)}"
    return output.answer({**made, "kept": first}, text, settings)


def _kept_first(token: str, language: str) -> str:
    """Store the token of the first user, and return a note for that user."""
    aside = files.set_aside()
    said = [
        translate(
            "From now on every command needs a token, except stop and abort on this machine. This token is "
            "stored in {file}, and your commands use it.",
            language,
            file=files.keep_token(token),
        )
    ]
    if aside is not None:
        said.append(translate("The former token is in {file} now.", language, file=aside))
    if credentials.token() != token:
        said.append(
            translate(
                "${name} holds another token, which your commands use first. Unset it, or put the new token into it.",
                language,
                name=credentials.TOKEN,
            )
        )
    return "\n".join(said)


def listed(settings: OutputSettings) -> int:
    """List all users; raises `NotAllowed`."""
    users = ServiceClient.find().ask(requests.users())
    head = _head(
        (
            marked("user"), marked("role"), marked("since"), marked("password"), marked("tokens"), marked("last seen"),
        ),
        settings.language,
    )  # fmt: skip
    yes = translate("yes", settings.language)
    rows = [
        (user["name"], user["role"], _day(user["created"]), yes if user["password"] else "", str(user["tokens"]),
         _minute(user["used"]))
        for user in users
    ]  # fmt: skip
    text = (
        table(head, rows, right=(4,))
        if rows
        else translate(
            "No users exist: anyone on this machine has full access, and other machines have none.", settings.language
        )
    )
    return output.answer({"users": users}, text, settings)


def change_role(name: str, role: RoleName, settings: OutputSettings) -> int:
    """Change the role of a user; raises `UnknownName`, and `LastAdministrator`."""
    changed = ServiceClient.find().ask(requests.change_user(name, role=role))
    return output.answer(changed, translate("{name} is {role}.", settings.language, **changed), settings)


def change_password(name: str | None, settings: OutputSettings, *, none: bool) -> int:
    """Change or remove a user's password, by default the caller's.

    Raises `UnknownName`, `NotAllowed`, `NotSignedIn`.
    """
    client = ServiceClient.find()
    who = client.ask(requests.me())
    old = "" if who["role"] == _ADMIN else _asked(marked("Password now: "), settings.language)
    password = "" if none else _new_password(settings.language)
    changed = client.ask(requests.change_user(name or who["name"], password=password, old=old))
    return output.answer(
        changed,
        translate("The password of {name} is changed; all sessions have ended.", settings.language, **changed),
        settings,
    )


def remove(name: str, settings: OutputSettings) -> int:
    """Remove a user with all tokens; raises `UnknownName`, and `LastAdministrator`."""
    removed = ServiceClient.find().ask(requests.remove_user(name))
    return output.answer(
        removed, translate("{removed} is removed, with all tokens.", settings.language, **removed), settings
    )


def make_token(name: str | None, note: str, expires: str, lasts: float | None, settings: OutputSettings) -> int:
    """Create a token, by default for the caller, and show it; raises `UnknownName`, `NotAllowed`, `InvalidValue`."""
    if expires and lasts is not None:
        raise InvalidCommandLine(reason="give either --expires or --for", command="maya user token")
    if lasts is not None:
        expires = _in(lasts)
    client = ServiceClient.find()
    owner = name or client.ask(requests.me())["name"]
    made = client.ask(requests.add_token(owner, note=note, expires=expires))
    return output.answer(made, _secret(made, credentials.token_file(), settings.language), settings)


def tokens(name: str | None, settings: OutputSettings) -> int:
    """List the tokens of a user, by default the caller's; raises `UnknownName`, `NotAllowed`."""
    client = ServiceClient.find()
    chosen = name or client.ask(requests.me())["name"]
    found = client.ask(requests.tokens(chosen))
    text = (
        _tokens(found, settings.language)
        if found
        else translate("{name} has no tokens.", settings.language, name=chosen)
    )
    return output.answer({"tokens": found}, text, settings)


def revoke(token: str, settings: OutputSettings) -> int:
    """Revoke a token at once, by its id or the whole token; raises `NotFound`."""
    parts = token.split("_")
    name = parts[1] if len(parts) == 3 else token
    removed = ServiceClient.find().ask(requests.revoke_token(name))
    return output.answer(
        removed, translate("Token {removed} is no longer valid.", settings.language, **removed), settings
    )


def _tokens(found: Sequence[Mapping[str, Any]], language: str) -> str:
    session = translate("session", language)
    head = _head((marked("token"), marked("note"), marked("since"), marked("until"), marked("last seen")), language)
    rows = [
        (
            one["id"],
            f"{session} {one['note']}" if one["session"] else one["note"],
            _day(one["created"]),
            _minute(one["expires"]),
            _minute(one["used"]),
        )
        for one in found
    ]
    return table(head, rows)


def added_text(made: Mapping[str, Any], file: Path, language: str) -> str:
    """Return the text about a new user and the token, which is to be put into `file`."""
    added = translate("{user} is {role} now.", language, **made)
    return f"{added}\n{_secret(made, file, language)}"


def _secret(made: Mapping[str, Any], file: Path, language: str) -> str:
    return translate(
        "{token}\n"
        "This token is shown only once. It gives the access of {user}: put it into $MAYA_TOKEN, "
        "or as the only line into {file}.",
        language,
        **made,
        file=file,
    )


def _head(texts: Sequence[str], language: str) -> tuple[str, ...]:
    return tuple(translate(text, language) for text in texts)


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
    """Prompt for a password, twice on a terminal; raises `InvalidValue` if it is empty or the two differ."""
    password = _asked(marked("New password (at least 12 characters): "), language)
    if not password:
        raise InvalidValue(key="password", value="", reason="it is empty; --none removes a password")
    if sys.stdin.isatty() and _asked(marked("Once more: "), language) != password:
        raise InvalidValue(key="password", value="…", reason="the second one differs from the first")
    return password


def _asked(text: str, language: str) -> str:
    """Prompt for a secret without echo; without a terminal, read the next line of the input.

    Raises `InvalidCommandLine` at the end of the input.
    """
    if sys.stdin.isatty():
        try:
            return getpass(translate(text, language))
        except EOFError:
            raise InvalidCommandLine(reason="no password was given", command="maya user") from None
    return sys.stdin.readline().rstrip("\n")


def reset(name: str, journal: str | None, settings: OutputSettings) -> int:
    """Make `name` an administrator with a new token, and keep other users; raises as `_in_file`.

    `journal` is the file of the queue, None for the default file.
    """
    checked_name(name)
    shown = callers.new()
    run(_in_file(journal, lambda users, kept: _administrator(name, shown, users, kept)))
    place = files.keep_token(shown.text)
    made = {"user": name, "role": Role.ADMIN.word, "token": shown.text, "id": shown.id}
    text = added_text(made, place, settings.language)
    return output.answer({**made, "kept": True}, text, settings)


def forget(journal: str | None, settings: OutputSettings) -> int:
    """Delete all users and tokens in a file, and the token of this user if it was one of them.

    Raises as `_in_file`, and `FileUnwritable`.
    """
    gone: set[str] = set()

    def everybody(users: Sequence[User], kept: Sequence[Token]) -> Change:
        gone.update(token.id for token in kept)
        return Change(without_users=tuple(user.name for user in users))

    run(_in_file(journal, everybody))
    said = [
        translate("All users and tokens are removed: anyone on this machine has full access again.", settings.language)
    ]
    place = files.remove_token(gone)
    if place is not None:
        said.append(translate("Your token in {file} was one of them, and was removed.", settings.language, file=place))
    return output.answer({"users": []}, "\n".join(said), settings)


async def _in_file(journal: str | None, change_of: Callable[[Sequence[User], Sequence[Token]], Change]) -> None:
    """Change users and tokens in the file of the queue; raises `StorageInUse`, `StorageDamaged` and related errors."""
    path = own_queue_file() if journal is None else Path(journal)
    file.require_place(path)
    path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    lock = file.JournalLock(path)
    try:
        file.open_for_writing(path).close()
        store = FileStore(path)
        try:
            await store.apply(change_of(*await store.load()))
        finally:
            await store.close()
    finally:
        lock.release()


def _administrator(name: str, shown: callers.PresentedToken, users: Sequence[User], kept: Sequence[Token]) -> Change:
    """Return the change that makes `name` an administrator with only this token; the password does not change."""
    today = now()
    before = next((user for user in users if user.name == name), User(name, Role.ADMIN, today))
    token = Token(shown.id, name, Hasher().hash_now(shown.secret), "reset", today)
    lost = tuple(one.id for one in kept if one.user == name)
    return Change(users=(replace(before, role=Role.ADMIN),), tokens=(token,), without_tokens=lost)
