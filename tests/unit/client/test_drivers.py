"""Both clients over real sockets: hanging, closed and missing servers; stop overtakes all other requests."""

from __future__ import annotations

import asyncio
import threading
from dataclasses import replace
from typing import Any

import pytest

from dmc41x3.loops import run
from maya_un import AsyncClient, Client
from maya_un.client.plans import robot
from maya_un.client.request import Request, get
from maya_un.client.steps import persistently
from maya_un.errors import Busy, LeaseHeld, LeaseLost, ServiceNotAnswering, ServiceNotRunning
from maya_un.schema.bodies import Speed
from maya_un.schema.jobs import JobAccepted
from maya_un.schema.people import LeaseTaken
from maya_un.values import StopReport
from tests.ports import free_port
from tests.unit.cli.servers import hanging_service, http_service
from tests.unit.client.service_stub import Asked, service
from tests.unit.client.test_plans import NOBODY, REPORT

STOPPING = StopReport(True, 0.5, (0.0, 0.1, 0.1))
TAKEN = LeaseTaken("lease 1", "ana", "", 1.5)


def test_both_ask_the_same_and_read_the_same() -> None:
    async def later(url: str) -> StopReport:
        async with AsyncClient(url) as client:
            return await client.stop()

    with service(lambda _: STOPPING) as stand, Client(stand.url) as client:
        assert client.stop() == run(later(stand.url)) == STOPPING
    assert stand.paths == ["POST /v1/stop"] * 2
    assert stand.asked[0].headers.keys() == stand.asked[1].headers.keys()


def test_a_refusal_is_raised_by_both() -> None:
    async def later(url: str) -> None:
        async with AsyncClient(url) as client:
            with pytest.raises(Busy, match="homing"):
                await client.speed(0.5)

    with service(lambda _: Busy(doing="homing")) as stand:
        with Client(stand.url) as client, pytest.raises(Busy, match="homing"):
            client.speed(0.5)
        run(later(stand.url))


async def test_the_client_that_blocks_works_inside_a_running_loop() -> None:
    with service(lambda _: STOPPING) as stand, Client(stand.url) as client:
        assert client.stop() == STOPPING


def test_without_a_listener_nothing_runs() -> None:
    url = f"http://127.0.0.1:{free_port()}"

    async def later() -> None:
        async with AsyncClient(url) as client:
            with pytest.raises(ServiceNotRunning):
                await client.speed(1.0)

    with Client(url) as client, pytest.raises(ServiceNotRunning):
        client.speed(1.0)
    run(later())


def test_hanging_service_does_not_answer() -> None:
    async def later(url: str) -> None:
        async with AsyncClient(url) as client:
            with pytest.raises(ServiceNotAnswering):
                await client.perform(get("/v1/x", int, 0.05))

    with hanging_service() as url:
        with Client(url) as client, pytest.raises(ServiceNotAnswering):
            client.perform(get("/v1/x", int, 0.05))
        run(later(url))


def test_other_program_at_the_port_is_detected_by_both_clients() -> None:
    with (
        http_service(lambda *_: (200, b"<html>")) as url,
        Client(url) as client,
        pytest.raises(ServiceNotAnswering),
    ):
        client.status()


def test_submission_with_a_lost_answer_is_repeated_with_its_key() -> None:
    answers: list[Any] = [None, None, JobAccepted(7, "x", 1)]

    def says(asked: Asked) -> Any:
        return answers.pop(0)

    command = Request("POST", "/v1/jobs", JobAccepted, body={"steps": ["home"]}, key="k1")
    with service(says) as stand, Client(stand.url) as client:
        assert client.perform(persistently(command)).id == 7
    assert [asked.headers["idempotency-key"] for asked in stand.asked] == ["k1"] * 3


def test_stop_does_not_wait_for_other_requests_of_the_client() -> None:
    released = threading.Event()

    def says(asked: Asked) -> Any:
        if asked.path == "/v1/stop":
            return STOPPING
        released.wait(20.0)
        return []

    with service(says) as stand, Client(stand.url) as client:
        waiting = [
            threading.Thread(target=client.perform, args=(get("/v1/events", list[int], 30.0),)) for _ in range(20)
        ]
        for thread in waiting:
            thread.start()
        assert client.stop() == STOPPING
        assert any(thread.is_alive() for thread in waiting)
        released.set()
        for thread in waiting:
            thread.join()


class Leasing:
    """Gives a lease for 1.5 s, renews it, and reports it lost from the renewal on that the test chooses."""

    def __init__(self, renewals: int) -> None:
        self.left = renewals
        self.renewed = threading.Semaphore(0)

    def __call__(self, asked: Asked) -> Any:
        match asked.method, asked.path:
            case "POST", "/v1/lease":
                return TAKEN
            case "POST", "/v1/lease/renew":
                self.left -= 1
                self.renewed.release()
                return replace(NOBODY, holder="ana", yours=True) if self.left >= 0 else LeaseLost(reason="broken")
            case "POST", "/v1/speed":
                return Speed(1.0)
            case "DELETE", "/v1/lease":
                return NOBODY
            case _:
                return STOPPING


@pytest.mark.waits("1 s until a lease of 1.5 s is renewed twice, by a thread in real time")
def test_inside_the_block_the_lease_is_shown_and_renewed_and_given_back_at_its_end() -> None:
    leasing = Leasing(99)
    with service(leasing) as stand, Client(stand.url) as client:
        with client.lease(note="calibration") as lease:
            assert lease == TAKEN
            for _ in range(2):
                assert leasing.renewed.acquire(timeout=10.0)
            client.stop()
        client.stop()
    assert stand.asked[0].body == {"note": "calibration"}
    inside, outside = (asked for asked in stand.asked if asked.path == "/v1/stop")
    assert inside.headers["maya-lease"] == "lease 1"
    assert "maya-lease" not in outside.headers
    (given_back,) = (asked for asked in stand.asked if asked.method == "DELETE")
    assert given_back.headers["maya-lease"] == "lease 1"


@pytest.mark.waits("1 s until a lease of 1.5 s is renewed twice, by a thread in real time")
def test_lost_lease_is_raised_by_the_next_request() -> None:
    leasing = Leasing(1)
    with (
        service(leasing) as stand,
        Client(stand.url) as client,
        pytest.raises(LeaseLost, match="broken"),
        client.lease(),
    ):
        for _ in range(2):
            assert leasing.renewed.acquire(timeout=10.0)
        while True:
            client.speed(1.0)


def test_lost_lease_is_raised_at_the_end_of_the_block_at_the_latest() -> None:
    leasing = Leasing(0)
    with (
        service(leasing) as stand,
        Client(stand.url) as client,
        pytest.raises(LeaseLost, match="broken"),
        client.lease(),
    ):
        while not client.held.missed:
            leasing.renewed.acquire(timeout=0.01)


def test_error_inside_the_block_is_raised_and_the_lease_returned() -> None:
    with (
        service(Leasing(99)) as stand,
        Client(stand.url) as client,
        pytest.raises(ZeroDivisionError),
        client.lease(),
    ):
        raise ZeroDivisionError
        assert client.held.id == ""
    assert stand.paths[-1] == "DELETE /v1/lease"


def test_block_does_not_begin_when_another_holds_the_lease() -> None:
    with (
        service(lambda _: LeaseHeld(holder="berta", since="3 s")) as stand,
        Client(stand.url) as client,
        pytest.raises(LeaseHeld, match="berta"),
        client.lease(),
    ):
        pytest.fail("the block ran")


@pytest.mark.waits("1.5 s until a lease of 1.5 s is renewed three times, over a real socket")
def test_a_task_keeps_the_lease_of_a_client_that_awaits() -> None:
    leasing = Leasing(2)

    async def later(url: str) -> None:
        async with AsyncClient(url) as client:
            with pytest.raises(LeaseLost, match="broken"):
                async with client.lease(note="x"):
                    while True:
                        await client.speed(1.0)

    with service(leasing) as stand:
        run(later(stand.url))
    assert stand.paths.count("POST /v1/lease/renew") == 3
    assert {asked.headers.get("maya-lease") for asked in stand.asked[1:]} == {"lease 1"}


def test_cancelled_waiting_task_cancels_its_command() -> None:
    waiting = threading.Event()
    never = threading.Event()

    def says(asked: Asked) -> Any:
        if asked.path.startswith("/v1/events"):
            waiting.set()
            never.wait(20.0)
            return []
        return REPORT

    async def later(url: str) -> None:
        async with AsyncClient(url) as client:
            command = asyncio.create_task(client.perform(robot.followed(7, since=0)))
            await asyncio.to_thread(waiting.wait, 10.0)
            command.cancel()
            with pytest.raises(asyncio.CancelledError):
                await command

    with service(says) as stand:
        run(later(stand.url))
        never.set()
    assert stand.paths[-1] == "DELETE /v1/jobs/7"
