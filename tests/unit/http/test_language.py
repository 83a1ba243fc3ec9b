from __future__ import annotations

import pytest

from maya_un.http.errors import language_of


@pytest.mark.parametrize(
    ("wanted", "language"),
    [
        ("", "en"),
        ("es", "es"),
        ("es-CO,es;q=0.9", "es"),
        ("EN", "en"),
        ("fr, es;q=0.5, en;q=0.4", "es"),
        ("en;q=0.2, es;q=0.9", "es"),
        ("fr", "en"),
        ("es;q=0", "en"),
        ("es;q=much", "en"),
        (";;,=,", "en"),
    ],
)
def test_of_the_languages_we_have_the_one_wanted_most(wanted: str, language: str) -> None:
    assert language_of({"accept-language": wanted}) == language
    assert language_of({}) == "en"
