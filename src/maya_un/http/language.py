"""Which language a client reads."""

from __future__ import annotations

from collections.abc import Mapping

from dmc41x3.i18n import LANGUAGES

_DEFAULT = "en"


def language_of(headers: Mapping[str, str]) -> str:
    """Return the language that Accept-Language wants most of those that we have, English where it wants none."""
    best, most = _DEFAULT, 0.0
    for choice in headers.get("accept-language", "").split(","):
        name, _, rest = choice.partition(";")
        language = name.strip()[:2].lower()
        weight = _weight(rest)
        if language in LANGUAGES and weight > most:
            best, most = language, weight
    return best


def _weight(rest: str) -> float:
    key, _, value = rest.strip().partition("=")
    try:
        return float(value) if key.strip() == "q" else 1.0
    except ValueError:
        return 0.0
