"""Dates and durations as people read them."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta

import pytest

from maya_un.cli.queueing.text import clock_in, clock_text, duration


@pytest.fixture
def bogota(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Set the time zone to five hours behind UTC."""
    monkeypatch.setitem(os.environ, "TZ", "<-05>5")
    time.tzset()
    yield
    monkeypatch.undo()
    time.tzset()


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (None, "–"), (0.0, "0.0 s"), (59.44, "59.4 s"), (59.6, "1:00 min"), (125.0, "2:05 min"), (3599.6, "1:00:00 h"),
        (3725.0, "1:02:05 h"), (90_000.0, "25:00:00 h"),
    ],
)  # fmt: skip
def test_durations(seconds: float | None, text: str) -> None:
    assert duration(seconds) == text


@pytest.mark.usefixtures("bogota")
def test_another_day_is_named_and_the_clock_is_the_one_here() -> None:
    assert clock_text("2020-03-01T03:00:00+00:00") == "2020-02-29 22:00"
    assert clock_text("") == ""


@pytest.mark.usefixtures("bogota")
def test_times_of_today_show_only_the_clock() -> None:
    noon = datetime.now(UTC).astimezone().replace(hour=12, minute=34, second=56)
    assert clock_text(noon.astimezone(UTC).isoformat()) == "12:34:56"


def test_future_time_is_computed_from_the_duration() -> None:
    soon = datetime.now(UTC) + timedelta(days=3)
    assert clock_in(3 * 86_400.0)[:10] == soon.astimezone().strftime("%Y-%m-%d")
