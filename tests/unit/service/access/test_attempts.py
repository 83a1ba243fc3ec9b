"""Failed attempts are counted by source."""

from __future__ import annotations

import pytest

from maya_un.errors import TooManyRequests
from maya_un.service.access.callers import LIMIT, WINDOW, Attempts


def tried(attempts: Attempts, source: str, now: float) -> bool:
    try:
        attempts.begin(source, now)
    except TooManyRequests:
        return False
    return True


def test_attempts_per_minute_are_limited_at_any_spacing() -> None:
    attempts = Attempts()
    let_in = [now for now in range(0, 600) if tried(attempts, "a", float(now))]
    for start in range(600):
        assert sum(start <= now < start + WINDOW for now in let_in) <= LIMIT
    assert len(let_in) == 10 * LIMIT


def test_one_that_was_right_does_not_count() -> None:
    attempts = Attempts()
    for _ in range(100):
        assert tried(attempts, "a", 0.0)
        attempts.succeeded("a")
    attempts.succeeded("never seen")


def test_fast_clock_does_not_change_the_limit() -> None:
    attempts = Attempts(scale=50.0)
    assert [tried(attempts, "a", 0.0) for _ in range(LIMIT + 1)] == [True] * LIMIT + [False]
    with pytest.raises(TooManyRequests) as refusal:
        attempts.begin("a", 50.0 * 20.0)
    assert refusal.value.details["wait"] == 40
    assert not tried(attempts, "a", 50.0 * 59.9)
    assert tried(attempts, "a", 50.0 * 60.0)


def test_a_machine_with_a_whole_network_of_addresses_is_one() -> None:
    attempts = Attempts()
    found = [tried(attempts, f"2001:db8:1:2:{n:x}::1%eth0", 0.0) for n in range(LIMIT + 1)]
    assert found == [True] * LIMIT + [False]
    assert tried(attempts, "2001:db8:1:3::1", 0.0)
    assert tried(attempts, "not:an:address", 0.0)
    assert not tried(attempts, "2001:db8:1:2::7", 0.0)


@pytest.mark.parametrize(
    "others", [["127.0.0.1", "127.0.0.2", "127.255.3.4", "::1", "::ffff:127.0.0.9"], ["10.0.0.1", "::ffff:10.0.0.1"]]
)
def test_attempts_of_one_machine_count_together_for_all_its_addresses(others: list[str]) -> None:
    attempts = Attempts()
    found = [tried(attempts, others[n % len(others)], 0.0) for n in range(LIMIT + 1)]
    assert found == [True] * LIMIT + [False]
    assert tried(attempts, "10.0.0.2", 0.0)
    assert tried(attempts, f"{others[0]} 0123abcd", 0.0)


def test_memory_is_bounded() -> None:
    attempts = Attempts()
    for number in range(10_500):
        attempts.begin(f"10.{number}", 0.0)
    assert len(attempts._by_source) == 10_000
