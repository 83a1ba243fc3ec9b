"""The OpenAPI document, derived from the routes, and the JSON Schemas that its bodies need."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from fastapi.routing import APIRoute
from pydantic import TypeAdapter
from pydantic.json_schema import JsonSchemaMode

from maya_un.config.model import ZoneConfig
from maya_un.errors import (
    InternalError,
    InvalidRequest,
    InvalidValue,
    LeaseHeld,
    LeaseLost,
    LeaseNeeded,
    MachineError,
    MayaError,
    NotAllowed,
    NotSignedIn,
    Stopped,
    StorageFailed,
    TooManyRequests,
    by_code,
)
from maya_un.http.connections import LEASE
from maya_un.http.errors import status_of, title_of
from maya_un.http.exchange import RawBody
from maya_un.http.middleware import UNLIMITED
from maya_un.http.routing import RouteRule
from maya_un.process.computation import MOST_TEXT
from maya_un.process.journal.protocol import JobOptions
from maya_un.process.spec.job import BARE, SKILLS, SPEED, Grid, Job
from maya_un.process.spec.statements import ELSE, STATEMENTS, THEN, JobStatement
from maya_un.robot.primitives import PRIMITIVES
from maya_un.robot.primitives.primitive import Argument, JointTarget, Primitive, Switch, Target
from maya_un.service.access.operations import MOVING, QUEUEING, RULES, STOPPING, Operation
from maya_un.values import FARTHEST

REFERENCE = "#/components/schemas/{model}"

_NUMBER: dict[str, Any] = {"type": "number", "minimum": -FARTHEST, "maximum": FARTHEST}
_TEXT: dict[str, Any] = {"type": "string", "minLength": 1, "maxLength": 64}


def _numbers(names: str, least: int) -> dict[str, Any]:
    """Return the schema of an array of `least` or more numbers, or of an object with them by name."""
    array = {"type": "array", "items": _NUMBER, "minItems": least, "maxItems": len(names)}
    by_name = {
        "type": "object",
        "properties": dict.fromkeys(names, _NUMBER),
        "required": list(names[:least]),
        "additionalProperties": False,
    }
    return {"oneOf": [array, by_name]}


POINT = {**_numbers("xyz", 2), "description": "x, y and z [m]; z is the cell's grasp height where it is left out"}
"""Schema of a place."""

JOINTS = {**_numbers("abc", 3), "description": "a [rad], b and c [m]"}
"""Schema of joints."""


def _object(properties: dict[str, Any], description: str) -> dict[str, Any]:
    return {
        "type": "object",
        "properties": properties,
        "required": list(properties),
        "additionalProperties": False,
        "description": description,
    }


def _or_name(schema: dict[str, Any]) -> dict[str, Any]:
    named = {**_TEXT, "description": "a name, or a cell like tray[1,2]"}
    return {"anyOf": [schema, named]}


def _schema_of(argument: Argument) -> dict[str, Any]:
    match argument:
        case Target():
            return _or_name(POINT)
        case JointTarget():
            return _or_name(JOINTS)
        case _:
            return {"type": "boolean"}


def _task(primitive: type[Primitive]) -> dict[str, Any]:
    argument = primitive.argument
    value = {argument.key: _schema_of(argument)} if argument.key else {}
    return _object({"command": {"const": primitive.command}, **value}, primitive.help(units=True))


def task_schema() -> dict[str, Any]:
    """Return the schema of one primitive."""
    return {
        "title": "Task",
        "description": "One primitive: a step of a job by itself.",
        "oneOf": [_task(primitive) for primitive in PRIMITIVES.values()],
    }


def _step(argument: Argument) -> dict[str, Any]:
    match argument:
        case Target() | JointTarget():
            return _schema_of(argument)
        case Switch(on=on, off=off):
            return {"enum": [on, off]}
        case _:
            return {"const": True}


def _statement(statement: type[JobStatement], schema: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a statement, whose `schema` is that of its model."""
    whole = {key: value for key, value in schema.items() if key not in {"title", "description"}}
    if not statement.short:
        return whole | {"description": statement.summary}
    return {"anyOf": [schema["properties"][statement.short], whole], "description": statement.summary}


def job_schema() -> dict[str, Any]:
    """Return the schema of a job."""
    schema = TypeAdapter(Job).json_schema(ref_template=REFERENCE)
    step, models = schema["$defs"]["Step"], schema["$defs"]
    skills = {name: _step(PRIMITIVES[name].argument) for name in SKILLS}
    statements = {name: _statement(one, models.pop(one.__name__)) for name, one in STATEMENTS.items()}
    shares = [kind for kind in step["properties"]["speed"]["anyOf"] if kind.get("type") != "null"]
    speed = {"anyOf": shares, "description": "share of the speed for this step, if it travels"}
    step["properties"] = {**skills, **statements, SPEED: speed}
    step["oneOf"] = [{"required": [name]} for name in step["properties"] if name != SPEED]
    for places in ("parts", "places"):
        schema["properties"][places] |= {"additionalProperties": POINT}
    lists = (schema["properties"]["steps"], models["ForEach"]["properties"]["do"])
    branches = [models["IfElse"]["properties"][name] for name in (THEN, ELSE)]
    for steps in (*lists, *branches):
        steps["items"]["oneOf"].append({"enum": sorted(BARE)})
    schema["properties"]["repeat"] |= {"minimum": 1, "maximum": 10_000}
    schema["description"] = "A job as people write it: named parts and places, pallets, steps, how often."
    return schema


def text_schema() -> dict[str, Any]:
    """Return the schema of the text of a job."""
    text = {"text": {"type": "string", "maxLength": MOST_TEXT}}
    return {"title": "JobTextRequest"} | _object(text, "The text of a job in YAML.")


def config_schema() -> dict[str, Any]:
    """Return the schema of another configuration."""
    about = "A configuration: the `text` of its file (TOML), or nested `settings` that change the present file."
    return {
        "title": "ConfigRequest",
        "description": about,
        "type": "object",
        "properties": {
            "text": {"type": "string", "maxLength": MOST_TEXT},
            "settings": {
                "type": "object",
                "description": "settings by section; null removes one, so its default holds",
            },
        },
        "minProperties": 1,
        "maxProperties": 1,
        "additionalProperties": False,
    }


def changes_schema() -> dict[str, Any]:
    """Return the schema of the changes of a job."""
    options = TypeAdapter(JobOptions).json_schema(ref_template=REFERENCE)
    options["properties"] = {key: one for key, one in options["properties"].items() if key != "held"}
    options["properties"] = {key: _without_default(one) for key, one in options["properties"].items()}
    options["properties"]["job"] = {"$ref": REFERENCE.format(model="Job")}
    options |= {"title": "Changes", "additionalProperties": False, "minProperties": 1}
    options["description"] = "Changes of a job: its options in the queue, or its steps that have not begun (`job`)."
    return options


def _without_default(schema: dict[str, Any]) -> dict[str, Any]:
    return {key: one for key, one in schema.items() if key != "default"}


def zone_schema() -> dict[str, Any]:
    """Return the schema of a zone in a request, without the name, which is in the path."""
    schema = TypeAdapter(ZoneConfig).json_schema(ref_template=REFERENCE.format(model="{model}Request"))
    kinds = {f"{name}Request": kind for name, kind in schema["$defs"].items()}
    for kind in kinds.values():
        kind["required"] = [key for key in kind["required"] if key != "name"]
    return schema | {"$defs": kinds, "title": "ZoneRequest"}


def pallet_schema() -> dict[str, Any]:
    """Return the schema of a pallet."""
    return TypeAdapter(Grid).json_schema(ref_template=REFERENCE)


Json = dict[str, Any]

_ABOUT = """\
The interface of a running Maya. Lengths in m, angles in rad, times in s; points are [x, y, z], joints are
[a, b, c].

While no users exist, clients on this machine (loopback) need no token. Otherwise each request carries one as
`Authorization: Bearer maya_...`; stop and abort from loopback never need one. Requests that drive the robot need the
control lease as `Maya-Lease`. An error is `application/problem+json` with a code of Maya.
"""
_PROBLEM_TYPE = "application/problem+json"
_PROBLEM: Json = {
    "title": "Problem",
    "description": "An error: RFC 9457, with the code of Maya and the details of its sentence.",
    "type": "object",
    "required": ["type", "title", "status", "code", "detail", "details"],
    "properties": {
        "type": {"type": "string", "examples": ["urn:maya:error:2101"]},
        "title": {"type": "string"},
        "status": {"type": "integer"},
        "code": {"type": "integer"},
        "detail": {"type": "string", "description": "what happened, why, what to do next"},
        "details": {"type": "object"},
    },
}
_SECURITY: Json = {
    "token": {"type": "http", "scheme": "bearer", "description": "`maya user token NAME` makes one."},
    "lease": {"type": "apiKey", "in": "header", "name": LEASE, "description": "The id that POST /v1/lease answers."},
}
_HEADERS: Json = {
    "Maya": {"description": "Version of the server.", "required": True, "schema": {"type": "string"}},
    "Maya-Request": {"description": "Name of the request in the log.", "required": True, "schema": {"type": "string"}},
}
_BINARY: Json = {"type": "string", "format": "binary"}


def document(app: FastAPI) -> Json:
    """Return the OpenAPI document of an application; it is built once."""
    known: Json | None = getattr(app.state, "openapi", None)
    if known is None:
        known = app.state.openapi = _Document(app).whole()
    return known


def ruled(app: FastAPI) -> list[tuple[APIRoute, RouteRule]]:
    """Return all routes with their rules."""
    rules: Mapping[Callable[..., Any], RouteRule] = app.state.rules
    return [(route, rules[route.endpoint]) for route in app.routes if isinstance(route, APIRoute)]


def refusals(route: APIRoute, rule: RouteRule) -> list[type[MayaError]]:
    """Return every kind of error that a route may answer with the status of `status_of`."""
    kinds: list[type[MayaError]] = [InvalidRequest, *rule.refuses]
    if rule.operations:
        kinds += [NotSignedIn, NotAllowed]
    if route.path not in UNLIMITED:
        kinds.append(TooManyRequests)
    if rule.takes is not None or route.methods != {"GET"}:
        kinds.append(InvalidValue)
    if any(RULES[one].drives for one in rule.operations):
        kinds += [LeaseNeeded, LeaseHeld, LeaseLost]
    if (MOVING | QUEUEING).intersection(rule.operations):
        kinds.append(Stopped)
    if any(RULES[one].drives or one in STOPPING | {Operation.PAUSE} for one in rule.operations):
        kinds += [kind for kind in by_code().values() if issubclass(kind, MachineError)]
    if route.methods != {"GET"} and rule.operations:
        kinds.append(StorageFailed)
    return list(dict.fromkeys(kinds))


class _Document:
    """Builder of a document."""

    def __init__(self, app: FastAPI) -> None:
        self._app = app
        self._ruled = ruled(app)
        self._schemas: Json = {"Problem": _PROBLEM}
        self._of = self._described()

    def whole(self) -> Json:
        """Return the whole document."""
        found = get_openapi(
            title="Maya-UN", version=self._app.version, description=_ABOUT, routes=[route for route, _ in self._ruled]
        )
        for route, rule in self._ruled:
            for method in route.methods or ():
                self._fill(found["paths"][route.path_format][method.lower()], route, rule)
        found["components"] = {"schemas": self._schemas, "securitySchemes": _SECURITY, "headers": _HEADERS}
        return found

    def _described(self) -> dict[tuple[str, JsonSchemaMode], Json]:
        """Return the schema of every message by its kind and mode, and store the schemas that they refer to."""
        inputs: list[tuple[str, JsonSchemaMode, TypeAdapter[Any]]] = [
            (str(kind), mode, TypeAdapter(kind)) for _, rule in self._ruled for kind, mode in _messages(rule)
        ]
        schemas, shared = TypeAdapter.json_schemas(inputs, ref_template=REFERENCE)
        self._keep(shared.get("$defs", {}))
        return {(name, mode): schemas[name, mode] for name, mode, _ in inputs}

    def _keep(self, schemas: Json) -> None:
        for name, schema in schemas.items():
            known = self._schemas.setdefault(name, schema)
            assert known == schema, f"two messages are called {name}"

    def _fill(self, operation: Json, route: APIRoute, rule: RouteRule) -> None:
        if rule.takes is not None:
            operation["requestBody"] = self._request(rule)
        operation["responses"] = self._answers(rule) | self._problems(route, rule)
        operation["security"] = _security(rule.operations)
        operation["x-maya-operations"] = [one.value for one in rule.operations]

    def _request(self, rule: RouteRule) -> Json:
        takes = rule.takes
        assert takes is not None
        if isinstance(takes, RawBody):
            whole = takes.schema()
            name = whole["title"]
            self._keep({name: {key: value for key, value in whole.items() if key != "$defs"}})
            self._keep(whole.get("$defs", {}))
            schema, required = {"$ref": REFERENCE.format(model=name)}, True
        else:
            forms = [self._of[str(kind), "validation"] for kind in takes.kinds]
            schema = forms[0] if len(forms) == 1 else {"oneOf": forms}
            required = not takes.optional
        content: Json = {"schema": schema}
        if rule.examples:
            content["examples"] = {name: {"summary": name, "value": value} for name, value in rule.examples.items()}
        return {"required": required, "content": {"application/json": content}}

    def _answers(self, rule: RouteRule) -> Json:
        schema = _BINARY if rule.gives is bytes else self._of[str(rule.gives), "serialization"]
        told: Json = {"headers": _headers(), "content": {rule.media.partition(";")[0]: {"schema": schema}}}
        return {
            str(int(status)): {"description": HTTPStatus(status).phrase} | told for status in (rule.status, *rule.also)
        }

    def _problems(self, route: APIRoute, rule: RouteRule) -> Json:
        by_status: dict[int, list[type[MayaError]]] = {HTTPStatus.FORBIDDEN: [InvalidRequest]}
        if "{" in route.path:
            by_status[HTTPStatus.NOT_FOUND] = [InvalidRequest]  # a name with a line break matches no path
        for kind in refusals(route, rule):
            by_status.setdefault(int(status_of(kind)), []).append(kind)
        for status in (HTTPStatus.REQUEST_TIMEOUT, HTTPStatus.REQUEST_ENTITY_TOO_LARGE):
            by_status[status] = [InvalidRequest]
        by_status.setdefault(HTTPStatus.INTERNAL_SERVER_ERROR, []).append(InternalError)
        return {str(int(status)): _problem(kinds) for status, kinds in sorted(by_status.items())}


def _messages(rule: RouteRule) -> Iterable[tuple[Any, JsonSchemaMode]]:
    if rule.gives is not bytes:
        yield rule.gives, "serialization"
    if rule.takes is not None and not isinstance(rule.takes, RawBody):
        for kind in rule.takes.kinds:
            yield kind, "validation"


def _problem(kinds: Iterable[type[MayaError]]) -> Json:
    of = list(dict.fromkeys(kinds))
    words = "; ".join(f"{kind.code} {title_of(kind).lower()}" for kind in of)
    codes: Json = {"properties": {"code": {"enum": [kind.code for kind in of]}}}
    schema = {"allOf": [{"$ref": REFERENCE.format(model="Problem")}, codes]}
    return {"description": words, "headers": _headers(), "content": {_PROBLEM_TYPE: {"schema": schema}}}


def _headers() -> Json:
    return {name: {"$ref": f"#/components/headers/{name}"} for name in _HEADERS}


def _security(operations: tuple[Operation, ...]) -> list[Json]:
    if not operations:
        return []
    if STOPPING.issuperset(operations):
        return [{}, {"token": []}]
    return [{"token": []} | ({"lease": []} if all(RULES[one].drives for one in operations) else {})]
