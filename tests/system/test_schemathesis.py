"""Requests made up from the OpenAPI document, good ones and broken ones, as everybody.

No defect, no surprise: every answer is one that the document tells of, and nobody does what his role does not include.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from http import HTTPStatus
from typing import Any

import hypothesis
import pytest
import requests
import schemathesis
from hypothesis import HealthCheck, Phase, settings
from hypothesis.errors import InvalidArgument, Unsatisfiable
from schemathesis import Case, GenerationMode
from schemathesis.checks import not_a_server_error
from schemathesis.core.errors import InvalidSchema
from schemathesis.core.failures import FailureGroup
from schemathesis.schemas import APIOperation
from schemathesis.specs.openapi.checks import (
    content_type_conformance,
    negative_data_rejection,
    response_headers_conformance,
    response_schema_conformance,
    status_code_conformance,
)

from maya_un.errors import InvalidRequest
from maya_un.http.routes.system import LONGEST_WAIT
from maya_un.schema.people import LONGEST
from maya_un.service.access.operations import LOCAL, RULES, Caller, Operation, Role
from maya_un.values import LEAST_SPEED
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
PARTS = 4
PATIENCE = 20.0
"""Longest wait for an answer [s]."""


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SharedRobot]:
    with shared_robot(tmp_path_factory.mktemp("made-up"), users=True) as robot:
        yield robot


def operations(robot: SharedRobot) -> list[APIOperation]:
    """Return every operation of the document, as it is served."""
    document = requests.get(f"{robot.url}/v1/openapi.json", timeout=PATIENCE).json()
    del document["components"]["securitySchemes"]  # everybody shows a token of his own, and none that is made up
    for operation in (operation for methods in document["paths"].values() for operation in methods.values()):
        del operation["security"]
    schema = schemathesis.openapi.from_dict(_without_tuples(document))
    return [schema[path][method.upper()] for path, methods in document["paths"].items() for method in methods]


def _without_tuples(schema: Any) -> Any:
    """Say the same of tuples in other words: schemathesis 4.32 makes of `prefixItems` what it then refuses itself."""
    if isinstance(schema, list):
        return [_without_tuples(one) for one in schema]
    if not isinstance(schema, dict):
        return schema
    plain = {key: _without_tuples(value) for key, value in schema.items() if key != "prefixItems"}
    return plain | {"items": {"anyOf": _without_tuples(schema["prefixItems"])}} if "prefixItems" in schema else plain


def may(who: str, operation: APIOperation) -> bool:
    """Tell from the rules whether somebody may ask for an operation at all."""
    names = [Operation(name) for name in operation.definition.raw["x-maya-operations"]]
    if who == NOBODY:
        return set(names) <= WITHOUT_TOKEN
    role = next(role for role in Role if role.word == who)
    return not names or any(role >= RULES[name].role for name in names)


def made_up(operation: APIOperation, mode: GenerationMode, examples: int, seed: int) -> list[Case]:
    """Draw cases of an operation; none where nothing can be broken in an empty request, or nothing can be drawn."""
    cases: list[Case] = []
    try:
        strategy = operation.as_strategy(generation_mode=mode)

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
            cases.append(case)

        each()
    except (Unsatisfiable, InvalidArgument, InvalidSchema):
        pass
    return cases


class Drawn:
    """Cases of all operations, by mode, drawn once: everybody asks the same, and drawing takes longer than asking."""

    def __init__(self, robot: SharedRobot) -> None:
        self._operations = operations(robot)
        self._parts: dict[int, list[tuple[str, list[Case]]]] = {}

    def part(self, part: int, examples: int, seed: int) -> list[tuple[str, list[Case]]]:
        """Return the cases of one part of the operations, each with what a report calls it."""
        if part not in self._parts:
            self._parts[part] = [
                (f"{operation.label} ({mode.value})", made_up(operation, mode, examples, seed + number))
                for number, operation in enumerate(self._operations[part::PARTS])
                for mode in MODES
            ]
        return self._parts[part]


@pytest.fixture(scope="module")
def drawn(robot: SharedRobot) -> Drawn:
    return Drawn(robot)


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

    def drive(self) -> None:
        """Take the lease, where it is the administrator who asks: somebody should get through to the robot."""
        if self._who == Role.ADMIN.word:
            by = Caller("the-admin", Role.ADMIN)
            taken = self._robot.do(lambda stack: stack.service.lease.take(by, patience=LONGEST, force=True))
            self._lease = taken.id

    def ask(self, case: Case) -> None:
        """Ask, and look at the answer."""
        _shorten(case)
        try:
            response = case.call(
                base_url=self._robot.url, session=self._session, headers=self._headers(case), timeout=PATIENCE
            )
        except requests.Timeout as error:
            raise AssertionError(f"no answer to {case.method} {case.path} {case.query} {case.body}") from error
        too_long = response.status_code == HTTPStatus.REQUEST_ENTITY_TOO_LARGE  # schemathesis expects other refusals
        excluded = [negative_data_rejection] * (_unsaid(case) or too_long)
        case.validate_response(response, checks=CHECKS, excluded_checks=excluded)
        if not may(self._who, case.operation):
            nowhere = response.status_code == 404 and response.json()["code"] == InvalidRequest.code
            refused = too_long or response.status_code in {401, 403}
            assert nowhere or refused, f"{self._who}: {case.method} {case.path}"

    def _headers(self, case: Case) -> dict[str, str]:
        headers = self._robot.headers(self._who)
        if case.operation.definition.raw["operationId"] == "sign_out" and headers:
            name = f"the-{self._who}"
            made = self._robot.do(lambda stack: stack.service.users.token(name, by=LOCAL))
            headers = {"Authorization": f"Bearer {made.token}"}
        return headers | ({"Maya-Lease": self._lease} if self._lease else {})


def _unsaid(case: Case) -> bool:
    """Return whether a query cannot express a value: empty lists and lists of objects have no form there."""
    lists = [value for value in (case.query or {}).values() if isinstance(value, list)]
    return any(not one or any(isinstance(item, dict | list) for item in one) for one in lists)


def _shorten(case: Case) -> None:
    """Request no long wait: a held command would never end, and at its slowest a jog takes hours."""
    wait = str((case.query or {}).get("wait")).lower()
    if wait == "true":
        case.query["wait"] = False
    elif re.fullmatch(r"\d+(\.\d+)?(e[+-]?\d+)?", wait) and float(wait) <= LONGEST_WAIT:
        case.query["wait"] = min(float(wait), 0.01)
    if case.path == "/v1/jog" and isinstance(case.body, dict):
        speed = case.body.get("speed")
        if isinstance(speed, float) and LEAST_SPEED <= speed < 0.1:
            case.body["speed"] = 0.1


@pytest.mark.parametrize("part", range(PARTS))
@pytest.mark.parametrize("who", PEOPLE)
def test_random_request_is_answered_as_documented(
    who: str, part: int, robot: SharedRobot, drawn: Drawn, campaign: Campaign
) -> None:
    visitor = Visitor(robot, who)
    problems: list[str] = []
    for name, cases in drawn.part(part, campaign.size(ci=1, long=60), campaign.seed):
        visitor.drive()
        try:
            for case in cases:
                visitor.ask(case.derive())  # asking changes a case
        except (Exception, FailureGroup) as error:  # noqa: BLE001 - all that is wrong is told at once
            problems.append(f"{name}: {error}")
    visitor.close()
    assert not problems, "\n\n".join(problems)
