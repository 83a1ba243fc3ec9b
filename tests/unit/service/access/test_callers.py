"""From what a request shows to who asks."""

from __future__ import annotations

import asyncio
from datetime import timedelta

import pytest

from maya_un.errors import MayaError, NotSignedIn, TooManyRequests
from maya_un.service.access.callers import FAILURE_COSTS, LIMIT, WINDOW, new, parse
from maya_un.service.access.operations import Caller, Role
from tests.authentication import CallerRegistry, caller_registry
from tests.virtual_time import elapse, turn

WRONG = [
    None,
    "",
    "Bearer",
    "Bearer ",
    "Basic cm9vdDpyb290",
    "Bearer maya_",
    "Bearer maya_00000000_" + "0" * 48,
    "Bearer ñ\udcff\x00",
    "Bearer " + "x" * 100_000,
    "maya_00000000_" + "0" * 48,
]


async def sat_here(
    owner: CallerRegistry, header: str | None = None, *, stopping: bool = False, lease: str = ""
) -> Caller:
    return await owner.access.callers.resolve(header, lease, "127.0.0.1", loopback=True, stopping=stopping)


async def refusal(
    owner: CallerRegistry, header: str | None, source: str = "10.0.0.9", *, stopping: bool = False
) -> MayaError:
    with pytest.raises(MayaError) as found:
        await owner.access.callers.resolve(header, "", source, loopback=False, stopping=stopping)
    return found.value


async def test_without_users_a_local_caller_has_full_access() -> None:
    owner = caller_registry()
    caller = await sat_here(owner, lease="abc")
    assert caller == Caller("local", Role.ADMIN, "127.0.0.1", "abc", implicit=True)


@pytest.mark.parametrize("header", WRONG)
@pytest.mark.parametrize("stopping", [False, True])
async def test_without_users_a_remote_caller_is_refused(header: str | None, stopping: bool) -> None:
    assert isinstance(await refusal(caller_registry(), header, stopping=stopping), NotSignedIn)


@pytest.mark.parametrize("header", WRONG)
async def test_once_users_are_kept_a_valid_token_is_needed_everywhere(header: str | None) -> None:
    owner = caller_registry()
    await owner.admin()
    assert isinstance(await refusal(owner, header), NotSignedIn)
    with pytest.raises(NotSignedIn):
        await sat_here(owner, header)


@pytest.mark.parametrize("header", WRONG)
async def test_here_a_stop_needs_nothing_and_waits_for_nothing(header: str | None) -> None:
    owner = caller_registry()
    await owner.admin()
    before = asyncio.get_running_loop().time()
    for _ in range(3 * LIMIT):
        caller = await sat_here(owner, header, stopping=True)
        assert (caller.role, caller.implicit) == (Role.VIEWER, False)
    assert asyncio.get_running_loop().time() == before


async def test_local_stop_is_attributed_to_the_owner_of_a_known_token() -> None:
    owner = caller_registry()
    made = await owner.people.add("root", "admin")
    assert (await sat_here(owner, f"Bearer {made.token}", stopping=True)).name == "root"


async def test_token_identifies_the_caller() -> None:
    owner = caller_registry()
    await owner.admin()
    made = await owner.people.add("sam", "student")
    for header in (f"Bearer {made.token}", f"bearer   {made.token} ", f"BEARER {made.token}"):
        caller = await owner.access.callers.resolve(header, "L", "10.0.0.7", loopback=False)
        assert caller == Caller("sam", Role.STUDENT, "10.0.0.7", "L", token=made.id)


async def test_a_token_of_an_earlier_run_is_found_by_its_hash() -> None:
    """Another `Callers` of the same register has never seen the token."""
    owner, other = caller_registry(), caller_registry()
    made = await owner.people.add("root", "admin")
    other.access.register.users.update(owner.access.register.users)
    other.access.register.tokens.update(owner.access.register.tokens)
    callers = await asyncio.gather(*(other.resolve(made.token) for _ in range(30)))
    assert {caller.name for caller in callers} == {"root"}
    nearly = made.token[:-1] + ("0" if made.token[-1] != "0" else "1")
    assert isinstance(await refusal(other, f"Bearer {nearly}"), NotSignedIn)


async def test_revoked_or_expired_token_is_refused() -> None:
    owner = caller_registry()
    root = await owner.admin()
    made = await owner.people.token("root", expires="2026-11-22", by=root)
    owner.days.today += timedelta(hours=14, minutes=59)
    assert (await owner.resolve(made.token)).name == "root"
    owner.days.today += timedelta(minutes=1)
    assert isinstance(await refusal(owner, f"Bearer {made.token}"), NotSignedIn)
    other = await owner.people.token("root", by=root)
    await owner.people.revoke(other.id, by=root)
    assert isinstance(await refusal(owner, f"Bearer {other.token}"), NotSignedIn)


async def test_a_token_that_is_revoked_while_it_is_looked_at_is_not_let_in() -> None:
    owner, other = caller_registry(), caller_registry()
    made = await owner.people.add("root", "admin")
    other.access.register.users.update(owner.access.register.users)
    other.access.register.tokens.update(owner.access.register.tokens)
    asked = asyncio.ensure_future(other.resolve(made.token))
    await turn()
    del other.access.register.tokens[made.id]
    with pytest.raises(NotSignedIn):
        await asked


async def test_the_role_is_that_of_now() -> None:
    owner = caller_registry()
    root = await owner.admin()
    made = await owner.people.add("sam", "operator")
    await owner.people.change("sam", role="viewer", by=root)
    assert (await owner.resolve(made.token)).role is Role.VIEWER


async def test_failed_attempts_cost_time_and_are_counted_by_source() -> None:
    owner = caller_registry()
    await owner.admin()
    began = asyncio.get_running_loop().time()
    for _ in range(LIMIT):
        assert isinstance(await refusal(owner, "Bearer nonsense"), NotSignedIn)
    assert asyncio.get_running_loop().time() - began == pytest.approx(LIMIT * FAILURE_COSTS)
    blocked = await refusal(owner, "Bearer nonsense")
    assert isinstance(blocked, TooManyRequests)
    assert blocked.details == {"limit": LIMIT, "seconds": "60", "wait": WINDOW - LIMIT * FAILURE_COSTS}
    assert isinstance(await refusal(owner, "Bearer nonsense", source="10.0.0.10"), NotSignedIn)
    await elapse(WINDOW)
    assert isinstance(await refusal(owner, "Bearer nonsense"), NotSignedIn)


async def test_simultaneous_attempts_count_like_consecutive_ones() -> None:
    owner = caller_registry()
    await owner.admin()
    found = await asyncio.gather(*(refusal(owner, f"Bearer nonsense {n}") for n in range(5 * LIMIT)))
    assert sum(isinstance(error, NotSignedIn) for error in found) == LIMIT


async def test_right_token_works_while_others_are_wrong() -> None:
    """Also with a token that was not seen in this run: somebody behind the same address must be able to say stop."""
    owner, other = caller_registry(), caller_registry()
    made = await owner.people.add("root", "admin")
    other.access.register.users.update(owner.access.register.users)
    other.access.register.tokens.update(owner.access.register.tokens)
    for _ in range(LIMIT + 1):
        await refusal(other, "Bearer nonsense", source="10.0.0.1")
    assert (await other.resolve(made.token, source="10.0.0.1")).name == "root"
    for _ in range(3 * LIMIT):
        assert (await other.resolve(made.token, source="10.0.0.1")).name == "root"


async def test_invented_tokens_delay_no_right_token() -> None:
    """40 made-up tokens from as many addresses are being looked at when a true one comes."""
    owner, other = caller_registry(), caller_registry()
    made = await owner.people.add("root", "admin")
    other.access.register.users.update(owner.access.register.users)
    other.access.register.tokens.update(owner.access.register.tokens)
    hasher, looked_at = other.access.hasher, list[str]()
    matches = hasher._matches_now

    def counted(hashed: str, secret: str) -> bool:
        looked_at.append(secret)
        return matches(hashed, secret)

    hasher._matches_now = counted
    crowd = [asyncio.ensure_future(refusal(other, "Bearer nonsense", source=f"10.1.0.{n}")) for n in range(40)]
    await turn()
    assert (await other.resolve(made.token)).name == "root"
    assert any(looked_at[:10])  # the secrets of made-up tokens are empty
    await asyncio.gather(*crowd)
    assert len(looked_at) == 41


async def test_failures_are_in_the_audit_log() -> None:
    owner = caller_registry()
    made = await owner.people.add("root", "admin")
    await refusal(owner, "Bearer nonsense")
    await refusal(owner, f"Bearer maya_{made.id}_{'0' * 48}")
    with pytest.raises(NotSignedIn):
        await owner.people.sign_in("root\n", "guess", "10.0.0.9")
    rows = [(row.who, row.source, row.operation, row.code) for row in owner.audit]
    assert rows == [
        ("unknown", "10.0.0.9", "sign in", 4101),
        ("root", "10.0.0.9", "sign in", 4101),
        ("unknown", "10.0.0.9", "sign in", 4101),
    ]


async def test_a_token_has_one_form() -> None:
    shown = new()
    assert parse(shown.text) == shown
    assert len(shown.text) == 4 + 1 + 8 + 1 + 48
    for text in (shown.text + "\n", shown.text.upper(), f" {shown.text}", shown.text[:-1], "maya__", ""):
        assert parse(text) is None
    assert len({new() for _ in range(100)}) == 100
