"""Jobs as text over HTTP: parsed with the place of the first mistake, and written in the form of the examples."""

from __future__ import annotations

from math import pi
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.i18n import LANGUAGES
from maya_un.process.computation import MOST_TEXT
from maya_un.process.spec.documents import write_yaml
from maya_un.process.spec.examples import EXAMPLES as PACKAGED
from maya_un.process.spec.job import Job
from tests.unit.http.test_teaching import http_client

EXAMPLES = sorted((Path(__file__).resolve().parents[3] / "examples").glob("*.yaml"))
EXAMPLES_IDS = [path.stem for path in EXAMPLES]


@pytest.mark.parametrize("text", [path.read_text(encoding="utf-8") for path in EXAMPLES], ids=EXAMPLES_IDS)
async def test_example_is_parsed_and_written_again(text: str) -> None:
    async with http_client() as (_, client):
        parsed = (await client.post("/v1/jobs/parse", json={"text": text})).json()
        assert parsed["mistake"] is None
        assert Job.parse(parsed["job"]) == Job.parse(yaml.safe_load(text))
        written = (await client.post("/v1/jobs/format", json=parsed["job"])).json()["text"]
        again = (await client.post("/v1/jobs/parse", json={"text": written})).json()
        assert again == parsed


async def test_units_become_si() -> None:
    text = "parts: {cube: [500 mm, 1.1]}\nsteps:\n- home\n- pick: cube\n- move: {a: 90 deg, b: 1.2, c: 120 cm}\n"
    async with http_client() as (_, client):
        parsed = (await client.post("/v1/jobs/parse", json={"text": text})).json()
        assert parsed["job"] == {
            "parts": {"cube": [0.5, 1.1]},
            "steps": [{"home": True}, {"pick": "cube"}, {"move": [pytest.approx(pi / 2), 1.2, 1.2]}],
        }


@pytest.mark.parametrize(
    ("text", "mistake"),
    [
        (
            "name: x\nsteps:\n  - pick: [500, 1100]\n",
            (3, 5, "steps.0.pick", "0: no robot reaches 500 m; for mm write 500 mm"),
        ),
        ("steps: [home", (1, 13, "", "expected ',' or ']'")),
        ("steps:\n  - home\nsteps:\n  - home\n", (3, 1, "", "the key 'steps' appears twice")),
        ("parts: &a {}\nsteps: *a\n", (2, 8, "", "aliases (*name) are not accepted")),
        (
            "name: x\nsteps:\n  - home\n  - pick: 7\n",
            (4, 5, "steps.1.pick", "it must be [x, y] or [x, y, z] in metres"),
        ),
        ("name: x\nsteps:\n  - fly\n", (3, 5, "steps.0", "a step is one of")),
        ("steps:\n  - home\nspeed: 3\n", (3, 1, "speed", "there is no such key")),
        ("name: x\n", (1, 1, "steps", "it is missing")),
        ("", (1, 1, "job", "it must be a mapping")),
        ("- home\n", (1, 1, "job", "it must be a mapping")),
        ("x: !!python/object/apply:os.getcwd []\n", (1, 4, "", "could not determine a constructor")),
        ("steps:\n  - wait: !!bool x\n", (2, 11, "", "'x' is no value of the type !!bool")),
        ("!!int ''\n", (1, 1, "", "'' is no value of the type !!int")),
        ("[" * 5000 + "]" * 5000, (1, 51, "", "it is nested too deeply")),
    ],
)
async def test_mistake_has_its_place(text: str, mistake: tuple[int, int, str, str]) -> None:
    async with http_client() as (_, client):
        answer = (await client.post("/v1/jobs/parse", json={"text": text})).json()
    assert answer["job"] is None
    found = answer["mistake"]
    *place, reason = mistake
    assert [found["line"], found["column"], found["key"]] == place
    assert reason in found["reason"]


@pytest.mark.parametrize("body", [{}, {"text": 3}, {"text": "a", "more": 1}, {"text": "x" * (MOST_TEXT + 1)}])
async def test_invalid_request_is_refused(body: dict[str, Any]) -> None:
    async with http_client() as (_, client):
        answer = await client.post("/v1/jobs/parse", json=body)
        assert (answer.status_code, answer.json()["details"]["key"]) == (400, "text")
        assert (await client.post("/v1/jobs/format", json={"steps": ["fly"]})).json()["code"] == 4002


async def test_examples_are_returned_with_titles_in_every_language() -> None:
    async with http_client() as (_, client):
        found = (await client.get("/v1/examples")).json()
        assert [(one["name"], one["text"]) for one in found] == [(path.stem, path.read_text()) for path in EXAMPLES]
        assert found[0]["title"] == {"en": "pick and place", "es": "recoger y colocar"}
        assert found[0]["about"]["en"].startswith("One part from one side of the table to the other")
        for example in found:
            assert example["title"].keys() == example["about"].keys() == set(LANGUAGES)
            assert all((*example["title"].values(), *example["about"].values()))


def test_examples_of_the_repository_are_those_of_the_package() -> None:
    assert sorted(path.resolve() for path in EXAMPLES) == sorted(PACKAGED.glob("*.yaml"))


NAMES = st.text(min_size=1, max_size=12).filter(str.isprintable)
LENGTHS = st.floats(-10.0, 10.0, allow_nan=False)
JOBS = st.fixed_dictionaries(
    {
        "name": NAMES,
        "steps": st.lists(st.just("home") | st.fixed_dictionaries({"pick": NAMES}), min_size=1, max_size=5),
    },
    optional={"parts": st.dictionaries(NAMES, st.lists(LENGTHS, min_size=2, max_size=3), max_size=3)},
)


@given(JOBS)
def test_written_job_is_the_same_job(job: dict[str, Any]) -> None:
    assert Job.parse(yaml.safe_load(write_yaml(job))) == Job.parse(job)
