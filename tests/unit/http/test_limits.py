from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_un.errors import TooManyRequests
from maya_un.http.middleware import Buckets
from maya_un.http.origins import Rate


def taken(buckets: Buckets, source: str, now: float) -> bool:
    """Tell whether a request was let through."""
    try:
        buckets.take(source, now)
    except TooManyRequests:
        return False
    return True


def test_so_many_at_once_and_then_at_a_rate() -> None:
    buckets = Buckets(Rate(per_second=2.0, burst=3.0))
    assert [taken(buckets, "a", 10.0) for _ in range(5)] == [True, True, True, False, False]
    assert [taken(buckets, "a", 11.0) for _ in range(3)] == [True, True, False]
    assert taken(buckets, "a", 11.4) is False
    assert taken(buckets, "a", 11.5) is True


def test_refused_client_learns_when_to_retry() -> None:
    buckets = Buckets(Rate(per_second=0.25, burst=1.0))
    buckets.take("a", 0.0)
    with pytest.raises(TooManyRequests) as caught:
        buckets.take("a", 1.0)
    assert caught.value.details == {"limit": 1, "seconds": "4", "wait": 3}
    assert taken(buckets, "a", 4.0)


def test_one_source_does_not_use_up_the_limit_of_another() -> None:
    buckets = Buckets(Rate(1.0, 1.0))
    assert [taken(buckets, source, 0.0) for source in ("a", "b", "a")] == [True, True, False]


def test_all_addresses_of_an_ipv6_network_are_one_source() -> None:
    buckets = Buckets(Rate(1.0, 1.0))
    near, same, other = "2001:db8:1:2::1", "2001:db8:1:2:ffff::9%eth0", "2001:db8:1:3::1"
    assert [taken(buckets, source, 0.0) for source in (near, same, other)] == [True, False, True]


def test_sources_are_forgotten_the_longest_silent_first() -> None:
    buckets = Buckets(Rate(0.0001, 1.0))
    for number in range(10_050):
        buckets.take(str(number), number / 100.0)
    assert len(buckets) == 10_000
    assert not taken(buckets, "10049", 200.0)
    assert taken(buckets, "0", 200.0)


@given(st.lists(st.floats(0.0, 3.0), max_size=200), st.floats(0.1, 10.0), st.integers(1, 20))
def test_in_no_time_more_than_burst_and_rate_allow(gaps: list[float], rate: float, burst: int) -> None:
    buckets, now = Buckets(Rate(rate, float(burst))), 0.0
    passed: list[float] = []
    for gap in gaps:
        now += gap
        if taken(buckets, "a", now):
            passed.append(now)
    for first, start in enumerate(passed):
        for last in range(first, len(passed)):
            assert last - first + 1 <= burst + rate * (passed[last] - start) + 1e-6
