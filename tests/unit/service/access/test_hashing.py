"""Hashes of secrets."""

from __future__ import annotations

import asyncio

import pytest

from maya_un.service.access.callers import Hasher

CHEAP = Hasher(memory=8, passes=1)


@pytest.mark.parametrize("secret", ["", "correct horse battery", "ñandú", "\udcff", "x" * 10_000])
async def test_a_secret_matches_its_hash_and_no_other(secret: str) -> None:
    hashed = await CHEAP.hashed(secret)
    assert hashed.startswith("$argon2id$")
    assert secret not in hashed or not secret
    assert await CHEAP.matches(hashed, secret)
    assert not await CHEAP.matches(hashed, secret + "x")
    assert hashed != await CHEAP.hashed(secret)


@pytest.mark.parametrize("hashed", ["", "x", "$argon2id$v=19$m=8,t=1,p=1$"])
async def test_invalid_hash_matches_nothing(hashed: str) -> None:
    for secret in ("", "x", hashed):
        assert not await CHEAP.matches(hashed, secret)


async def test_hash_of_another_cost_still_matches() -> None:
    assert await CHEAP.matches(Hasher().hash_now("secret"), "secret")


async def test_the_cost_is_the_one_that_is_meant() -> None:
    assert "$m=12288,t=3,p=1$" in Hasher().hash_now("secret")


def test_loop_continues_while_hashing() -> None:
    """In an ordinary loop: other things get their turn while a hash is worked out."""

    async def counted() -> int:
        turns = 0
        hashing = asyncio.ensure_future(Hasher().hashed("secret"))
        while not hashing.done():
            turns += 1
            await asyncio.wait({hashing}, timeout=0.001)
        return turns

    assert asyncio.run(counted()) > 3
