"""Events without a gap and states as they are, against scripted websockets."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any

import pytest

from maya_un.client.plans.streaming import PATIENCE, Event, events, states
from maya_un.errors import EventsForgotten, ServiceNotAnswering, ServiceNotRunning
from maya_un.values import Mode, State
from tests.unit.client.plan_player import Player

NO = (False, False, False)
STATE = State(
    0.0, Mode.IDLE, True, (0, 0, 0), None, None, (0.0, 0.0, 0.0), False, NO, NO, NO, (1, 1, 1), False, None, None
)


def hello(run: int = 3, last: int = 10) -> str:
    return json.dumps({"type": "hello", "run": run, "last_event": last, "protocol": 1})


def event(seq: int, run: int = 3) -> str:
    plain = {"seq": seq, "time": 1.5, "kind": "job", "code": 0, "detail": {"job": 7}}
    return json.dumps({"type": "event", "run": run, "event": plain})


def state(time: float) -> str:
    return json.dumps({"type": "state", "run": 3, "state": {**asdict(STATE), "time": time}})


def cut() -> ServiceNotAnswering:
    return ServiceNotAnswering(reason="cut")


def places(player: Player) -> list[Any]:
    return [message["events"] for message in player.said]


def test_events_start_now_by_default() -> None:
    player = Player(heard=[hello(), json.dumps({"type": "subscribed", "run": 3}), event(11), event(12)])
    assert player.items(events(), 2) == [
        Event(3, 11, 1.5, "job", 0, {"job": 7}),
        Event(3, 12, 1.5, "job", 0, {"job": 7}),
    ]
    assert places(player) == [{"since": 10, "run": 3}]


def test_past_events_are_requested_by_number_and_run() -> None:
    player = Player(heard=[hello(), event(5)])
    player.items(events(since=4, run=2), 1)
    assert places(player) == [{"since": 4, "run": 2}]


def test_events_continue_after_the_last_one_after_a_break() -> None:
    player = Player(heard=[hello(), event(11), cut(), hello(last=13), event(12), cut(), cut(), hello(), event(13)])
    assert [found.seq for found in player.items(events(), 3)] == [11, 12, 13]
    assert places(player) == [{"since": 10, "run": 3}, {"since": 11, "run": 3}, {"since": 12, "run": 3}]
    assert player.dialled == 4


def test_a_break_before_the_first_event_loses_none() -> None:
    player = Player(heard=[hello(last=10), cut(), hello(last=12), event(11)])
    assert [found.seq for found in player.items(events(), 1)] == [11]
    assert places(player)[-1] == {"since": 10, "run": 3}


def test_restarted_service_sends_its_run_from_the_beginning() -> None:
    restart = json.dumps({"type": "restart", "run": 4})
    heard = [
        hello(),
        event(11),
        cut(),
        hello(run=4, last=1),
        restart,
        event(1, run=4),
        cut(),
        hello(run=4),
        event(2, run=4),
    ]
    player = Player(heard=heard)
    assert [(found.run, found.seq) for found in player.items(events(), 3)] == [(3, 11), (4, 1), (4, 2)]
    assert places(player)[-1] == {"since": 1, "run": 4}


def test_slow_reader_continues_at_its_position() -> None:
    lagging = json.dumps({"type": "error", "code": 4016, "message": "", "details": {"behind": 9, "since": 11}})
    player = Player(heard=[hello(), event(11), lagging, hello(), event(12)])
    assert [found.seq for found in player.items(events(), 2)] == [11, 12]


def test_events_that_are_forgotten_end_the_stream_with_that_error() -> None:
    gone = json.dumps({"type": "error", "code": 4013, "message": "", "details": {"since": 1, "oldest": 90}})
    player = Player(heard=[hello(), gone])
    with pytest.raises(EventsForgotten, match="90"):
        player.items(events(since=1), 1)


def test_service_that_does_not_return_ends_the_stream() -> None:
    player = Player(heard=[hello(), event(11), *[ServiceNotRunning() for _ in range(100)]])
    with pytest.raises(ServiceNotRunning):
        player.items(events(), 2)
    assert PATIENCE <= player.now <= PATIENCE + 2.0


def test_states_have_the_requested_rate_and_the_newest_of_several_is_sent() -> None:
    player = Player(
        heard=[hello(), json.dumps({"type": "subscribed"}), state(1.0), state(2.0), cut(), hello(), state(3.0)]
    )
    assert [found.time for found in player.items(states(rate=5.0), 2)] == [2.0, 3.0]
    assert [message["state"] for message in player.said] == [{"rate": 5.0}] * 2
