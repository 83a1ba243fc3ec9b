"""Moments as people say them: two hours ago, or a date."""

from __future__ import annotations

import re
from datetime import UTC, datetime, timedelta

from maya_un.errors import InvalidValue

_AGO = re.compile(r"(\d+(?:\.\d+)?)(s|min|m|h|d)")
_SECONDS = {"s": 1.0, "m": 60.0, "min": 60.0, "h": 3600.0, "d": 86_400.0}


def moment(text: str, now: datetime) -> str:
    """Return the moment meant by 90s, 10m, 2h, 3d (so long before `now`) or a date (ISO 8601), in UTC as files have it.

    A date without a zone is this place's. Raises `InvalidValue`.
    """
    ago = _AGO.fullmatch(text.strip())
    try:
        if ago is not None:
            when = now - timedelta(seconds=float(ago[1]) * _SECONDS[ago[2]])
        else:
            when = datetime.fromisoformat(text.strip())
        return when.astimezone(UTC).isoformat(timespec="seconds").removesuffix("+00:00")
    except (ValueError, OverflowError) as error:
        reason = "it is so long ago, like 10m or 2h, or a date, like 2026-11-21T09:30"
        raise InvalidValue(key="--since", value=repr(text), reason=reason) from error
