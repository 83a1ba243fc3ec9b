from __future__ import annotations

from datetime import UTC, datetime

import pytest

from maya_un.cli.logs.show import moment
from maya_un.errors import InvalidValue

NOW = datetime(2026, 11, 21, 10, 30, tzinfo=UTC)


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("90s", "2026-11-21T10:28:30"),
        ("10m", "2026-11-21T10:20:00"),
        ("10min", "2026-11-21T10:20:00"),
        ("1.5h", "2026-11-21T09:00:00"),
        ("2d", "2026-11-19T10:30:00"),
        ("2026-11-20T08:00:00Z", "2026-11-20T08:00:00"),
        ("2026-11-20T08:00:00+02:00", "2026-11-20T06:00:00"),
    ],
)
def test_a_moment_is_so_long_ago_or_a_date(text: str, meant: str) -> None:
    assert moment(text, NOW) == meant


def test_a_date_without_a_zone_is_this_places() -> None:
    here = datetime(2026, 11, 20, 8, 0).astimezone(UTC)
    assert moment("2026-11-20T08:00", NOW) == here.isoformat(timespec="seconds").removesuffix("+00:00")


@pytest.mark.parametrize("text", ["", "soon", "10", "10w", "-5m", "2026-13-01", "99999999999d"])
def test_invalid_time_is_refused(text: str) -> None:
    with pytest.raises(InvalidValue, match="--since"):
        moment(text, NOW)
