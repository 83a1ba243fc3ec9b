"""Authorisation at the gate: every operation, by every role, in every state of the lease.

The table here is written by hand, from what people were promised; docs/reference/roles.md is made from the code's.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import pytest

from maya_un.errors import LeaseHeld, LeaseLost, MayaError, NotAllowed, NotFound, Stopped, Unreachable
from maya_un.events import EventLog
from maya_un.process.journal.protocol import AuditRow
from maya_un.process.lease import ControlLease
from maya_un.schema.people import PATIENCE
from maya_un.service.access.control import COUNTED, SINGLY, TOGETHER, Audit
from maya_un.service.access.operations import LOCAL, OWN, ROS, RULES, Caller, Operation, Role, require_over
from maya_un.service.service import Gate, Service
from tests.virtual_time import elapse, turn

NEEDS = {
    "viewer": "read preview stop abort me",
    "student": "propose pause lease renew command jog resume speed step",
    "operator": "submit cancel approve drive teach record recover datum restart clear zones graph diagnose inject "
    "calibrate",
    "admin": "break backup audit users terminal configure",
}
"""The least role of every operation."""

ELSE = {"change job": "operator"}
"""The least role of the operations with two words."""

DRIVES = {"command", "jog", "resume", "speed", "step", "recover", "datum", "restart", "zones", "terminal"}
"""Operations that need the lease."""

RANK = ["viewer", "student", "operator", "admin"]
REFUSED = {4102, 4103, 4104, 4105}

LEAST = {word: role for role, words in NEEDS.items() for word in words.split()} | ELSE

FREE, OWN_SHOWN, OWN_HIDDEN, STALE = "free", "his own", "his own, shown elsewhere", "one that has ended"
OTHERS, STOLEN, OTHERS_WORK, OTHERS_JOB = (
    "another's",
    "another's, and he shows it",
    "another's command",
    "another's job",
)

DRIVING = {
    FREE: 4104,
    OWN_SHOWN: 0,
    OWN_HIDDEN: 4103,
    STALE: 4105,
    OTHERS: 4103,
    STOLEN: 4103,
    OTHERS_WORK: 4103,
    OTHERS_JOB: 4104,
}
"""Result of a driving operation, by the state of the lease: 0 for done, or the code."""

IMPLICIT = {
    FREE: 0,
    OWN_SHOWN: 0,
    OWN_HIDDEN: 0,
    STALE: 4105,
    OTHERS: 4103,
    STOLEN: 4103,
    OTHERS_WORK: 4103,
    OTHERS_JOB: 4103,
}
"""The same for who needs no lease of his own."""


class GateCase:
    """A gate, its lease, its operations, and the rows of its audit log."""

    def __init__(self) -> None:
        loop = asyncio.get_running_loop()
        self.lease = ControlLease(EventLog(loop.time))
        self.told: list[tuple[str, str, int, str]] = []
        self.done: list[str] = []
        self._service = SimpleNamespace(stops=0)
        self.gate = Gate(cast("Service", self._service), self.lease, self._tell)

    @property
    def stops(self) -> int:
        """How often the robot was stopped."""
        return self._service.stops

    @stops.setter
    def stops(self, number: int) -> None:
        self._service.stops = number

    def _tell(self, caller: Caller, operation: Operation, code: int, detail: str) -> None:
        self.told.append((caller.name, operation.value, code, detail))

    async def ask(self, caller: Caller, operation: Operation) -> int:
        """Return 0 where it was let in, else the code."""

        async def work(_: Service) -> int:
            self.done.append(operation.value)
            return 7

        try:
            assert await self.gate.call(caller, operation, work, "job 17") == 7
        except MayaError as error:
            return error.code
        return 0

    async def code_of(self, caller: Caller, operation: Operation, work: Callable[[Service], Awaitable[object]]) -> int:
        """Return the code of the error of `work`."""
        with pytest.raises(MayaError) as found:
            await self.gate.call(caller, operation, work)
        return found.value.code


@contextmanager
def standing(gate_case: GateCase, situation: str, name: str) -> Iterator[str]:
    """Have the lease stand like that for `name`; yields what he shows."""
    lease, shown = gate_case.lease, ""
    with ExitStack() as stack:
        if situation in {OWN_SHOWN, OWN_HIDDEN}:
            shown = lease.take(name, "").id
        elif situation == STALE:
            shown = lease.take(name, "").id
            lease.release(shown, name)
        elif situation in {OTHERS, STOLEN}:
            shown = lease.take("other", "").id
        elif situation in {OTHERS_WORK, OTHERS_JOB}:
            stack.enter_context(lease.driving("other", "", direct=situation == OTHERS_WORK))
        yield shown if situation in {OWN_SHOWN, STALE, STOLEN} else ""
    lease.close()


def test_every_operation_is_in_the_table() -> None:
    assert set(LEAST) == {operation.value for operation in Operation}
    assert set(RULES) == set(Operation)
    assert {operation.value for operation, rule in RULES.items() if rule.drives} == DRIVES


@pytest.mark.parametrize("situation", DRIVING)
@pytest.mark.parametrize("implicit", [False, True], ids=["shows a lease", "needs none"])
async def test_the_matrix(situation: str, implicit: bool) -> None:
    for role in Role:
        for operation in Operation:
            gate_case = GateCase()
            with standing(gate_case, situation, "ann") as shown:
                caller = Caller("ann", role, "10.0.0.1", shown, implicit=implicit)
                code = await gate_case.ask(caller, operation)
            expected = (IMPLICIT if implicit else DRIVING)[situation] if operation.value in DRIVES else 0
            if RANK.index(role.word) < RANK.index(LEAST[operation.value]):
                expected = 4102
            assert code == expected, f"{role.word} asks for {operation}: {code}"
            assert gate_case.done == ([operation.value] if code == 0 else [])
            quiet = operation.value in {"read", "preview", "renew", "diagnose"}
            assert gate_case.told == ([] if quiet and code != 4102 else [("ann", operation.value, code, "job 17")])


@pytest.mark.parametrize("situation", DRIVING)
async def test_stop_is_obeyed_in_every_state_of_the_lease(situation: str) -> None:
    gate_case = GateCase()
    with standing(gate_case, situation, "ann") as shown:
        for role in Role:
            for lease in (shown, "", "nonsense", "ñ"):
                assert await gate_case.ask(Caller("ann", role, "", lease), Operation.STOP) == 0
                assert await gate_case.ask(Caller("ann", role, "", lease), Operation.ABORT) == 0


@pytest.mark.parametrize("operation", Operation)
async def test_what_could_move_the_robot_does_not_begin_after_a_stop_that_came_later(operation: Operation) -> None:
    gate_case = GateCase()

    async def work(_: Service) -> int:
        return 7

    async def asked(stops: int) -> int:
        return await gate_case.gate.call(LOCAL, operation, work, stops=stops)

    assert await asked(gate_case.stops) == 7
    gate_case.stops += 1
    begins = ["command", "jog", "resume", "step", "datum", "restart", "submit", "approve"]
    if operation.value in {*begins, "change job"}:
        with pytest.raises(Stopped):
            await asked(gate_case.stops - 1)
    else:
        assert await asked(gate_case.stops - 1) == 7
    assert await asked(gate_case.stops) == 7


async def test_driving_ends_with_the_lease_and_waits_for_rest() -> None:
    gate_case, ended = GateCase(), list[float]()

    async def jog(_: Service) -> None:
        try:
            await elapse(100.0)
        finally:
            await elapse(2.0)
            ended.append(asyncio.get_running_loop().time())

    ann = Caller("ann", Role.OPERATOR, "", gate_case.lease.take("ann", "").id)
    assert await gate_case.code_of(ann, Operation.JOG, jog) == 4105
    assert ended == [PATIENCE + 2.0]
    assert gate_case.told == [("ann", "jog", 4105, "")]


async def test_driving_without_a_lease_ends_by_force() -> None:
    gate_case = GateCase()
    asked = asyncio.ensure_future(gate_case.code_of(ROS, Operation.JOG, lambda _: elapse(100.0)))
    await elapse(1.0)
    with pytest.raises(LeaseHeld):
        gate_case.lease.take("ann", "")
    gate_case.lease.take("root", "", force=True)
    assert await asked == 4105
    assert asyncio.get_running_loop().time() == 1.0
    gate_case.lease.close()


async def test_leaving_caller_cancels_the_command_once() -> None:
    """A second hang-up, while the axes come to rest, does not cut that short."""
    gate_case, said = GateCase(), list[str]()

    async def jog(_: Service) -> None:
        try:
            await elapse(100.0)
        except asyncio.CancelledError:
            said.append("braking")
            await elapse(2.0)
            said.append("at rest")
            raise

    asked = asyncio.ensure_future(gate_case.gate.call(LOCAL, Operation.JOG, jog))
    await elapse(1.0)
    asked.cancel()
    await turn()
    gate_case.lease.take("root", "", force=True)
    await asyncio.wait({asked})
    assert (asked.cancelled(), said) == (True, ["braking", "at rest"])
    assert gate_case.told == [("local", "jog", 2202, "")]
    gate_case.lease.close()


async def test_error_of_a_command_is_raised_and_recorded() -> None:
    gate_case = GateCase()

    async def refused(_: Service) -> None:
        raise Unreachable(target="x", reason="no", nearest="y")

    async def broken(_: Service) -> None:
        raise ZeroDivisionError

    assert await gate_case.code_of(LOCAL, Operation.COMMAND, refused) == 2101
    for operation in (Operation.SUBMIT, Operation.COMMAND):
        with pytest.raises(ZeroDivisionError):
            await gate_case.gate.call(LOCAL, operation, broken)
    assert [code for _, _, code, _ in gate_case.told] == [2101, 5999, 5999]
    gate_case.lease.close()


async def test_driving_is_recorded() -> None:
    gate_case = GateCase()
    ann = Caller("ann", Role.OPERATOR, "", gate_case.lease.take("ann", "").id)
    for _ in range(5):
        await elapse(PATIENCE - 1.0)
        assert await gate_case.ask(ann, Operation.SPEED) == 0
    await elapse(PATIENCE + 1.0)
    assert await gate_case.ask(ann, Operation.SPEED) == 4105


def test_caller_changes_and_cancels_only_his_own_jobs() -> None:
    for operation in Operation:
        for role in Role:
            caller = Caller("ann", role)
            for owner in ("ann", "bob"):
                allowed = RANK.index(role.word) >= RANK.index(LEAST[operation.value])
                own = owner == "ann" and operation.value in {"change job", "cancel"} and role is not Role.VIEWER
                try:
                    require_over(caller, operation, owner)
                except NotAllowed:
                    assert not (allowed or own)
                else:
                    assert allowed or own
    assert {operation.value for operation in OWN} == {"change job", "cancel"}


async def test_a_held_jog_is_written_down_once() -> None:
    rows: list[AuditRow] = []
    audit = Audit(rows.append, lambda: "today")
    ann, bob = Caller("ann", Role.OPERATOR, "10.0.0.1"), Caller("bob", Role.OPERATOR, "10.0.0.2")
    for _ in range(100):
        audit.asked(ann, Operation.JOG, 0, "")
        await elapse(0.3)
    audit.asked(ann, Operation.JOG, 2101, "")
    audit.asked(ann, Operation.JOG, 0, "")
    audit.asked(bob, Operation.JOG, 0, "")
    await elapse(TOGETHER + 0.1)
    audit.asked(bob, Operation.JOG, 0, "")
    assert [(row.who, row.code) for row in rows] == [("ann", 0), ("ann", 2101), ("ann", 0), ("bob", 0), ("bob", 0)]
    for _ in range(3):
        audit.asked(ann, Operation.STOP, 0, "")
    assert len(rows) == 8


async def test_audit_counts_refusals_and_stops_that_come_in_bursts() -> None:
    rows: list[AuditRow] = []
    audit = Audit(rows.append, lambda: "today")
    vera = Caller("vera", Role.VIEWER)
    for number in range(6000):
        audit.asked(replace(vera, source=f"127.0.{number % 250}.1"), Operation.SPEED, 4102, f"job {number}")
        audit.asked(replace(vera, source="127.0.0.1"), Operation.STOP, 0, "")
    assert len(rows) == SINGLY
    audit.asked(Caller("bob", Role.VIEWER, "127.0.0.1"), Operation.SPEED, 4102, "")
    audit.asked(Caller("vera", Role.OPERATOR, "127.0.0.1"), Operation.SUBMIT, 0, "what is done is written down each")
    assert len(rows) == SINGLY + 2
    await elapse(COUNTED + 0.1)
    assert (rows[-1].who, rows[-1].detail) == ("vera", f"and {12_000 - SINGLY} more in {COUNTED:.0f} s")
    for _ in range(600):
        audit.asked(vera, Operation.SPEED, 4102, "")
        await elapse(60.0)
    assert len(rows) < SINGLY + 40


@pytest.mark.parametrize("operation", [Operation.ME, Operation.LEASE])
async def test_requests_that_anybody_may_repeat_displace_no_other_rows(operation: Operation) -> None:
    rows: list[AuditRow] = []
    audit = Audit(rows.append, lambda: "today")
    for _ in range(1000):
        audit.asked(Caller("vera", Role.STUDENT, "10.0.0.1"), operation, 0, "")
    assert len(rows) == SINGLY


async def test_repeated_requests_hide_no_change_of_another_subject() -> None:
    rows: list[AuditRow] = []
    audit = Audit(rows.append, lambda: "today")
    ana = Caller("ana", Role.STUDENT, "10.0.0.9")
    for _ in range(2 * SINGLY):
        audit.asked(ana, Operation.LEASE, 0, "")
        audit.asked(ana, Operation.STOP, 0, "")
        audit.asked(ana, Operation.SPEED, 4102, "")
    before = len(rows)
    audit.asked(ana, Operation.ME, 0, "name ana")
    audit.asked(ana, Operation.ME, 0, "token 0123abcd")
    assert [row.detail for row in rows[before:]] == ["name ana", "token 0123abcd"]


async def test_refused_requests_for_many_subjects_are_counted_together() -> None:
    rows: list[AuditRow] = []
    audit = Audit(rows.append, lambda: "today")
    for number in range(1000):
        audit.asked(Caller("ana", Role.STUDENT, "10.0.0.9"), Operation.ME, NotFound.code, f"token {number}")
    assert len(rows) == SINGLY


async def test_audit_forgets_callers_that_have_gone() -> None:
    rows: list[AuditRow] = []
    audit = Audit(rows.append, lambda: "today")
    for _ in range(3):
        for _ in range(2 * SINGLY):
            audit.not_signed_in("", "10.0.0.1")
        await elapse(6.0 * COUNTED)
    assert [row.detail for row in rows] == ([""] * SINGLY + [f"and {SINGLY} more in {COUNTED:.0f} s"]) * 3


async def test_audit_row_holds_any_subject() -> None:
    rows: list[AuditRow] = []
    Audit(rows.append, lambda: "today").asked(LOCAL, Operation.TEACH, 0, "pose \udcff" + "x" * 1000)
    assert rows[0].detail.startswith("pose ?")
    assert len(rows[0].detail) == 200
    assert (rows[0].who, rows[0].role, rows[0].date, rows[0].operation) == ("local", "admin", "today", "teach")


async def test_token_given_in_the_wrong_place_is_not_recorded() -> None:
    rows: list[AuditRow] = []
    token = f"maya_0123abcd_{'f' * 48}"
    Audit(rows.append, lambda: "today").asked(LOCAL, Operation.USERS, 4004, f"token {token}")
    assert rows[0].detail == "token maya_0123abcd_…"


async def test_lost_lease_is_reported_with_the_reason() -> None:
    gate_case = GateCase()
    ann = Caller("ann", Role.OPERATOR, "", gate_case.lease.take("ann", "").id)
    gate_case.lease.take("root", "", force=True)
    with pytest.raises(LeaseLost, match="broken"):
        await gate_case.gate.call(ann, Operation.SPEED, lambda _: elapse(0.0))
    gate_case.lease.close()
