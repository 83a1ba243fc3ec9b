from __future__ import annotations

import asyncio
import json
from collections import Counter
from typing import Any, cast

import pytest
from jsonschema import Draft202012Validator
from pydantic import TypeAdapter

from maya_un.errors import InvalidJob, by_code
from maya_un.http.app import create_app
from maya_un.http.bridge import Bridge
from maya_un.http.exchange import BodyReader, RawBody
from maya_un.http.openapi import document, job_schema, ruled, task_schema
from maya_un.process.spec.job import Job
from maya_un.robot.primitives import from_dict
from maya_un.service.access.operations import Operation
from maya_un.service.service import Service

APP = create_app(Bridge(cast("asyncio.AbstractEventLoop", None), cast("Service", None)))
DOCUMENT: dict[str, Any] = json.loads(json.dumps(document(APP)))
OPERATIONS = [
    (method, path, operation) for path, methods in DOCUMENT["paths"].items() for method, operation in methods.items()
]


def references(value: Any) -> set[str]:
    """Return everything that a piece of the document refers to."""
    if isinstance(value, list):
        return set().union(*map(references, value))
    if not isinstance(value, dict):
        return set()
    own = {value["$ref"]} if "$ref" in value else set[str]()
    return own.union(*map(references, value.values()))


def test_every_path_is_in_the_document_under_its_own_name() -> None:
    declared = {(method.lower(), route.path_format) for route, _ in ruled(APP) for method in route.methods or ()}
    assert {(method, path) for method, path, _ in OPERATIONS} == declared
    names = Counter(operation["operationId"] for _, _, operation in OPERATIONS)
    assert names.most_common(1)[0][1] == 1
    assert all(name.isidentifier() and name.islower() for name in names)


def test_references_have_a_target() -> None:
    for reference in references(DOCUMENT):
        found: Any = DOCUMENT
        for part in reference.removeprefix("#/").split("/"):
            found = found[part]


def test_every_operation_has_a_description_and_its_errors() -> None:
    for method, path, operation in OPERATIONS:
        assert operation["summary"] and operation["tags"] and operation["responses"], (method, path)
        requests = [Operation(name) for name in operation["x-maya-operations"]]
        assert ("401" in operation["responses"]) == bool(requests) or path == "/v1/session"
        assert ("requestBody" in operation) <= (method in {"post", "put", "patch"}), (method, path)
        for status, response in operation["responses"].items():
            assert set(response["headers"]) == {"Maya", "Maya-Request"}, (method, path, status)
            if int(status) >= 400 and "application/problem+json" in response["content"]:
                schema = response["content"]["application/problem+json"]["schema"]
                codes = schema["allOf"][1]["properties"]["code"]["enum"]
                assert codes and set(codes) <= set(by_code()), (method, path, status)


def test_a_change_of_a_job_has_the_limits_of_its_submission() -> None:
    changes = DOCUMENT["components"]["schemas"]["Changes"]["properties"]
    limits = {"minimum", "maximum", "maxLength", "maxItems"}
    submitted = {
        one["name"]: {key: limit for key, limit in one["schema"].items() if key in limits}
        for one in DOCUMENT["paths"]["/v1/jobs"]["post"]["parameters"]
        if one["in"] == "query" and one["name"] in changes
    }
    assert submitted == {
        name: {key: limit for key, limit in one.items() if key in limits}
        for name, one in changes.items()
        if name != "job"
    }
    assert submitted["notes"] == {"maxLength": 1000}


def test_stop_needs_no_token_and_driving_needs_the_lease() -> None:
    security = {operation["operationId"]: operation["security"] for _, _, operation in OPERATIONS}
    assert security["stop"] == security["abort"] == [{}, {"token": []}]
    assert security["jog"] == [{"token": [], "lease": []}]
    assert security["status"] == [{"token": []}]
    assert security["health"] == []


def test_examples_are_good_requests() -> None:
    shown = 0
    for route, rule in ruled(APP):
        for example in rule.examples.values():
            shown += 1
            if isinstance(rule.takes, BodyReader):
                chosen = rule.takes.kinds[0] if rule.takes.choose is None else rule.takes.choose(example)
                TypeAdapter(chosen).validate_json(json.dumps(example), strict=True)
            elif isinstance(rule.takes, RawBody) and rule.takes.schema is job_schema:
                Job.parse(example)
            elif isinstance(rule.takes, RawBody) and rule.takes.schema is task_schema and "tray" not in str(example):
                from_dict(example, 0.4)
            assert rule.takes is not None, route.path
    assert shown > 25


STATEMENTS = [
    {"wait": 2},
    {"wait": "1.5 min"},
    {"set": {"output": "vacuum", "to": "on"}},
    {"wait_for": {"input": 3, "is": False, "within": "10 s"}},
    {"ask": "Full?"},
    {"ask": {"question": "Full?", "choices": ["yes", "no"]}},
    {"pick": [0.5, 1.1], "speed": "50 %"},
    {"if": {"input": 3, "is": "on"}, "then": ["home", {"if": {"answer": "yes"}, "then": [{"wait": 1}]}], "else": []},
    {"for_each": "box", "do": [{"if": {"input": 1, "is": "off"}, "then": [{"approach": "box[each]"}]}]},
]
WRONG = [
    {"wait": 0},
    {"wait": 1, "ask": "Full?"},
    {"speed": 0.5},
    {"set": {"output": 9, "to": "on"}},
    {"set": {"output": 3}},
    {"if": {"input": 3, "is": "on"}, "then": []},
    {"if": {"input": 3, "is": "on"}, "else": ["home"]},
]


def _accepted(step: Any) -> bool:
    schema = {"$ref": "#/components/schemas/Job", "components": DOCUMENT["components"]}
    return Draft202012Validator(schema).is_valid({"steps": [step]})


@pytest.mark.parametrize("step", STATEMENTS)
def test_the_schema_of_jobs_accepts_every_statement(step: Any) -> None:
    assert _accepted(step)
    Job.parse({"steps": [step]})


@pytest.mark.parametrize("step", WRONG)
def test_the_schema_of_jobs_refuses_wrong_statements(step: Any) -> None:
    assert not _accepted(step)
    with pytest.raises(InvalidJob):
        Job.parse({"steps": [step]})


def test_the_document_is_made_once() -> None:
    assert document(APP) is document(APP)
