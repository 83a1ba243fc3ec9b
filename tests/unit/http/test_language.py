from __future__ import annotations

import pytest

from maya_un.errors import NotHomed, Unreachable
from maya_un.http.errors import language_of
from tests.unit.http.service_stand_in import ServiceStandIn, app_client


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


@pytest.mark.parametrize("language", ["en", "es"])
async def test_texts_are_translated_in_their_order_and_unknown_ones_stay(language: str) -> None:
    errors = (
        NotHomed(command="maya home"),
        Unreachable(target="bolt", reason="it must be a text", nearest="(0.5, 1.2)"),
    )
    texts = ["Bolt 7", *(error.text("en") for error in errors), "", "it must be a number between -10 and 10"]
    spanish = ["Bolt 7", *(error.text("es") for error in errors), "", "debe ser un número entre -10 y 10"]
    async with app_client(ServiceStandIn()) as client:
        answer = await client.post("/v1/translations", json={"texts": texts, "language": language})
        assert answer.json() == (texts if language == "en" else spanish)


@pytest.mark.parametrize(
    ("body", "key"),
    [
        ({"texts": ["a"], "language": "fr"}, "language"),
        ({"texts": ["a"]}, "language"),
        ({"texts": ["a"] * 51, "language": "es"}, "texts"),
        ({"texts": ["a" * 2001], "language": "es"}, "texts.0"),
        ({"texts": [7], "language": "es"}, "texts.0"),
    ],
)
async def test_too_many_or_other_texts_are_refused(body: dict[str, object], key: str) -> None:
    async with app_client(ServiceStandIn()) as client:
        answer = await client.post("/v1/translations", json=body)
        assert answer.status_code in {400, 422}
        assert answer.json()["details"]["key"] == key
