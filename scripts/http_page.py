"""The page of docs that lists every path of the HTTP interface; `gen_docs.py` writes it."""

from __future__ import annotations

import asyncio
import inspect
import json
from collections.abc import Iterator
from typing import cast

from fastapi.routing import APIRoute

from maya_un.assembly import PEOPLE_BOUNDS
from maya_un.http.app import create_app
from maya_un.http.bridge import Bridge
from maya_un.http.errors import AGAIN
from maya_un.http.exchange import LONG
from maya_un.http.middleware import BODY_LIMIT, BODY_PATIENCE, FAR, NEAR
from maya_un.http.openapi import ruled
from maya_un.http.routing import RouteRule
from maya_un.process.computation import MOST_SAMPLED
from maya_un.process.spec.job import MOST_NAMES
from maya_un.process.spec.json_object import MOST_VALUES
from maya_un.service.access.operations import RULES
from maya_un.service.service import Service

INTRODUCTION = f"""\
# HTTP

`maya up` serves this interface on loopback, on port 4133 or that of `--port`, and with `--listen` to [other
machines](../how-to/share-the-robot.md). Lengths in m, angles in rad, times in s; points are `[x, y, z]`, joints `[a, b,
c]`. For live data use the websocket: [the stream](websocket.md).

`GET /v1/openapi.json` is the complete description for tools: every message with its schema and examples, every refusal
of every path, and its operations as `x-maya-operations`. Generated clients name their methods by its operation ids.
Maya serves no page for this document, because such pages load scripts from other sites; open the file in any viewer.

## Authentication

While no users exist, everybody on this machine has full access without a token. Once users exist,
and always from other machines, a request needs a token: `Authorization: Bearer maya_...`, from `maya user token` or
`POST /v1/session`. Stop and abort from loopback never need one. An operation marked "drives" also needs the [control
lease](../how-to/share-the-robot.md), sent as `Maya-Lease`. While no users exist, a request without a lease takes the
free lease for its own duration. [Roles](roles.md) lists the rights.

On loopback, the Host of a request must be loopback, and so must the origin of a web page. Other machines may use the
address or host name of this one, and the names of `maya up --origin URL`; pages of such an origin may send commands
from a browser (CORS). A forwarded request counts as one from another machine.

This machine may send {NEAR.per_second:g} requests a second, {NEAR.burst:g} at once; each other machine
{FAR.per_second:g}, {FAR.burst:g} at once. More requests get 429, with `Retry-After`; stop and abort do not count. A
body with a job may have {BODY_LIMIT // 1_000_000} MB, any other {LONG // 1024} kB. It may have {MOST_VALUES:,} values,
and must arrive within {BODY_PATIENCE:g} s.

A separate worker process computes previews and inspections. Each user may have
{PEOPLE_BOUNDS.each} under way; more are answered 429 (4030). A worker that fails is answered 503 (5020). Both answers
have `Retry-After: {AGAIN}`. A request is refused if it takes more than
{PEOPLE_BOUNDS.seconds:g} s of computing (4031), more than {PEOPLE_BOUNDS.memory >> 30} GB of memory
or more than {MOST_SAMPLED:,} samples (4032). A job names at most {MOST_NAMES} parts,
{MOST_NAMES} places and {MOST_NAMES} pallets. If the caller disconnects, the computation ends.
A stop never waits for a computation.

## Every answer

Every answer has the header `Maya: VERSION`, which identifies Maya's service, and `Maya-Request`, the
name of the request in [the log](#the-log). HEAD answers as GET without the body; OPTIONS lists the methods of a path.
Unknown keys in bodies and queries are refused.

A refusal is `application/problem+json` with `type`, `title`, `status`, `code` (one of [ours](errors.md)), `detail`
(the sentence; in Spanish if Accept-Language prefers it to English) and `details` (the values in the sentence).

| status | when |
|---|---|
| 400 | the request could not be understood |
| 401 | no token, or one that is not valid |
| 403 | the role does not include this; a Host or Origin that is not let in |
| 404, 405 | no such path, job, twin, pose, pallet, zone, recording; no such method |
| 408, 413 | the body came too slowly; it is too long |
| 409 | not as things stand: the robot's state, the job's, the lease's, a name or an idempotency key taken |
| 410 | events are asked for that are kept no more |
| 422 | a value, a name or a target is refused |
| 429 | too many requests, or too many previews at once |
| 503 | the machine, its link, the storage or a worker process failed |
| 500 | a defect of ours |

`POST /v1/jobs` and `POST /v1/tasks` take the header `Idempotency-Key` (at most 200 characters): the same key and
request of the same owner once more is answered with the job that there is, also after a restart; with another
request it is refused (4012).
"""

LOG = """
## The log

`maya.log` in the folder of state has a line of JSON for every event of the robot and every request that changed
something or was refused: `time` (UTC), `level`, `logger`, `message`, `request`, `method`, `path`, `status`, `code`,
`who`, `source`, `seconds`; defects have their `traceback`. It is 5 MB long at most, with four older files beside it.
`maya logs` reads it.

## Metrics

`GET /metrics` answers Prometheus: `maya_mode`, `maya_homed`, `maya_moving`, `maya_speed_ratio`, `maya_joint`,
`maya_queue_mode`, `maya_jobs` by state, `maya_jobs_ended_total` and `maya_steps_ended_total` by how,
`maya_events_total` by kind (`moving` counts motions, `stopped` stops), `maya_faults_total` by code,
`maya_link_seconds` (a command to its reply), `maya_loop_lag_seconds`, `maya_http_requests_total`,
`maya_http_request_seconds`, `maya_stream_clients`, `maya_storage_commits`, `maya_storage_failing`, `maya_run`.
"""

TITLES = {
    "looking": "Looking",
    "jobs": "Jobs",
    "queue": "The queue",
    "moving": "Moving, stopping",
    "lease": "The control lease",
    "poses": "Poses",
    "pallets": "Pallets",
    "zones": "Zones, for this run",
    "oneself": "Oneself",
    "users": "Users and tokens",
    "recordings": "Recordings",
    "keeping": "For administrators",
    "server": "The server",
}


def page() -> str:
    """Return the page."""
    return "".join(f"{line}\n" for line in _lines()).rstrip("\n") + "\n"


def _lines() -> Iterator[str]:
    yield INTRODUCTION.rstrip("\n")
    routes = ruled(create_app(Bridge(cast("asyncio.AbstractEventLoop", None), cast("Service", None))))
    for tag, title in TITLES.items():
        yield f"\n## {title}\n\n| request | who | what |\n|---|---|---|"
        yield from (_row(route, rule) for route, rule in routes if route.tags == [tag])
        yield from _examples([(route, rule) for route, rule in routes if route.tags == [tag]])
    assert {tag for route, _ in routes for tag in route.tags} == set(TITLES)
    yield LOG.rstrip("\n")


def _row(route: APIRoute, rule: RouteRule) -> str:
    method = next(iter(route.methods or ()))
    query = f"?{'&'.join(rule.query)}" if rule.query else ""
    words = " ".join((inspect.getdoc(route.endpoint) or "").split())
    return f"| `{method} {route.path_format}{query}` | {_who(rule)} | {words} |"


def _who(rule: RouteRule) -> str:
    if not rule.operations:
        return "anybody"
    needed = [RULES[operation] for operation in rule.operations]
    if len(needed) > 1:
        return f"{needed[-2].role.word}; {needed[-1].role.word} (his own)"
    return f"{needed[0].role.word}, drives" if needed[0].drives else needed[0].role.word


def _examples(routes: list[tuple[APIRoute, RouteRule]]) -> Iterator[str]:
    told = [(route, name, value) for route, rule in routes for name, value in rule.examples.items()]
    if told:
        yield ""
    for route, name, value in told:
        body = json.dumps(value, ensure_ascii=False)
        yield f"- `{next(iter(route.methods or ()))} {route.path_format}`, {name}: `{body}`"
