"""`maya user reset`: how the owner of the file gets in again when the administrator's token is lost.

Whoever may write the file of the queue could change it in any other way too, so this asks for nothing else. The service
is down meanwhile: it holds the file's lock.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from dmc41x3.i18n import translate
from dmc41x3.loops import run
from maya_un.cli import output
from maya_un.cli.access import files
from maya_un.cli.access.users import added_text
from maya_un.cli.settings import OutputSettings
from maya_un.config.state_folder import own_state_folder
from maya_un.http.dates import now
from maya_un.process.journal import file
from maya_un.service.access import tokens
from maya_un.service.access.callers import Hasher
from maya_un.service.access.operations import Role
from maya_un.service.access.users import Change, FileStore, Token, User
from maya_un.service.people import checked_name


def reset(name: str, journal: str | None, settings: OutputSettings) -> int:
    """Make `name` an administrator with a new token, beside whatever users there are; raises as `_in_file`.

    `journal` is the file of the queue, None for the usual one.
    """
    checked_name(name)
    shown = tokens.new()
    run(_in_file(journal, lambda users, kept: _administrator(name, shown, users, kept)))
    place = files.keep_token(shown.text)
    made = {"user": name, "role": Role.ADMIN.word, "token": shown.text, "id": shown.id}
    text = added_text(made, place, settings.language)
    return output.answer({**made, "kept": True}, text, settings)


def forget(journal: str | None, settings: OutputSettings) -> int:
    """Forget all users and tokens in a file, and the token of this user if it was one of them.

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
    """Change users and tokens in the file of the queue; raises `StorageInUse`, `StorageDamaged` and their kin."""
    path = own_state_folder() / file.FILE_NAME if journal is None else Path(journal)
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


def _administrator(name: str, shown: tokens.PresentedToken, users: Sequence[User], kept: Sequence[Token]) -> Change:
    """Return what makes `name` an administrator with this token and no other one; a password stays."""
    today = now()
    before = next((user for user in users if user.name == name), User(name, Role.ADMIN, today))
    token = Token(shown.id, name, Hasher().hash_now(shown.secret), "reset", today)
    lost = tuple(one.id for one in kept if one.user == name)
    return Change(users=(replace(before, role=Role.ADMIN),), tokens=(token,), without_tokens=lost)
