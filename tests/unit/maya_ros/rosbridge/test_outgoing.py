"""Pending output for clients that do not read is bounded."""

from __future__ import annotations

from maya_ros.rosbridge.client import Backlog, Sender
from maya_ros.rosbridge.limits import ANSWERS_OWED, OWED
from maya_un.http.stream.messages import framed
from tests.rosbridge_clients import ClientOutput


def contents(mouth: ClientOutput) -> list[str]:
    return [content.decode() for _, content in mouth.frames]


def test_waiting_output_sends_answers_first_and_topics_in_turn() -> None:
    mouth = ClientOutput()
    sender, one, other = Sender(mouth), Backlog(10), Backlog(10)
    mouth.full = True
    for number in range(3):
        sender.send(one, framed(f"one {number}".encode()))
    sender.send(other, framed(b"other"))
    sender.answer(framed(b"answer"))
    assert contents(mouth) == []
    mouth.take_more()
    assert contents(mouth) == ["answer", "one 0", "other", "one 1", "one 2"]
    assert sender.owed == 0


def test_connection_that_ends_while_output_waits_ends_the_sending() -> None:
    mouth = ClientOutput()
    sender, backlog = Sender(mouth), Backlog(10)
    mouth.full = True
    for number in range(3):
        sender.send(backlog, framed(f"{number}".encode()))
    write = mouth.write

    def write_one(frames: bytes) -> None:
        write(frames)
        mouth.full = True

    mouth.write = write_one  # type: ignore[method-assign]
    mouth.take_more()
    assert contents(mouth) == ["0"]
    mouth.take_more()
    assert contents(mouth) == ["0", "1"]


def test_nothing_overtakes_waiting_output() -> None:
    mouth = ClientOutput()
    sender, backlog = Sender(mouth), Backlog(10)
    mouth.full = True
    sender.send(backlog, framed(b"first"))
    mouth.full = False
    sender.send(backlog, framed(b"second"))
    mouth.take_more()
    assert contents(mouth) == ["first", "second"]


def test_oldest_message_of_the_fullest_topic_is_dropped_first() -> None:
    mouth = ClientOutput()
    sender, large, small = Sender(mouth), Backlog(1000), Backlog(1000)
    mouth.full = True
    sender.send(small, framed(b"small"))
    for number in range(100):
        sender.send(large, framed(f"{number} ".encode() + bytes(100_000)))
        assert sender.owed <= OWED
    mouth.take_more()
    said = contents(mouth)
    assert "small" in said
    assert said[-1].startswith("99 ")
    assert len(said) < 60


def test_unwanted_output_is_dropped() -> None:
    mouth = ClientOutput()
    sender, backlog = Sender(mouth), Backlog(10)
    mouth.full = True
    sender.send(backlog, framed(b"x"))
    sender.forget(backlog)
    assert sender.owed == 0
    mouth.take_more()
    assert contents(mouth) == []


def test_client_that_does_not_read_answers_is_disconnected() -> None:
    mouth = ClientOutput()
    sender = Sender(mouth)
    mouth.full = True
    for _ in range(ANSWERS_OWED // 100_000):
        sender.answer(framed(bytes(100_000)))
    sender.answer(framed(bytes(100_000)))
    assert [code for code, _ in mouth.ended] == [4016]
