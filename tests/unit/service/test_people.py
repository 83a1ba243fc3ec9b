"""Users and their tokens in the service."""

from __future__ import annotations

import asyncio
from datetime import timedelta
from pathlib import Path

import pytest

from maya_un.errors import (
    InvalidValue,
    LastAdministrator,
    LeaseLost,
    MayaError,
    NotAllowed,
    NotFound,
    NotSignedIn,
    StorageFailed,
    TooManyRequests,
    UnknownName,
)
from maya_un.events import EventLog
from maya_un.process.journal.protocol import AuditRow
from maya_un.process.lease import ControlLease
from maya_un.service.access.callers import LIMIT
from maya_un.service.access.control import AccessControl
from maya_un.service.access.operations import LOCAL, Caller, Role
from maya_un.service.access.users import Change, FileStore, MemoryStore
from maya_un.service.people import MOST_SESSIONS, MOST_TOKENS, SESSION, UserService
from tests.authentication import CallerRegistry, caller_registry

PASSWORD = "correct horse battery"


class FullStore(MemoryStore):
    """A disk without any room left, once it is `full`."""

    full = False

    async def apply(self, change: Change) -> None:
        """Refuse."""
        if self.full:
            raise StorageFailed(reason="the disk is full")


async def is_valid(owner: CallerRegistry, token: str) -> bool:
    try:
        await owner.resolve(token)
    except NotSignedIn:
        return False
    return True


async def test_the_first_user_is_an_administrator() -> None:
    owner = caller_registry()
    for role in ("viewer", "student", "operator"):
        with pytest.raises(InvalidValue, match="first user"):
            await owner.people.add("ann", role)
    made = await owner.people.add("ann", "admin")
    assert (await owner.resolve(made.token)).role is Role.ADMIN
    assert (await owner.people.add("sam", "student")).role == "student"


@pytest.mark.parametrize(
    "name", ["", "Ann", "1ann", "ann b", "a" * 33, "ann\n", "local", "ros", "unknown", "../x", "ñ"]
)
async def test_some_names_cannot_be_had(name: str) -> None:
    with pytest.raises(InvalidValue):
        await caller_registry().people.add(name, "admin")


async def test_a_name_is_had_once_also_by_two_at_a_time() -> None:
    owner = caller_registry()
    await owner.admin()
    found = await asyncio.gather(*(owner.people.add("sam", "student") for _ in range(5)), return_exceptions=True)
    assert sum(isinstance(one, InvalidValue) for one in found) == 4
    assert len(await owner.people.list()) == 2


async def test_a_sign_in_is_in_the_audit_log_whether_it_succeeds_or_not() -> None:
    rows: list[AuditRow] = []
    access = AccessControl.new(ControlLease(EventLog(asyncio.get_running_loop().time)), note=rows.append)
    people = UserService(access, lambda *_: None)
    await people.add("root", "admin", PASSWORD)
    with pytest.raises(NotSignedIn):
        await people.sign_in("root", "wrong horse battery", "10.0.0.1")
    await people.sign_in("root", PASSWORD, "10.0.0.1")
    assert [(row.who, row.source, row.operation, row.code) for row in rows] == [
        ("root", "10.0.0.1", "sign in", NotSignedIn.code),
        ("root", "10.0.0.1", "sign in", 0),
    ]


async def test_secrets_are_nowhere_but_in_the_answer(tmp_path: Path) -> None:
    owner = caller_registry(FileStore(tmp_path / "maya.db"))
    await owner.access.register.open()
    made = await owner.people.add("root", "admin", PASSWORD)
    signed = await owner.people.sign_in("root", PASSWORD, "10.0.0.1")
    shown = repr((await owner.people.list(), await owner.people.tokens("root", LOCAL), owner.events.since(0)))
    await owner.access.register.close()
    kept = b"".join(map(Path.read_bytes, tmp_path.iterdir()))  # noqa: ASYNC240 - nothing else is going on
    for token in (made.token, signed.token):
        secret = token.split("_")[2]
        assert secret not in shown
        assert secret.encode() not in kept
    assert PASSWORD not in shown
    assert PASSWORD.encode() not in kept


async def test_users_outlive_the_program(tmp_path: Path) -> None:
    owner = caller_registry(FileStore(tmp_path / "maya.db"))
    await owner.access.register.open()
    made = await owner.people.add("root", "admin", PASSWORD)
    await owner.access.register.close()
    again = caller_registry(FileStore(tmp_path / "maya.db"))
    await again.access.register.open()
    assert (await again.resolve(made.token)).role is Role.ADMIN
    assert (await again.people.sign_in("root", PASSWORD, "")).user == "root"
    await again.access.register.close()


async def test_when_a_token_was_used_is_known_after_a_restart(tmp_path: Path) -> None:
    owner = caller_registry(FileStore(tmp_path / "maya.db"))
    await owner.access.register.open()
    made = await owner.people.add("root", "admin")
    owner.days.today += timedelta(hours=1)
    await owner.resolve(made.token)
    await owner.access.register.close()
    again = caller_registry(FileStore(tmp_path / "maya.db"))
    await again.access.register.open()
    assert [line.used for line in await again.people.tokens("root", LOCAL)] == ["2026-11-21T10:00:00+00:00"]
    await again.access.register.close()


async def test_the_last_administrator_stays() -> None:
    owner = caller_registry()
    root = await owner.admin()
    for role in ("viewer", "student", "operator"):
        with pytest.raises(LastAdministrator, match="root is the only administrator"):
            await owner.people.change("root", role=role, by=root)
    with pytest.raises(LastAdministrator):
        await owner.people.remove("root")
    await owner.people.change("root", role="admin", by=root)
    await owner.caller("ann", "admin")
    await owner.people.remove("root")
    with pytest.raises(LastAdministrator):
        await owner.people.remove("ann")


async def test_two_administrators_do_not_remove_each_other() -> None:
    owner = caller_registry()
    await owner.admin()
    await owner.caller("ann", "admin")
    found = await asyncio.gather(owner.people.remove("root"), owner.people.remove("ann"), return_exceptions=True)
    assert [type(one) for one in found] == [type(None), LastAdministrator]


async def test_removed_user_is_refused_and_loses_the_lease() -> None:
    owner = caller_registry()
    await owner.admin()
    made = await owner.people.add("ann", "operator")
    ann = await owner.resolve(made.token)
    taken = await owner.leasing.take(ann)
    await owner.people.remove("ann")
    assert not await is_valid(owner, made.token)
    with pytest.raises(LeaseLost, match="removed"):
        owner.access.lease.require(taken.id, "ann")


async def test_demoted_user_loses_the_lease() -> None:
    owner = caller_registry()
    root = await owner.admin()
    ann = await owner.caller("ann", "operator")
    await owner.leasing.take(ann)
    await owner.people.change("ann", role="admin", by=root)
    assert owner.access.lease.holder is not None
    await owner.people.change("ann", role="viewer", by=root)
    assert owner.access.lease.holder is None


async def test_only_the_token_that_took_the_lease_takes_it_away() -> None:
    owner = caller_registry()
    root = await owner.admin()
    ann = await owner.caller("ann", "operator")
    other = await owner.people.token("ann", by=root)
    await owner.leasing.take(ann)
    await owner.people.revoke(other.id, by=root)
    assert owner.access.lease.holder is not None
    await owner.people.sign_out(ann)
    assert owner.access.lease.holder is None


async def test_tokens_are_made_for_oneself_and_by_administrators_for_others() -> None:
    owner = caller_registry()
    root = await owner.admin()
    sam = await owner.caller("sam", "student")
    with pytest.raises(NotAllowed):
        await owner.people.token("root", by=sam)
    with pytest.raises(NotAllowed):
        await owner.people.tokens("root", by=sam)
    with pytest.raises(NotAllowed):
        await owner.people.tokens("nobody", by=sam)
    assert (await owner.people.token("sam", by=sam)).role == "student"
    assert (await owner.people.token("sam", by=root)).user == "sam"
    assert len(await owner.people.tokens("sam", by=sam)) == 3
    with pytest.raises(UnknownName, match="root, sam"):
        await owner.people.token("nobody", by=root)


async def test_a_token_that_ends_makes_none_that_lasts_longer() -> None:
    owner = caller_registry()
    root = await owner.admin()
    sam = await owner.caller("sam", "student")
    short = await owner.resolve((await owner.people.token("sam", expires="2026-12-01", by=sam)).token)
    for expires in ("", "2026-12-01T00:00:01Z", "2027-01-01"):
        with pytest.raises(InvalidValue, match="ends at 2026-12-01"):
            await owner.people.token("sam", expires=expires, by=short)
    assert (await owner.people.token("sam", expires="2026-11-30", by=short)).expires == "2026-11-30T00:00:00+00:00"
    assert root.token


@pytest.mark.parametrize("text", ["2026-11-21", "2026-11-21T09:00:00Z", "1999-01-01"])
async def test_a_token_does_not_begin_with_its_end(text: str) -> None:
    owner = caller_registry()
    with pytest.raises(InvalidValue, match="past"):
        await owner.people.token("root", expires=text, by=await owner.admin())


@pytest.mark.parametrize(
    "text",
    [
        "tomorrow",
        "2026-13-01",
        "2026-12-32",
        "2026-12-01T24:00:00Z",
        "2026-12-01T12:00:00+02:00",
        "2026-12-01 ",
        "٢٠٢٧-01-01",
    ],
)
async def test_invalid_utc_date_is_refused(text: str) -> None:
    owner = caller_registry()
    with pytest.raises(InvalidValue):
        await owner.people.token("root", expires=text, by=await owner.admin())


async def test_others_tokens_are_not_there() -> None:
    owner = caller_registry()
    root = await owner.admin()
    sam = await owner.caller("sam", "student")
    for token in (root.token, "00000000", "", "'; DROP TABLE access_users"):
        with pytest.raises(NotFound):
            await owner.people.revoke(token, by=sam)
    await owner.people.revoke(sam.token, by=root)
    assert len(await owner.people.tokens("sam", by=root)) == 0


async def test_tokens_are_bounded() -> None:
    owner = caller_registry()
    root = await owner.admin()
    for _ in range(MOST_TOKENS - 1):
        await owner.people.token("root", by=root)
    with pytest.raises(InvalidValue, match="revoke"):
        await owner.people.token("root", by=root)


async def test_session_expires() -> None:
    owner = caller_registry()
    await owner.people.add("root", "admin", PASSWORD)
    session = await owner.people.sign_in("root", PASSWORD, "10.0.0.1")
    owner.days.today += timedelta(seconds=SESSION - 1)
    assert await is_valid(owner, session.token)
    owner.days.today += timedelta(seconds=1)
    assert not await is_valid(owner, session.token)


async def test_the_oldest_session_gives_way() -> None:
    owner = caller_registry()
    await owner.people.add("root", "admin", PASSWORD)
    sessions = [await owner.people.sign_in("root", PASSWORD, f"10.0.0.{n}") for n in range(MOST_SESSIONS + 3)]
    assert [await is_valid(owner, one.token) for one in sessions] == [False] * 3 + [True] * MOST_SESSIONS


@pytest.mark.parametrize("name", ["root", "sam", "nobody", "", "x" * 10_000])
async def test_a_wrong_name_or_password_is_refused_alike(name: str) -> None:
    owner = caller_registry()
    await owner.people.add("root", "admin", PASSWORD)
    await owner.people.add("sam", "student")
    began = asyncio.get_running_loop().time()
    with pytest.raises(NotSignedIn) as refusal:
        await owner.people.sign_in(name, "", "10.0.0.1")
    assert refusal.value.details == {"reason": "the name or the password is wrong"}
    assert asyncio.get_running_loop().time() - began == pytest.approx(0.5)


async def test_guessing_passwords_is_bounded() -> None:
    owner = caller_registry()
    await owner.people.add("root", "admin", PASSWORD)
    for guess in range(LIMIT):
        with pytest.raises(NotSignedIn):
            await owner.people.sign_in("root", f"guess {guess}", "10.0.0.1")
    with pytest.raises(TooManyRequests):
        await owner.people.sign_in("root", PASSWORD, "10.0.0.1")
    assert (await owner.people.sign_in("root", PASSWORD, "10.0.0.2")).user == "root"


async def test_another_password_ends_sessions_and_no_tokens() -> None:
    owner = caller_registry()
    made = await owner.people.add("root", "admin", PASSWORD)
    session = await owner.people.sign_in("root", PASSWORD, "10.0.0.1")
    root = await owner.resolve(made.token)
    assert (await owner.people.change("root", password="another long one", by=root)).password
    assert (await is_valid(owner, session.token), await is_valid(owner, made.token)) == (False, True)
    with pytest.raises(NotSignedIn):
        await owner.people.sign_in("root", PASSWORD, "10.0.0.1")
    assert not (await owner.people.change("root", password="", by=root)).password
    with pytest.raises(NotSignedIn):
        await owner.people.sign_in("root", "", "10.0.0.1")


async def test_a_stolen_token_is_not_enough_for_another_password() -> None:
    owner = caller_registry()
    root = await owner.admin()
    sam = await owner.caller("sam", "student")
    with pytest.raises(NotSignedIn):
        await owner.people.change("sam", password="the thief's own one", by=sam)
    await owner.people.change("sam", password=PASSWORD, by=root)
    with pytest.raises(NotSignedIn):
        await owner.people.change("sam", password="the thief's own one", old="a guess of his", by=sam)
    await owner.people.change("sam", password="my own long one", old=PASSWORD, by=sam)
    with pytest.raises(NotAllowed):
        await owner.people.change("root", password="the thief's own one", by=sam)
    with pytest.raises(NotAllowed):
        await owner.people.change("sam", role="admin", by=sam)


@pytest.mark.parametrize("password", ["short", "", "eleven char", "aaaaaaabbbbbbbcccccccdddd", "abcde" * 52])
async def test_a_password_has_its_length(password: str) -> None:
    with pytest.raises(InvalidValue) as refusal:
        await caller_registry().people.add("root", "admin", password)
    assert "short" not in str(refusal.value)


async def test_granting_rights_needs_the_disk_and_revoking_does_not() -> None:
    store = FullStore()
    owner = caller_registry(store)
    root = await owner.admin()
    ann = await owner.people.add("ann", "operator")
    spare = await owner.people.token("ann", by=root)
    store.full = True
    with pytest.raises(StorageFailed):
        await owner.people.add("sam", "student")
    with pytest.raises(StorageFailed):
        await owner.people.token("ann", by=root)
    assert [user.name for user in await owner.people.list()] == ["ann", "root"]
    with pytest.raises(StorageFailed):
        await owner.people.revoke(spare.id, by=root)
    assert not await is_valid(owner, spare.token)
    with pytest.raises(StorageFailed):
        await owner.people.remove("ann")
    assert not await is_valid(owner, ann.token)


async def test_whoami_returns_the_caller() -> None:
    owner = caller_registry()
    assert (await owner.people.me(LOCAL)).users is False
    sam = Caller("sam", Role.STUDENT, "10.0.0.1", token="0a")
    await owner.admin()
    me = await owner.people.me(sam)
    assert (me.name, me.role, me.token, me.source, me.users) == ("sam", "student", "0a", "10.0.0.1", True)


async def test_notes_are_one_line() -> None:
    owner = caller_registry()
    root = await owner.admin()
    for note in ("a\nb", "x" * 201, "\x1b[2J"):
        with pytest.raises(MayaError):
            await owner.people.token("root", note=note, by=root)
