"""The quality of the link: reply times, rate and age of records, losses; in real time also on a faster clock."""

from __future__ import annotations

import pytest

from maya_un.controller.link_quality import REPLIES, LinkQuality
from tests.unit.controller.bench import far_away, now
from tests.virtual_time import elapse


@pytest.mark.parametrize("speed", [1.0, 20.0])
async def test_reply_times_and_the_rate_of_records_are_those_of_the_link(speed: float) -> None:
    async with far_away(0.01, 10.0) as bench:
        await elapse(20.0)
        found = bench.controller.link(speed)
        assert found.up
        assert found.losses == 0
        assert found.reply is not None and found.late_reply is not None
        assert 0.01 <= found.reply * speed <= found.late_reply * speed <= 0.02  # the answer is late by 10 ms
        assert found.age is not None and 0.0 <= found.age <= 0.15 / speed
        if speed == 1.0:
            assert found.records == pytest.approx(10.0, rel=0.2)


async def test_link_without_a_reply_has_no_times() -> None:
    quality = LinkQuality()
    found = quality.view(now(), 1.0, up=False)
    assert (found.up, found.reply, found.late_reply, found.records, found.age) == (False, None, None, 0.0, None)


async def test_only_the_newest_replies_count_and_a_loss_forgets_them() -> None:
    quality = LinkQuality()
    quality.replied(0.0, 9.0)
    for _ in range(REPLIES):
        quality.replied(10.0, 10.1)
    found = quality.view(11.0, 1.0, up=True)
    assert (found.reply, found.late_reply, found.age) == pytest.approx((0.1, 0.1, 0.9))
    quality.lost()
    assert quality.view(11.0, 1.0, up=False).reply is None
    assert quality.view(11.0, 1.0, up=False).losses == 1


async def test_late_reply_is_longer_than_most() -> None:
    quality = LinkQuality()
    for number in range(100):
        quality.replied(0.0, 0.001 * (number + 1))
    found = quality.view(0.2, 1.0, up=True)
    assert (found.reply, found.late_reply) == pytest.approx((0.051, 0.096))
