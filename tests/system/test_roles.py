"""Rights of the roles: every path of the interface as every role, with the control lease and without.

The table below gives the kind of each path by hand; `RULES` derives the rights of a role from it. A path that is not in
the table fails the test.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterator, Mapping
from http.client import HTTPConnection
from json import dumps, loads
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import urlsplit

import pytest

from maya_un.assembly.stack import Stack
from maya_un.errors import LeaseHeld, LeaseLost, LeaseNeeded, NotAllowed, NotSignedIn
from maya_un.http.openapi import ruled
from maya_un.service.access.operations import RULES, Operation, Role
from tests.shared_robot import PASSWORD, SharedRobot, shared_robot
from tests.waiting import eventually

pytestmark = pytest.mark.system

NOBODY = "nobody"
PEOPLE = (NOBODY, *(role.word for role in Role))
FREE, TAKEN, OWN = "free", "somebody else's", "one's own"
WITHOUT_TOKEN = frozenset({Operation.STOP, Operation.ABORT})

_JOB = {"steps": [{"gripper": "open"}]}
_BOX = {"kind": "box", "low": [0.0, -2.0, 0.0], "high": [0.1, -1.9, 0.1]}
_GRID = {"corners": [[0.3, 1.0, 0.4], [0.5, 1.0, 0.4], [0.3, 1.2, 0.4]], "rows": 2, "columns": 2}
_REQUEST = {"command": "gripper", "open": True}


class Asked(NamedTuple):
    """The kind of a path, and a valid body; without a kind it is open to every caller."""

    operations: tuple[Operation, ...]
    body: object = None


def for_(*operations: Operation, body: object = None) -> Asked:
    """Return a line of the table."""
    return Asked(operations, body)


_READ = for_(Operation.READ)
_CHANGE = (Operation.CHANGE_JOB, Operation.PROPOSE)
_SUBMIT = (Operation.SUBMIT, Operation.PROPOSE)

TABLE: dict[str, Asked] = {
    "GET /v1/health": for_(),
    "GET /v1/ready": for_(),
    "GET /v1/openapi.json": for_(),
    "POST /v1/session": for_(body={"name": "the-viewer", "password": "this is not it"}),
    "GET /metrics": _READ,
    "GET /v1/addresses": _READ,
    "GET /v1/status": _READ,
    "GET /v1/config": _READ,
    "GET /v1/config/schema": _READ,
    "POST /v1/config/check": for_(Operation.READ, body={"settings": {}}),
    "PUT /v1/config": for_(Operation.CONFIGURE, body={"settings": {}}),
    "GET /v1/reach?x=0.5&y=1.2&z=0.4": _READ,
    "GET /v1/fk?a=0.4&b=1.5&c=1.6": _READ,
    "GET /v1/ik?x=0.5&y=1.2&z=0.4": _READ,
    "GET /v1/events": _READ,
    "GET /v1/twin": _READ,
    "GET /v1/table": _READ,
    "GET /v1/motion": _READ,
    "GET /v1/link": _READ,
    "GET /v1/fleet": _READ,
    "GET /v1/margins": _READ,
    "GET /v1/signals": _READ,
    "GET /v1/workspace?z=0.4": _READ,
    "POST /v1/reach": for_(Operation.READ, body={"points": [[0.5, 1.2, 0.4]]}),
    "POST /v1/translations": for_(Operation.READ, body={"texts": [], "language": "es"}),
    "GET /v1/me/can": _READ,
    "GET /v1/examples": _READ,
    "GET /v1/jobs": _READ,
    "GET /v1/jobs/{job}": _READ,
    "GET /v1/jobs/{job}/body": _READ,
    "GET /v1/queue": _READ,
    "GET /v1/queue/recovery": _READ,
    "GET /v1/lease": _READ,
    "GET /v1/poses": _READ,
    "GET /v1/poses/{name}": _READ,
    "GET /v1/pallets": _READ,
    "GET /v1/pallets/{name}": _READ,
    "GET /v1/zones": _READ,
    "GET /v1/recordings": _READ,
    "GET /v1/recordings/{name}/states": _READ,
    "GET /v1/recordings/{name}/events": _READ,
    "GET /v1/recordings/{name}/csv": _READ,
    "GET /v1/me": _READ,
    "POST /v1/preview": for_(Operation.PREVIEW, body=_JOB),
    "POST /v1/inspect": for_(Operation.PREVIEW, body=_JOB),
    "POST /v1/jobs/parse": for_(Operation.PREVIEW, body={"text": "steps: [home]"}),
    "POST /v1/jobs/format": for_(Operation.PREVIEW, body=_JOB),
    "POST /v1/stop": for_(Operation.STOP),
    "POST /v1/abort": for_(Operation.ABORT),
    "POST /v1/jobs?held=true": for_(*_SUBMIT, body=_JOB),
    "POST /v1/tasks?held=true": for_(*_SUBMIT, body=_REQUEST),
    "POST /v1/tasks?wait=true": for_(Operation.COMMAND, body=_REQUEST),
    "POST /v1/jobs/{job}/again": for_(*_SUBMIT, body={}),
    "PATCH /v1/jobs/{job}": for_(*_CHANGE, body={"notes": "x"}),
    "POST /v1/jobs/{job}/hold": for_(*_CHANGE),
    "POST /v1/jobs/{job}/move": for_(Operation.CHANGE_JOB, body={"to": "first"}),
    "POST /v1/jobs/{job}/release": for_(Operation.APPROVE),
    "DELETE /v1/jobs/{job}": for_(Operation.CANCEL, Operation.PROPOSE),
    "POST /v1/queue/pause": for_(Operation.PAUSE, body={"when": "after step"}),
    "POST /v1/queue/resume": for_(Operation.RESUME),
    "POST /v1/queue/step": for_(Operation.STEP),
    "POST /v1/queue/clear": for_(Operation.CLEAR),
    "POST /v1/queue/answer": for_(Operation.RESUME, body={"answer": "continue"}),
    "POST /v1/queue/recovery": for_(Operation.RESTART, body={"choice": "redo"}),
    "POST /v1/pause": for_(Operation.PAUSE),
    "POST /v1/resume": for_(Operation.RESUME),
    "POST /v1/speed": for_(Operation.SPEED, body={"ratio": 1.0}),
    "POST /v1/recover": for_(Operation.RECOVER),
    "GET /v1/datum": _READ,
    "POST /v1/datum": for_(Operation.DATUM, body={"joints": [0.1, 1.5, 1.3]}),
    "POST /v1/datum/confirm": for_(Operation.DATUM, body={"joints": [0.1, 1.5, 1.3]}),
    "POST /v1/datum/move": for_(Operation.DATUM, body={"axis": "a", "distance": 0.01}),
    "POST /v1/jog": for_(Operation.JOG, body={"hold": False}),
    "PUT /v1/poses/{name}": for_(Operation.TEACH),
    "PATCH /v1/poses/{name}": for_(Operation.TEACH, body={"name": "another"}),
    "DELETE /v1/poses/{name}": for_(Operation.TEACH),
    "PUT /v1/pallets/{name}": for_(Operation.TEACH, body=_GRID),
    "PATCH /v1/pallets/{name}": for_(Operation.TEACH, body={"name": "another"}),
    "DELETE /v1/pallets/{name}": for_(Operation.TEACH),
    "PUT /v1/zones/{name}": for_(Operation.ZONES, body=_BOX),
    "DELETE /v1/zones/{name}": for_(Operation.ZONES),
    "POST /v1/recordings": for_(Operation.RECORD),
    "GET /v1/recordings/{name}": for_(Operation.RECORD),
    "GET /v1/logs?level=error&limit=3": for_(Operation.DIAGNOSE),
    "GET /v1/doctor": for_(Operation.DIAGNOSE),
    "GET /v1/calibration": _READ,
    "DELETE /v1/calibration": for_(Operation.CALIBRATE),
    "POST /v1/calibration/points": for_(Operation.CALIBRATE, body={"point": [0.5, 1.2, 0.4]}),
    "DELETE /v1/calibration/points/{row}": for_(Operation.CALIBRATE),
    "POST /v1/calibration/fit": for_(Operation.CALIBRATE, body={"hold": ["delta"]}),
    "GET /v1/twin/faults": _READ,
    "PUT /v1/twin/faults/{name}": for_(Operation.INJECT, body={"seconds": 1.0}),
    "DELETE /v1/twin/faults/{name}": for_(Operation.INJECT),
    "DELETE /v1/twin/faults": for_(Operation.INJECT),
    "POST /v1/terminal": for_(Operation.TERMINAL, body={"command": "TP"}),
    "GET /v1/scope?seconds=2&signal=a": _READ,
    "GET /v1/audit": for_(Operation.AUDIT),
    "POST /v1/backup": for_(Operation.BACKUP),
    "GET /v1/users": for_(Operation.USERS),
    "POST /v1/users": for_(Operation.USERS, body={"name": "newcomer", "role": "viewer"}),
    "DELETE /v1/users/{name}": for_(Operation.USERS),
    "PATCH /v1/users/{name}": for_(Operation.USERS, Operation.ME, body={"old": PASSWORD, "password": PASSWORD}),
    "GET /v1/users/{name}/tokens": for_(Operation.USERS, Operation.ME),
    "POST /v1/users/{name}/tokens": for_(Operation.USERS, Operation.ME, body={"note": "one more"}),
    "DELETE /v1/tokens/{token}": for_(Operation.USERS, Operation.ME),
    "DELETE /v1/session": for_(Operation.ME),
    # A student takes the lease only where an operator offers it to him.
    "POST /v1/lease": for_(Operation.LEND, body={}),
    "POST /v1/lease/offer": for_(Operation.LEND, body={"to": "the-student"}),
    "POST /v1/lease/ask": for_(Operation.LEASE),
    "POST /v1/lease/renew": for_(Operation.RENEW),
    "DELETE /v1/lease": for_(Operation.LEASE),
}
"""Every path and its kind, most powerful first; the second kind applies to the caller's own entries."""


class Answer(NamedTuple):
    """The result: the status, and our code, 0 if it is no refusal."""

    status: int
    code: int


class RoleClient:
    """Asks a robot as somebody who shows a token, and the lease where he has it."""

    def __init__(self, robot: SharedRobot) -> None:
        address = urlsplit(robot.url)
        assert address.hostname is not None
        self.robot = robot
        self._connection = HTTPConnection(address.hostname, address.port, timeout=30.0)

    def close(self) -> None:
        """Hang up."""
        self._connection.close()

    def ask(self, request: str, body: object, headers: Mapping[str, str]) -> tuple[Answer, Any]:
        """Return what comes of "METHOD /path"."""
        method, path = request.split(" ", 1)
        payload = None if body is None else dumps(body)
        self._connection.request(method, path, payload, {"Content-Type": "application/json", **headers})
        response = self._connection.getresponse()
        text = response.read()
        kind = response.getheader("Content-Type", "")
        value: Any = loads(text) if "json" in kind else None
        return Answer(response.status, value["code"] if "problem" in kind else 0), value

    def must(self, request: str, body: object, headers: Mapping[str, str]) -> Any:
        """Return the answer to a command that is carried out."""
        answer, value = self.ask(request, body, headers)
        assert answer.status < 300, f"{request}: {value}"
        return value


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SharedRobot]:
    with shared_robot(tmp_path_factory.mktemp("shared"), users=True) as robot:
        made = robot.do(lambda stack: stack.service.users.add("somebody-else", "operator"))
        robot.tokens["somebody else"] = made.token
        yield robot


@pytest.fixture
def role_client(robot: SharedRobot) -> Iterator[RoleClient]:
    role_client = RoleClient(robot)
    yield role_client
    role_client.close()


def test_every_path_is_in_the_table(robot: SharedRobot) -> None:
    declared = {f"{method} {route.path_format}" for route, _ in ruled(robot.app) for method in route.methods or ()}
    assert {request.partition("?")[0] for request in TABLE} == declared


def test_every_operation_belongs_to_some_path() -> None:
    asked = {operation for line in TABLE.values() for operation in line.operations}
    # The lease is broken by POST /v1/lease with force, of another's; and only rosbridge and ROS have a graph.
    assert set(Operation) - asked == {Operation.BREAK, Operation.GRAPH}


def set_lease(role_client: RoleClient, who: str, state: str) -> dict[str, str]:
    """Bring the lease into `state`; return the headers of `who`."""
    robot = role_client.robot
    robot.do(_freed)
    if state == FREE:
        return {}
    if state == TAKEN:
        role_client.must("POST /v1/lease", {"patience": 1000}, robot.headers("somebody else"))
        return {}
    if who == Role.STUDENT.word:
        role_client.must("POST /v1/lease/offer", {"to": "the-student"}, robot.headers("operator"))
    taken = role_client.must("POST /v1/lease", {"patience": 1000}, robot.headers(who))
    return {"Maya-Lease": taken["id"]}


async def _freed(stack: Stack) -> None:
    """End whatever lease there is, and wait for who drives without one."""
    lease = stack.lease
    if lease.holder is not None:
        lease.drop(lease.holder.name, "the next test")
    changed = asyncio.Event()
    lease.on_change.append(lambda _: changed.set())
    while lease.holder is not None:
        await changed.wait()
        changed.clear()
    lease.on_change.pop()


def own(role_client: RoleClient, request: str, who: str) -> str:
    """Return a request about the caller's own entries, if there can be one."""
    name = f"the-{who}" if "/users/" in request and not request.startswith("DELETE") else "unheard-of"
    job = 1
    if "{job}" in request and who not in PEOPLE[:2]:
        job = role_client.must("POST /v1/jobs?held=true", _JOB, role_client.robot.headers(who))["id"]
    return request.format(job=job, name=name, row=1, token="no-such-token")


def expected(operations: tuple[Operation, ...], who: str, lease: str) -> set[int]:
    """Return the codes one of which must answer a request; empty if it must not be refused to its caller."""
    if who == NOBODY:
        return set() if set(operations) <= WITHOUT_TOKEN else {NotSignedIn.code}
    role = next(role for role in Role if role.word == who)
    may = [one for one in operations if role >= RULES[one].role]
    if operations and not may:
        return {NotAllowed.code}
    if not operations or not RULES[may[0]].drives or lease == OWN:
        return set()
    return {LeaseNeeded.code} if lease == FREE else {LeaseHeld.code}


def is_refused(request: str, answer: Answer, value: Any) -> bool:
    """Return whether a request was refused to its caller: codes of the lease have more than one meaning."""
    if answer.code not in ACCESS_CODES:
        return False
    if request.partition(" ")[2].startswith("/v1/lease"):
        return answer.code == NotSignedIn.code or value["details"].get("needed") in {"student", "operator"}
    return True


ACCESS_CODES = {kind.code for kind in (NotSignedIn, NotAllowed, LeaseNeeded, LeaseHeld, LeaseLost)}
CASES = [(who, lease) for who in PEOPLE for lease in (FREE, TAKEN, OWN) if lease != OWN or who not in PEOPLE[:2]]


@pytest.mark.parametrize(("who", "lease"), CASES, ids=[f"{who}, the lease {lease}" for who, lease in CASES])
def test_role_has_its_rights_and_no_others(who: str, lease: str, role_client: RoleClient) -> None:
    robot = role_client.robot
    wrong: list[str] = []
    for request, line in TABLE.items():
        shown = set_lease(role_client, who, lease)
        headers = robot.headers(who) | shown
        if request == "DELETE /v1/session" and who != NOBODY:
            one_more = role_client.must(f"POST /v1/users/the-{who}/tokens", {}, headers)
            headers["Authorization"] = f"Bearer {one_more['token']}"
        answer, value = role_client.ask(own(role_client, request, who), line.body, headers)
        must = expected(line.operations, who, lease)
        as_it_must = answer.code in must if must else not is_refused(request, answer, value) or not line.operations
        if not as_it_must or answer.status >= 500:
            wrong.append(f"{request}: {answer}, not {must or 'allowed'}: {value}")
    assert wrong == []


def test_no_number_of_requests_hides_a_new_token_from_the_audit_log(tmp_path: Path) -> None:
    """Requests about oneself are counted together after some, but not with those that change something."""
    with shared_robot(tmp_path, users=True) as robot:
        role_client = RoleClient(robot)
        student = robot.headers("student")
        for _ in range(30):
            role_client.must("GET /v1/users/the-student/tokens", None, student)
        role_client.must("POST /v1/users/the-student/tokens", {"note": "one more"}, student)
        made = {"who": "the-student", "operation": "me", "detail": "new token of the-student"}

        def is_shown() -> bool:
            rows = role_client.must("GET /v1/audit?limit=100", None, robot.headers("admin"))
            return any(made.items() <= row.items() for row in rows)

        eventually(is_shown, "the audit log shows the new token", 30.0)
        role_client.close()


def test_without_users_a_local_caller_needs_no_token(tmp_path: Path) -> None:
    with shared_robot(tmp_path, users=False) as alone:
        role_client = RoleClient(alone)
        answers = {
            request: role_client.ask(own(role_client, request, NOBODY), line.body, {})
            for request, line in TABLE.items()
        }
        role_client.close()
    refused = {request for request, (answer, _) in answers.items() if answer.code in ACCESS_CODES}
    # Nobody took the lease, so there is none to renew or give back; and nobody has a password.
    assert refused <= {"POST /v1/lease/renew", "DELETE /v1/lease", "POST /v1/session", "POST /v1/lease"}
    assert {request for request, (answer, _) in answers.items() if answer.status >= 500} == set()
