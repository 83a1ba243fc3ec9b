"""Requests made up from the OpenAPI document, good ones and broken ones, as everybody.

No defect, no surprise: every answer is one that the document tells of, and nobody does what his role does not include.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Any

import hypothesis
import pytest
import requests
import schemathesis
from hypothesis import HealthCheck, Phase, settings
from hypothesis.errors import Unsatisfiable
from schemathesis import Case, GenerationMode
from schemathesis.checks import not_a_server_error
from schemathesis.core.failures import FailureGroup
from schemathesis.schemas import APIOperation
from schemathesis.specs.openapi.checks import (
    content_type_conformance,
    negative_data_rejection,
    response_headers_conformance,
    response_schema_conformance,
    status_code_conformance,
)

from maya_un.api.access.caller import LOCAL, Role
from maya_un.api.access.operations import RULES, Operation
from tests.campaign import Campaign
from tests.shared_robot import SharedRobot, shared_robot

pytestmark = pytest.mark.system

NOBODY = "nobody"
PEOPLE = (NOBODY, *(role.word for role in Role))
WITHOUT_TOKEN = frozenset({Operation.STOP, Operation.ABORT})
MODES = (GenerationMode.POSITIVE, GenerationMode.NEGATIVE)
CHECKS = [
    not_a_server_error,
    status_code_conformance,
    content_type_conformance,
    response_headers_conformance,
    response_schema_conformance,
    negative_data_rejection,
]
PATIENCE = 20.0
"""Longest wait for an answer [s]."""


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SharedRobot]:
    with shared_robot(tmp_path_factory.mktemp("made-up"), users=True) as robot:
        yield robot


def operations(robot: SharedRobot) -> Iterator[APIOperation]:
    """Return every operation of the document, as it is served; each from a copy, for what draws from one changes it."""
    text = requests.get(f"{robot.url}/v1/openapi.json", timeout=PATIENCE).text
    for path, methods in json.loads(text)["paths"].items():
        for method in methods:
            yield schemathesis.openapi.from_dict(json.loads(text))[path][method.upper()]


def may(who: str, operation: APIOperation) -> bool:
    """Tell from the rules whether somebody may ask for an operation at all."""
    names = [Operation(name) for name in operation.definition.raw["x-maya-operations"]]
    if who == NOBODY:
        return set(names) <= WITHOUT_TOKEN
    role = next(role for role in Role if role.word == who)
    return not names or any(role >= RULES[name].role for name in names)


def tried(strategy: Any, examples: int, seed: int, check: Callable[[Case], None]) -> None:
    """Check cases that a strategy draws."""

    @hypothesis.seed(seed)
    @settings(
        max_examples=examples,
        deadline=None,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large],
    )
    @hypothesis.given(strategy)
    def each(case: Case) -> None:
        check(case)

    each()


class Visitor:
    """Asks a robot as somebody, and looks at what comes."""

    def __init__(self, robot: SharedRobot, who: str) -> None:
        self._robot = robot
        self._who = who
        self._session = requests.Session()
        self._lease = ""

    def close(self) -> None:
        """Hang up."""
        self._session.close()

    def ask(self, case: Case) -> None:
        """Ask, and look at the answer."""
        _shorten(case)
        response = case.call(
            base_url=self._robot.url, session=self._session, headers=self._headers(case), timeout=PATIENCE
        )
        case.validate_response(response, checks=CHECKS)
        if not may(self._who, case.operation):
            assert response.status_code in {401, 403}, f"{self._who}: {case.method} {case.path}"

    def _headers(self, case: Case) -> dict[str, str]:
        headers = self._robot.headers(self._who)
        if case.operation.definition.raw["operationId"] == "sign_out" and headers:
            name = f"the-{self._who}"
            made = self._robot.do(lambda stack: stack.service.users.token(name, by=LOCAL))
            headers = {"Authorization": f"Bearer {made.token}"}
        return headers


def _shorten(case: Case) -> None:
    """Ask for no long wait."""
    wait = (case.query or {}).get("wait")
    if isinstance(wait, int | float) and not isinstance(wait, bool):
        case.query["wait"] = min(wait, 0.01)


@pytest.mark.parametrize("who", PEOPLE)
def test_what_is_made_up_is_answered_as_the_document_says(who: str, robot: SharedRobot, campaign: Campaign) -> None:
    examples = campaign.size(ci=8, long=60)
    visitor = Visitor(robot, who)
    problems: list[str] = []
    for number, operation in enumerate(operations(robot)):
        for mode in MODES:
            try:
                tried(operation.as_strategy(generation_mode=mode), examples, campaign.seed + number, visitor.ask)
            except Unsatisfiable:
                continue  # nothing can be broken in a request that has nothing in it
            except (Exception, FailureGroup) as error:  # noqa: BLE001 - all that is wrong is told at once
                problems.append(f"{operation.label} ({mode.value}): {error}")
    visitor.close()
    assert not problems, "\n\n".join(problems)
