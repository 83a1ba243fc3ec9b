"""The page of docs that lists every path of the HTTP interface; `gen_docs.py` writes it."""

from __future__ import annotations

import asyncio
import inspect
import json
from collections.abc import Iterator
from typing import cast

from fastapi.routing import APIRoute

from maya_un.assembly.staff import PEOPLE_BOUNDS
from maya_un.http.app import create_app
from maya_un.http.bridge import Bridge
from maya_un.http.errors import AGAIN
from maya_un.http.middleware import BODY_LIMIT, BODY_PATIENCE, LONG
from maya_un.http.openapi import ruled
from maya_un.http.origins import CLIENTS_EACH, FAR, FILES, NEAR
from maya_un.http.protocol import ANSWER_PATIENCE
from maya_un.http.routing import RouteRule
from maya_un.process.computation import MOST_SAMPLED
from maya_un.process.spec.job import MOST_NAMES
from maya_un.process.spec.json_object import MOST_VALUES
from maya_un.service.access.operations import RULES, Operation, Role
from maya_un.service.service import Service

INTRODUCTION = f"""\
# HTTP

`maya up` serves this interface on loopback, on port 4133 by default (`--port`). With `--listen` it also serves [other
machines](../how-to/run-as-a-service.md). Lengths are in m, angles in rad, times in s. A point is `[x, y, z]`; joints
are `[a, b, c]`. For live data use [the websocket](websocket.md).

`GET /v1/openapi.json` is the complete description for tools. It has every message with schema and examples, every
error of each path, and the operations of each path (`x-maya-operations`). Client generators use its operation ids as
method names. Maya does not serve Swagger UI or a similar page, because these load scripts from other sites. Open the
document in a viewer of your own.

## Authentication

While no users exist, everybody on this machine has full access without a token. Once users exist, a request needs a
token. From other machines a request always needs one. Send it as `Authorization: Bearer maya_...`; get it from
`maya user token` or `POST /v1/session`. Stop and abort from loopback, and paths marked "anybody", need no token.

The tables name the least role that may send a request. [Roles](roles.md) lists the rights. An operation marked
"drives" also needs the [control lease](../how-to/share-the-robot.md). Send its `id` in the header `Maya-Lease`. While
no users exist, a request without this header holds the lease for its own duration, if nobody else holds it.

On loopback, the header `Host` must be a loopback name or address. From other machines, `Host` may be an IP address,
the host name of this machine, or the host of a `maya up --origin URL`. A browser sends the header `Origin`; its host
and port must be those of `Host`, or it must be the origin of a `maya up --origin URL` (CORS). So a web page at another
port of this machine is refused, even if it only reads. Programs send no `Origin`. A request with a header `Forwarded`,
`X-Forwarded-For` or `X-Real-IP` counts as a request from another machine.

## Limits

The rate limit is {NEAR.per_second:g} requests per second with a burst of {NEAR.burst:g} for this machine, and
{FAR.per_second:g} with a burst of {FAR.burst:g} for each other address. Further requests get status 429 with
`Retry-After`. There is no limit for stop and abort. Files of pages, which are outside of `/v1` and `/metrics`, do not
count; another address may get {FILES.per_second:g} of them per second, with a burst of {FILES.burst:g}. These limits
allow for {CLIENTS_EACH} clients behind one address; `maya up --clients-per-address N` raises them, the connections and
the streams of one address in proportion.

A body with a job may have {BODY_LIMIT // 1_000_000} MB; any other body may have {LONG // 1024} kB. The JSON of a body
may have {MOST_VALUES:,} values. A body must arrive within {BODY_PATIENCE:g} s. A job may have at most {MOST_NAMES}
parts, {MOST_NAMES} places and {MOST_NAMES} pallets.

On Linux, the connection of a client that takes nothing of its answer for {ANSWER_PATIENCE:g} s is closed.

A separate worker process computes previews and inspections. Each user may have {PEOPLE_BOUNDS.each} of these requests
running; another one gets status 429 (error 4030). If the worker fails, the request gets status 503 (error 5020). Both
responses have `Retry-After: {AGAIN}`. A request is refused if it needs more than {PEOPLE_BOUNDS.seconds:g} s of
computing time (4031), more than {PEOPLE_BOUNDS.memory >> 30} GB of memory (4032), or asks for more than
{MOST_SAMPLED:,} samples (4032). If the caller disconnects, the computation ends. A stop never waits for a computation.

## Responses

Every response has the header `Maya: VERSION` and the header `Maya-Request`, the id of the request in [the
log](#the-log). HEAD returns the headers of GET. OPTIONS returns the methods of a path in `Allow`. Unknown keys in
bodies and queries are refused.

An error response is `application/problem+json` (RFC 9457) with `type`, `title`, `status`, `code` (an [error
code](errors.md)), `detail` (the message) and `details` (the values in the message). The message is in Spanish if
`Accept-Language` prefers Spanish to English; `details` are always in English.

| status | reason |
|---|---|
| 400 | the request could not be understood |
| 401 | no token, or one that is not valid |
| 403 | the role does not include the operation; the header `Host` or `Origin` is not allowed |
| 404 | no such path, job, twin, pose, pallet, zone or recording |
| 405 | no such method |
| 408 | the body arrived too slowly |
| 409 | the present state does not allow the request: the state of the robot, the job or the lease, or a name or \
an idempotency key that is in use |
| 410 | the requested events are no longer stored |
| 413 | the body is too long |
| 422 | a value or a name is not valid, or a target is not reachable |
| 429 | too many requests, or too many previews at once |
| 500 | an internal error of Maya |
| 503 | the machine, its connection, the storage or a worker process failed |

`POST /v1/jobs`, `POST /v1/tasks` and `POST /v1/jobs/{{job}}/again` take the header `Idempotency-Key` (at most 200
characters). If the same user sends the same request with the same key again, the response is the existing job, also
after a restart. The same key with another request is refused (4012).
"""

LOG = """
## The log

The file `maya.log` in the state folder has one JSON object per line: for each event of the robot (without phases and
single motions), and for each request that changed something or was refused: `time` (UTC), `level`, `logger`,
`message`, `request`, `method`, `path`, `status`, `code`, `who`, `source`, `seconds`. Internal errors have a
`traceback`. The file has at most 5 MB; four older files stay beside it. `maya logs` and `GET /v1/logs` read it.

## Metrics

`GET /metrics` returns the metrics for Prometheus: `maya_mode`, `maya_homed`, `maya_moving`, `maya_speed_ratio`,
`maya_joint`, `maya_queue_mode`, `maya_jobs` by `state`, `maya_jobs_ended_total` and `maya_steps_ended_total` by
`state`, `maya_events_total` by `kind` (`moving` counts motions, `stopped` stops), `maya_faults_total` by `code`,
`maya_link_seconds` (a command to its reply), `maya_loop_lag_seconds`, `maya_http_requests_total`,
`maya_http_request_seconds`, `maya_stream_clients`, `maya_storage_commits`, `maya_storage_failing`, `maya_run`.
"""

TITLES = {
    "looking": "Status and geometry",
    "jobs": "Jobs",
    "queue": "The queue",
    "moving": "Motion",
    "lease": "The control lease",
    "poses": "Poses",
    "pallets": "Pallets",
    "zones": "Zones (temporary)",
    "oneself": "Session",
    "users": "Users and tokens",
    "recordings": "Recordings",
    "diagnosis": "Diagnosis",
    "calibration": "Calibration",
    "twin": "Faults of the twin",
    "keeping": "For administrators",
    "server": "The server",
}


_LIMITED: dict[tuple[Operation, ...], str] = {
    (Operation.SUBMIT, Operation.PROPOSE): "as a proposal",
    (Operation.COMMAND, Operation.SUBMIT, Operation.PROPOSE): "as a proposal, or with `wait` while driving",
    (Operation.CHANGE_JOB, Operation.PROPOSE): "own jobs",
    (Operation.CANCEL, Operation.PROPOSE): "own jobs",
    (Operation.LEND, Operation.LEASE): "an offered lease",
    (Operation.USERS, Operation.ME): "own account",
}
"""Limits of the lesser role, by the operations of a path."""


def page() -> str:
    """Return the page."""
    return "".join(f"{line}\n" for line in _lines()).rstrip("\n") + "\n"


def _lines() -> Iterator[str]:
    yield INTRODUCTION.rstrip("\n")
    routes = ruled(create_app(Bridge(cast("asyncio.AbstractEventLoop", None), cast("Service", None))))
    for tag, title in TITLES.items():
        yield f"\n## {title}\n\n| request | role needed | effect |\n|---|---|---|"
        yield from (_row(route, rule) for route, rule in routes if route.tags == [tag])
        yield from _examples([(route, rule) for route, rule in routes if route.tags == [tag]])
    assert {tag for route, _ in routes for tag in route.tags} == set(TITLES)
    yield LOG.rstrip("\n")


def _row(route: APIRoute, rule: RouteRule) -> str:
    method = next(iter(route.methods or ()))
    query = f"?{'&'.join(rule.query)}" if rule.query else ""
    words = " ".join((inspect.getdoc(route.endpoint) or "").split())
    return f"| `{method} {route.path_format}{query}` | {_role(rule)} | {words} |"


def _role(rule: RouteRule) -> str:
    if not rule.operations:
        return "anybody"
    if set(rule.operations) & {Operation.STOP, Operation.ABORT}:
        return f"anybody on this machine; {RULES[rule.operations[0]].role.word}"
    needed = [RULES[operation] for operation in rule.operations]
    if len(needed) > 1:
        role = "every user" if needed[-1].role is Role.VIEWER else needed[-1].role.word
        return f"{needed[-2].role.word}; {role} ({_LIMITED[rule.operations]})"
    return f"{needed[0].role.word}, drives" if needed[0].drives else needed[0].role.word


def _examples(routes: list[tuple[APIRoute, RouteRule]]) -> Iterator[str]:
    told = [(route, name, value) for route, rule in routes for name, value in rule.examples.items()]
    if told:
        yield ""
    for route, name, value in told:
        body = json.dumps(value, ensure_ascii=False)
        yield f"- `{next(iter(route.methods or ()))} {route.path_format}`, {name}: `{body}`"
