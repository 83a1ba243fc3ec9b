"""The stream as clients meet it, on real sockets: so these tests run in real loops."""

from __future__ import annotations

import asyncio
import json
import socket
from collections.abc import Awaitable, Callable
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from dmc41x3.loops import ScaledLoop, run
from maya_un import __version__
from maya_un.errors import InvalidRequest, LeaseHeld, NotAllowed, NotHomed
from maya_un.http import connections
from maya_un.http.sockets import bound_socket
from maya_un.http.stream import messages, server, session
from maya_un.http.stream.messages import LONGEST_MESSAGE
from maya_un.schema.encoding import to_data
from maya_un.schema.fleet import FleetRobot, FleetView
from maya_un.service.access.operations import LOCAL
from tests.streaming import Client, SlowReader, Watched, connected, streamed
from tests.virtual_time import turn

Story = Callable[[Watched, Client], Awaitable[None]]


def run_story(story: Story, *, before: int = 0, run_number: int = 1, speed: float = 1.0) -> None:
    """Have one client live through `story` at a service that had so many events before."""

    async def main() -> None:
        watched = Watched(run_number, speed)
        watched.happen(before)
        async with streamed(watched) as url, connected(url) as client:
            await story(watched, client)

    run(main(), partial(ScaledLoop, speed) if speed != 1.0 else None)


def test_greeting_has_versions_run_last_event_and_caller() -> None:
    async def story(_: Watched, client: Client) -> None:
        (greeting,) = client.got
        time, date = greeting.pop("time"), datetime.fromisoformat(greeting.pop("date"))
        assert greeting.pop("clock") <= (await client.ask("ping"))["clock"]
        assert greeting == {
            "type": "hello",
            "version": __version__,
            "protocol": 1,
            "run": 4,
            "last_event": 3,
            "robot": "MAYA",
            "address": "sim",
            "speed": 50.0,
            "fleet": False,
            "who": {"name": "local", "role": "admin"},
        }
        passed = (asyncio.get_running_loop().time() - time) / 50.0
        assert (datetime.now(UTC) - date).total_seconds() == pytest.approx(passed, abs=0.1)

    run_story(story, before=3, run_number=4, speed=50.0)


def test_fleet_is_sent_at_once_and_at_each_change_while_the_robot_is_silent() -> None:
    async def story(watched: Watched, client: Client) -> None:
        await client.ask("subscribe", fleet=True)
        assert (await client.until("fleet"))["fleet"]["link"] == "none"
        for view in (FleetView("connected", robots=(FleetRobot("MAYA", "idle"),)), FleetView("lost", more=3)):
            watched.fleet.show(view)
            assert (await client.until("fleet"))["fleet"] == to_data(view)

    run_story(story)


def test_invalid_message_is_answered_and_the_client_stays() -> None:
    async def story(_: Watched, client: Client) -> None:
        for text in ("[]", "{", '{"type": "dance", "id": 7}', '{"type": "subscribe", "state": {"rate": 1000}}'):
            await client.connection.send(text)
            answer = await client.hear()
            assert (answer["type"], answer["code"]) == ("error", 4005)
        assert (await client.ask("ping"))["type"] == "pong"

    run_story(story)


def test_an_error_is_in_the_language_of_the_request() -> None:
    async def main() -> None:
        async with streamed(Watched()) as url, connected(url, **{"Accept-Language": "es"}) as client:
            assert (await client.ask("dance"))["message"].startswith("La petición tiene un error")

    run(main())


def test_hello_changes_the_language_of_the_connection() -> None:
    async def main() -> None:
        async with streamed(Watched()) as url, connected(url, **{"Accept-Language": "es"}) as client:
            await client.say("subscribe", can=True)
            for language, spoken in (("", "es"), ("en", "en"), ("es-CO", "es")):
                await client.say("hello", language=language)
                assert (await client.until("can"))["can"]["actions"]["jog"]["message"] == NotHomed(
                    command="maya home"
                ).text(spoken)
                begins = InvalidRequest.template(spoken).split("{")[0]
                assert (await client.ask("dance"))["message"].startswith(begins)
            assert (await client.ask("hello", language=7))["code"] == 4005

    run(main())


def test_a_message_that_is_too_long_ends_the_connection() -> None:
    async def story(_: Watched, client: Client) -> None:
        await client.connection.send("x" * (LONGEST_MESSAGE + 1))
        with pytest.raises(ConnectionClosed):
            await client.until("nothing")
        assert client.connection.close_code == 1009

    run_story(story)


@pytest.mark.parametrize("speed", [1.0, 100.0])
def test_states_events_and_the_queue_follow_the_subscription(speed: float) -> None:
    async def story(watched: Watched, client: Client) -> None:
        await client.ask("subscribe", state={"rate": 50}, events={"since": 0}, queue=True)
        assert (await client.until("state"))["state"]["counts"] == [0, 0, 0]
        shown = watched.count()
        while (await client.until("state"))["state"]["counts"][0] != shown:
            pass
        watched.happen(3)
        assert await client.events_to(5) == [1, 2, 3, 4, 5]
        assert "queue" in {message["type"] for message in client.got}

    run_story(story, before=2, speed=speed)


def test_events_are_without_a_gap_from_the_past_into_the_present() -> None:
    async def story(watched: Watched, client: Client) -> None:
        await client.say("subscribe", events={"since": 17})
        for _ in range(300):
            watched.happen()
            await turn()
        assert await client.events_to(2300) == list(range(18, 2301))

    run_story(story, before=2000)


def test_without_a_number_events_are_those_from_now_on() -> None:
    async def story(watched: Watched, client: Client) -> None:
        await client.ask("subscribe", events={})
        watched.happen()
        assert await client.events_to(6) == [6]

    run_story(story, before=5)


def test_events_can_be_ended_and_restarted_after_any_number() -> None:
    async def story(watched: Watched, client: Client) -> None:
        await client.ask("subscribe", events={"since": 3})
        await client.events_to(5)
        await client.ask("subscribe", events=None)
        watched.happen(2)
        await client.ask("subscribe", events={"since": 1})
        assert await client.events_to(7) == [4, 5, 2, 3, 4, 5, 6, 7]

    run_story(story, before=5)


def test_a_number_that_is_not_there_yet_is_refused() -> None:
    async def story(_: Watched, client: Client) -> None:
        answer = await client.ask("subscribe", events={"since": 6})
        assert (answer["code"], answer["details"]["key"]) == (4005, "events.since")

    run_story(story, before=5)


def test_forgotten_events_are_reported() -> None:
    async def story(watched: Watched, client: Client) -> None:
        watched.forgotten = 3
        await client.say("subscribe", events={"since": 1})
        answer = await client.until("error")
        assert (answer["code"], answer["details"]) == (4013, {"since": 1, "oldest": 4})
        await client.ask("subscribe", events={"since": 3})
        assert await client.events_to(5) == [4, 5]

    run_story(story, before=5)


def test_client_of_another_run_is_notified_and_gets_this_run() -> None:
    async def story(watched: Watched, client: Client) -> None:
        await client.ask("subscribe", events={"since": 900, "run": 1})
        assert await client.until("restart") == {"type": "restart", "run": 2}
        watched.happen()
        assert await client.events_to(4) == [1, 2, 3, 4]

    run_story(story, before=3, run_number=2)


def test_client_too_far_behind_is_notified_and_goes_on_from_there() -> None:
    async def main() -> None:
        watched = Watched()
        async with streamed(watched, most_behind=100) as url, connected(url) as well:
            await well.ask("subscribe", events={"since": 0})
            async with connected(url) as slow:
                await slow.ask("subscribe", events={"since": 0})
                for round_ in range(1, 81):
                    watched.happen(20, text="x" * 2000)
                    await well.events_to(20 * round_)
                with pytest.raises(ConnectionClosed):
                    await slow.until("nothing")
            run_story = slow.got[-1]
            assert (run_story["type"], run_story["code"], slow.connection.close_code) == ("error", 4016, 4016)
            assert slow.numbers == list(range(1, run_story["details"]["since"] + 1))
            async with connected(url) as again:
                await again.say("subscribe", events={"since": run_story["details"]["since"], "run": 1})
                assert slow.numbers + await again.events_to(1600) == list(range(1, 1601))

    run(main())


def test_service_is_watched_only_while_there_are_clients() -> None:
    async def main() -> None:
        watched = Watched()
        before = asyncio.all_tasks()
        async with streamed(watched) as url:
            for round_ in range(3):
                async with connected(url) as one, connected(url) as other:
                    for client in (one, other):
                        assert client.got[0]["last_event"] == round_ * 2
                        await client.ask("subscribe", events={}, state={"rate": 10})
                    watched.happen(2)
                    for client in (one, other):
                        assert await client.events_to(round_ * 2 + 2) == [round_ * 2 + 1, round_ * 2 + 2]
        for task in asyncio.all_tasks() - before:
            with pytest.raises(asyncio.CancelledError):
                await task

    run(main())


@pytest.mark.parametrize("view", [{"mode": object()}, None])
def test_a_service_that_fails_ends_its_clients_with_a_code(
    view: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MAYA_STATE_DIR", str(tmp_path))

    async def story(watched: Watched, client: Client) -> None:
        if view is None:
            watched.view = None  # type: ignore[assignment,method-assign]
        else:
            watched.shown = {"mode": object()}
        await client.say("subscribe", queue=True)
        with pytest.raises(ConnectionClosed):
            await client.until("nothing")
        assert (client.got[-1]["type"], client.got[-1]["code"]) == ("error", 5999)
        assert client.connection.close_code == 1011

    run_story(story)
    assert "Traceback" in next(tmp_path.rglob("maya.log")).read_text(encoding="utf-8")


def test_clients_are_notified_of_the_end_of_the_server(capfd: pytest.CaptureFixture[str]) -> None:
    async def main() -> int | None:
        watched = Watched()
        async with streamed(watched) as url:
            connecting = connected(url)
            client = await connecting.__aenter__()
            await client.ask("subscribe", state={"rate": 10}, events={}, queue=True)
        with pytest.raises(ConnectionClosed):
            await client.until("nothing")
        await connecting.__aexit__(None, None, None)
        return client.connection.close_code

    assert run(main()) == 1012
    assert capfd.readouterr() == ("", "")


def test_a_small_frame_does_not_wait_for_the_acknowledgement_of_the_one_before() -> None:
    """asyncio switches Nagle's algorithm off for what is TCP by name, and for nothing else."""
    with bound_socket(0) as listener:
        assert listener.proto == socket.IPPROTO_TCP


@pytest.mark.waits("1 s in which a hundred messages beyond the allowance are answered, over a real socket")
def test_a_flood_of_messages_is_answered_in_order_and_not_faster_than_the_robot_can_bear() -> None:
    async def story(_: Watched, client: Client) -> None:
        began = asyncio.get_running_loop().time()
        for number in range(300):
            await client.say("ping", id=number)
        answers: list[Any] = [(await client.until("pong"))["id"] for _ in range(300)]
        assert answers == list(range(300))
        assert asyncio.get_running_loop().time() - began >= (300 - session.BURST - 1) / session.MOST_MESSAGES

    run_story(story)


def test_a_message_in_bytes_is_a_message() -> None:
    async def story(_: Watched, client: Client) -> None:
        await client.connection.send(json.dumps({"type": "ping"}).encode())
        assert (await client.hear())["type"] == "pong"

    run_story(story)


async def guarded(watched: Watched) -> tuple[str, str]:
    """Have users kept; return the tokens of an administrator and of a viewer."""
    admin = await watched.users.add("ada", "admin")
    viewer = await watched.users.add("vera", "viewer")
    return admin.token, viewer.token


def test_token_in_the_header_is_greeted_by_name() -> None:
    async def main() -> None:
        watched = Watched()
        _, viewer = await guarded(watched)
        async with streamed(watched) as url, connected(url, Authorization=f"Bearer {viewer}") as client:
            assert client.got[0]["who"] == {"name": "vera", "role": "viewer"}
            await client.ask("subscribe", state={"rate": 10})
            assert (await client.until("state"))["state"]["mode"] == "idle"

    run(main())


def test_a_browser_shows_its_token_by_the_first_message() -> None:
    async def main() -> None:
        watched = Watched()
        _, viewer = await guarded(watched)
        async with streamed(watched) as url, connect(url, compression=None, proxy=None) as connection:
            client = Client(connection)
            await client.say("hello", token=viewer, protocol=1)
            assert (await client.hear())["who"]["name"] == "vera"

    run(main())


@pytest.mark.parametrize(
    ("first", "code"),
    [
        ({"type": "subscribe"}, 4101),
        ({"type": "hello"}, 4101),
        ({"type": "hello", "token": "maya_wrong_token"}, 4101),
        ({"type": "hello", "token": 5}, 4005),
        ({"type": "hello", "protocol": 2}, 4005),
        ({"type": "what"}, 4005),
    ],
)
def test_wrong_token_is_refused_with_the_reason_and_closed(first: dict[str, Any], code: int) -> None:
    async def main() -> None:
        watched = Watched()
        await guarded(watched)
        async with streamed(watched) as url, connect(url, compression=None, proxy=None) as connection:
            client = Client(connection)
            await connection.send(json.dumps(first))
            assert (await client.hear())["code"] == code
            with pytest.raises(ConnectionClosed):
                await client.hear()
            assert connection.close_code == code

    run(main())


def test_silent_client_is_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(session, "INTRODUCTION", 0.05)

    async def main() -> None:
        watched = Watched()
        await guarded(watched)
        async with streamed(watched) as url, connected(url) as client:
            assert client.got[0]["code"] == 4101

    run(main())


def test_time_that_the_service_needs_does_not_count_as_silence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(session, "INTRODUCTION", 0.0)  # over before anything is answered

    async def main() -> None:
        watched = Watched()
        _, viewer = await guarded(watched)
        async with streamed(watched) as url, connected(url, Authorization=f"Bearer {viewer}") as client:
            assert client.got[0]["type"] == "hello"

    run(main())


def test_time_that_the_service_needs_for_a_token_in_a_message_does_not_count(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(session, "INTRODUCTION", 0.0)

    async def main() -> None:
        watched = Watched()
        _, viewer = await guarded(watched)

        async def at_once(_: object) -> str:
            return json.dumps({"type": "hello", "token": viewer})

        monkeypatch.setattr(session, "received", at_once)
        async with streamed(watched) as url, connected(url) as client:
            assert client.got[0]["type"] == "hello"

    run(main())


def test_a_token_that_is_revoked_ends_the_stream_though_the_client_is_silent(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "LOOK_AGAIN", 1000.0)

    async def main() -> None:
        watched = Watched()
        _, viewer = await guarded(watched)
        async with streamed(watched) as url, connected(url, Authorization=f"Bearer {viewer}") as client:
            await client.ask("subscribe", state={"rate": 10})
            await watched.users.revoke(viewer.split("_")[1], replace(LOCAL, name="ada"))
            assert (await client.until("error"))["code"] == 4101
            with pytest.raises(ConnectionClosed):
                await client.hear()

    run(main())


def test_a_client_may_become_another_by_a_token() -> None:
    async def main() -> None:
        watched = Watched()
        admin, viewer = await guarded(watched)
        async with streamed(watched) as url, connected(url, Authorization=f"Bearer {admin}") as client:
            assert (await client.ask("hello", token=viewer))["who"]["name"] == "vera"
            assert (await client.ask("renew", lease="x"))["code"] == 4102

    run(main())


@pytest.mark.waits("1 s until a connection looks at its token again, over a real socket")
def test_stream_of_a_token_that_expires_ends_within_a_second(monkeypatch: pytest.MonkeyPatch) -> None:
    async def main() -> None:
        watched = Watched()
        _, viewer = await guarded(watched)
        async with streamed(watched) as url, connected(url, Authorization=f"Bearer {viewer}") as client:
            await client.ask("subscribe", state={"rate": 10})
            monkeypatch.setattr(watched.access.callers, "_expired", lambda _: True)
            assert (await client.until("error"))["code"] == 4101
            with pytest.raises(ConnectionClosed):
                await client.hear()

    run(main())


def test_stream_without_a_token_ends_when_the_first_user_is_added(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "LOOK_AGAIN", 1000.0)

    async def story(watched: Watched, client: Client) -> None:
        await client.ask("subscribe", state={"rate": 10})
        await guarded(watched)
        assert (await client.until("error"))["code"] == 4101
        with pytest.raises(ConnectionClosed):
            await client.hear()

    run_story(story)


def test_stream_of_a_demoted_user_goes_on_with_the_lower_role() -> None:
    async def main() -> None:
        watched = Watched()
        admin, _ = await guarded(watched)
        await watched.users.add("bea", "admin")
        async with streamed(watched) as url, connected(url, Authorization=f"Bearer {admin}") as client:
            await watched.users.change("ada", role="viewer", by=replace(LOCAL, name="bea"))
            assert (await client.ask("renew", lease="x"))["code"] == 4102

    run(main())


def test_rights_follow_the_role_and_the_bound_lease() -> None:
    async def main() -> None:
        watched = Watched()
        watched.show(homed=True)
        admin, _ = await guarded(watched)
        await watched.users.add("bea", "admin")
        lease = watched.access.lease.take("ada", "lab").id
        async with streamed(watched) as url, connected(url, Authorization=f"Bearer {admin}") as client:
            await client.ask("subscribe", can=True)
            assert await refusal_to_jog(client) == LeaseHeld.code
            await client.ask("renew", lease=lease, bound=True)
            assert await refusal_to_jog(client) is None
            await client.ask("renew", lease=lease)
            assert await refusal_to_jog(client) == LeaseHeld.code
            await watched.users.change("ada", role="viewer", by=replace(LOCAL, name="bea"))
            assert await refusal_to_jog(client) == NotAllowed.code

    run(main())


async def refusal_to_jog(client: Client) -> int | None:
    """Return the code in the next message about rights."""
    refusal = (await client.until("can"))["can"]["actions"]["jog"]
    return refusal and refusal["code"]


@pytest.mark.waits("1 s by which requests for the past beyond the allowance are delayed, over a real socket")
def test_repeated_requests_for_the_past_are_throttled() -> None:
    async def main() -> float:
        loop = asyncio.get_running_loop()
        async with streamed(Watched()) as url, connected(url) as client:
            began = loop.time()
            for _ in range(6):
                await client.ask("subscribe", events={"since": 0})
            return loop.time() - began

    assert run(main()) > 0.4


def test_a_lease_is_renewed_and_one_that_is_bound_ends_with_the_connection() -> None:
    async def main() -> None:
        watched = Watched()
        taken = await watched.lease.take(LOCAL)
        async with streamed(watched) as url:
            async with connected(url) as client:
                renewed = await client.ask("renew", lease=taken.id)
                assert (renewed["type"], renewed["bound"]) == ("renewed", False)
                assert 0.0 < renewed["expires_in"] <= 10.0
            async with connected(url) as client:
                assert watched.access.lease.holder is not None
                assert (await client.ask("renew", lease=taken.id, bound=True))["bound"]
                assert (await client.ask("renew", lease="another"))["code"] == 4105
            async with connected(url) as client:
                await client.ask("subscribe", events={"since": 0})
                while client.got[-1].get("event", {}).get("detail", {}).get("change") != "expired":
                    await client.until("event")
        assert watched.access.lease.holder is None

    run(main())


def test_a_client_that_does_not_answer_pings_is_cut_off(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(messages, "PING_INTERVAL", 0.05)
    monkeypatch.setattr(messages, "PING_TIMEOUT", 0.05)

    async def main() -> None:
        watched, loop = Watched(), asyncio.get_running_loop()
        async with streamed(watched) as url:
            dead = await loop.run_in_executor(None, SlowReader, url)
            got = await loop.run_in_executor(None, dead.read_on)
            assert [message["type"] for message in got] == ["hello"]
            dead.close()

    run(main())


def test_there_are_not_too_many_clients(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "NEAR_CLIENTS", 1)

    async def main() -> None:
        async with streamed(Watched()) as url:
            for _ in range(3):
                async with connected(url) as one, connected(url) as other:
                    assert (one.got[0]["type"], other.got[0]["code"]) == ("hello", 4106)

    run(main())


def test_one_other_machine_does_not_take_all_places_by_saying_nothing() -> None:
    from_afar = {"X-Forwarded-For": "192.0.2.1"}

    async def main() -> None:
        watched = Watched()
        _, viewer = await guarded(watched)
        async with (
            streamed(watched, readers=1) as url,
            connect(url, additional_headers=from_afar, proxy=None),
            connected(url, **from_afar) as second,
            connected(url, Authorization=f"Bearer {viewer}") as near,
        ):
            assert second.got[0]["code"] == 4106
            assert near.got[0]["type"] == "hello"

    run(main())
