"""The page of docs that lists every path of the HTTP interface; `gen_docs.py` writes it."""

from __future__ import annotations

import asyncio
import inspect
import json
from collections.abc import Iterator
from typing import cast

from fastapi.routing import APIRoute

from maya_un.api.access.operations import RULES
from maya_un.api.service import Service
from maya_un.assembly import PEOPLE_BOUNDS
from maya_un.process.decoding import MOST_VALUES
from maya_un.process.desk import MOST_SAMPLED
from maya_un.process.job import MOST_NAMES
from maya_un.server.app import create_app
from maya_un.server.bridge import Bridge
from maya_un.server.edge import FAR, NEAR
from maya_un.server.exchange import LONG
from maya_un.server.guard import BODY_LIMIT, BODY_PATIENCE
from maya_un.server.openapi import ruled
from maya_un.server.problems import AGAIN
from maya_un.server.routes import RouteRule

INTRODUCTION = f"""\
# HTTP

`maya up` serves this interface on loopback, port 4133 unless `--port` says otherwise, and with `--listen` to [other
machines](../how-to/share-the-robot.md). Lengths in m, angles in rad, times in s; points are `[x, y, z]`, joints `[a,
b, c]`. What changes while you look is a websocket's matter: [the stream](websocket.md).

`GET /v1/openapi.json` is the whole of it for tools: every message with its schema and examples, every refusal of
every path, and as `x-maya-operations` what it is for. Generated clients name their methods by its operation ids.
Pages that draw such a document fetch their scripts from elsewhere, so we serve none; any viewer of your own takes the
file.

## Who may ask

While no users are kept, whoever sits at the machine may do everything and shows nothing. Once users are kept, and
from other machines always, a request shows a token: `Authorization: Bearer maya_...`, from `maya user token` or `POST
/v1/session`. Stop and abort from loopback never need one. What is marked "drives" needs the [control
lease](../how-to/share-the-robot.md) too, shown as `Maya-Lease`; who shows none and is no user of any (the local user
without ceremony) takes it for the length of the wish while it is free. [Roles](roles.md) says who may what.

On loopback, requests name loopback as their Host and come from pages of loopback, if from pages. Other machines may
name the address or host name of this one, and what `maya up --origin URL` adds; pages of such an origin may command
from a browser (CORS). A request that says that it was forwarded counts as one from elsewhere.

So many requests a second: {NEAR.per_second:g} from this machine, {NEAR.burst:g} at once; {FAR.per_second:g} from each
other one, {FAR.burst:g} at once. More are answered 429, with `Retry-After`; stop and abort are never counted. A body
may have {BODY_LIMIT // 1_000_000} MB if it may carry a job, else {LONG // 1024} kB.
It may have {MOST_VALUES:,} values, and must arrive within {BODY_PATIENCE:g} s.

A separate worker process computes previews and inspections. Each user may have
{PEOPLE_BOUNDS.each} under way; more are answered 429 (4030). A worker that fails is answered 503 (5020). Both answers
have `Retry-After: {AGAIN}`. A request is refused if it takes more than
{PEOPLE_BOUNDS.seconds:g} s of computing (4031), more than {PEOPLE_BOUNDS.memory >> 30} GB of memory
or more than {MOST_SAMPLED:,} samples (4032). A job names at most {MOST_NAMES} parts,
{MOST_NAMES} places and {MOST_NAMES} pallets. If the caller disconnects, the computation ends.
A stop never waits for a computation.

## What every answer has

`Maya: VERSION`, by which a client knows that it is ours, and `Maya-Request`, by which [the log](#the-log) names the
request. HEAD answers as GET without the body, OPTIONS tells what may be asked of a path. Keys that are not known are
refused, in bodies and in queries.

A refusal is `application/problem+json` with `type`, `title`, `status`, `code` (one of [ours](errors.md)), `detail`
(the sentence; in Spanish where Accept-Language wants that more than English) and `details` (what the sentence names).

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
