from __future__ import annotations

import asyncio

import pytest

from dmc41x3.driver import Driver
from dmc41x3.errors import (
    CodedError,
    CommandRejected,
    ConnectFailed,
    EndedUnanswered,
    InternalError,
    InvalidValue,
    LinkLost,
    LinkTimeout,
    NotConnected,
    UnexpectedReply,
)
from dmc41x3.language.record import AxisRecord, DataRecord, encode
from dmc41x3.wire.transport import loopback_pair
from tests.unit.dmc41x3.scripted import TIMEOUT, conversation
from tests.virtual_time import elapse

RECORD = DataRecord(axes=(AxisRecord(position=0x3A3A3A3A), AxisRecord(), AxisRecord()), sample=7)


class Box:
    """A controller that refuses what begins with `bad`, and remembers the code until asked."""

    def __init__(self) -> None:
        self.code = 0

    def __call__(self, command: str) -> bytes | None:
        if command.startswith("bad"):
            self.code = int(command[3:])
            return b"?"
        if command == "TC1":
            code, self.code = self.code, 0
            return f" {code} some words\r\n:".encode()
        if command == "QR":
            return encode(RECORD) + b":"
        if command.startswith("MG "):
            return f" {command[3:]}\r\n:".encode()
        return b":"


def silent(_: str) -> None:
    """Answer nothing."""


async def outcome(waiting: asyncio.Future[str] | asyncio.Task[str]) -> CodedError:
    with pytest.raises(CodedError) as caught:
        await waiting
    return caught.value


async def test_reply_is_stripped_of_blanks() -> None:
    async with conversation(Box()) as (driver, _):
        assert await driver.send("MG 5.0000") == "5.0000"
        assert await driver.send("SHA") == ""
        assert driver.address == "box"


async def test_exact_keeps_the_blanks() -> None:
    async with conversation(Box()) as (driver, _):
        assert await driver.exact("MG 5.0000") == " 5.0000"


async def test_requests_of_many_tasks_are_answered_in_order() -> None:
    async with conversation(Box()) as (driver, peer):
        replies = await asyncio.gather(*(driver.send(f"MG {n}") for n in range(50)))
        assert replies == [str(n) for n in range(50)]
        assert peer.commands == [f"MG {n}" for n in range(50)]


async def test_value_is_a_number() -> None:
    async with conversation(Box()) as (driver, _):
        assert await driver.value("-12.5000") == -12.5
        with pytest.raises(UnexpectedReply, match="words"):
            await driver.value("words")
        assert await driver.value("1") == 1.0


async def test_a_record_may_contain_prompts() -> None:
    async with conversation(Box()) as (driver, _):
        first, reply, second = await asyncio.gather(driver.record(), driver.send("MG 1"), driver.record())
        assert (first, reply, second) == (RECORD, "1", RECORD)


async def test_a_rejection_names_command_code_and_reason() -> None:
    async with conversation(Box()) as (driver, _):
        with pytest.raises(CommandRejected) as caught:
            await driver.send("bad22")
        expected = {"command": "bad22", "tc": 22, "reason": "Begin not possible due to Limit Switch"}
        assert caught.value.details == expected
        assert not driver.lost.done()


async def test_an_unknown_code_keeps_the_controllers_words() -> None:
    async with conversation(Box()) as (driver, _):
        with pytest.raises(CommandRejected, match=r"code 199 .*some words"):
            await driver.send("bad199")


async def test_code_of_a_rejection_reaches_its_command() -> None:
    async with conversation(Box()) as (driver, peer):

        async def user() -> str:
            with pytest.raises(CommandRejected):
                await driver.send("bad22")
            return await driver.send("TC1")

        assert await user() == "0 some words"
        late = asyncio.create_task(driver.send("bad21"))
        others = [asyncio.create_task(driver.send("MG 1")) for _ in range(3)]
        assert (await outcome(late)).details["tc"] == 21
        assert await asyncio.gather(*others) == ["1"] * 3
        assert peer.commands[-1] == "TC1"


async def test_rejections_one_behind_the_other_share_one_question() -> None:
    async with conversation(Box()) as (driver, peer):
        tasks = [asyncio.create_task(driver.send(text)) for text in ("bad20", "MG 1", "bad21")]
        errors = [await outcome(tasks[0]), await outcome(tasks[2])]
        assert [error.details["command"] for error in errors] == ["bad20", "bad21"]
        assert errors[1].details["tc"] == 21
        assert peer.commands.count("TC1") == 1
        with pytest.raises(CommandRejected, match="code 6 "):
            await driver.send("bad6")


async def test_a_batch_is_packed_into_lines_of_80() -> None:
    async with conversation(Box()) as (driver, peer):
        commands = [f"MG {n}.0000" for n in range(40)]
        assert await driver.batch(commands) == [f"{n}.0000" for n in range(40)]
        *lines, rest = peer.wire.decode().split("\r")
        assert (rest, len(lines)) == ("", 6)
        assert max(map(len, lines)) <= 80
        assert peer.commands == commands


async def test_an_empty_batch_sends_nothing() -> None:
    async with conversation(Box()) as (driver, peer):
        assert await driver.batch([]) == []
        assert peer.wire == b""


async def test_a_batch_with_a_rejection_in_the_middle_raises_it_when_all_is_in() -> None:
    async with conversation(Box()) as (driver, peer):
        with pytest.raises(CommandRejected) as caught:
            await driver.batch(["MG 1", "bad32", "MG 2", "MG 3"])
        assert (caught.value.details["command"], caught.value.details["tc"]) == ("bad32", 32)
        assert peer.commands == ["MG 1", "bad32", "MG 2", "MG 3", "TC1"]
        assert await driver.send("MG 4") == "4"


async def test_a_batch_with_several_rejections_names_the_first() -> None:
    async with conversation(Box()) as (driver, _):
        with pytest.raises(CommandRejected, match="'bad30'"):
            await driver.batch(["bad30", "bad31"])


@pytest.mark.parametrize("command", ["TP;TE", "TP\r", "TP\n", "MG é", "x" * 81])
async def test_several_commands_at_once_never_reach_the_wire(command: str) -> None:
    async with conversation(Box()) as (driver, peer):
        with pytest.raises(InvalidValue):
            await driver.send(command)
        with pytest.raises(InvalidValue):
            await driver.batch(["MG 1", command])
        assert await driver.send("MG 2") == "2"
        assert peer.commands == ["MG 2"]


async def test_urgent_is_on_the_wire_before_anybody_waits() -> None:
    async with conversation(Box()) as (driver, peer):
        peer.held = True
        waiting = asyncio.create_task(driver.batch([f"LI {n},0,0" for n in range(30)]))
        await elapse(0.1)
        seen: list[tuple[str, bytes]] = []
        driver.tap = lambda way, data: seen.append((way, data))
        reply = driver.urgent("ST S")
        assert seen == [("tx", b"ST S\r")]
        peer.release()
        assert await reply == ""
        assert await waiting == [""] * 30
        assert peer.commands[-1] == "ST S"


async def test_an_urgent_reply_may_be_left_alone() -> None:
    async with conversation(Box()) as (driver, peer):
        await driver.send("MG 1")
        driver.urgent("bad22")
        peer.held = True
        driver.urgent("ST S")
        await elapse(0.1)
        peer.end.cut()
        assert isinstance(await driver.lost, LinkLost)


async def test_silence_loses_the_link_once() -> None:
    async with conversation(silent) as (driver, _):
        loop = asyncio.get_running_loop()
        start = loop.time()
        waiting = [asyncio.create_task(driver.send(f"MG {n}")) for n in range(3)]
        errors = [await outcome(task) for task in waiting]
        assert loop.time() - start == pytest.approx(TIMEOUT)
        assert all(isinstance(error, LinkTimeout) for error in errors)
        assert len({id(error) for error in errors}) == 3
        assert errors[0].details == {"address": "box", "command": "MG 0", "seconds": "2"}
        assert driver.lost.result().details == errors[0].details
        with pytest.raises(LinkTimeout):
            await driver.send("TP")
        with pytest.raises(LinkTimeout):
            driver.urgent("ST S")


async def test_the_watchdog_waits_for_the_oldest_not_for_the_whole() -> None:
    async with conversation(Box()) as (driver, peer):
        loop = asyncio.get_running_loop()
        for _ in range(5):
            peer.held = True
            loop.call_later(0.9 * TIMEOUT, peer.release)
            assert await driver.send("MG 1") == "1"
        assert not driver.lost.done()


async def test_progress_in_a_long_batch_keeps_the_link() -> None:
    async with conversation(silent) as (driver, peer):
        waiting = asyncio.create_task(driver.batch(["SHA"] * 5))
        for _ in range(5):
            await elapse(0.9 * TIMEOUT)
            peer.end.write(b":")
        assert await waiting == [""] * 5


async def test_slow_command_has_its_own_timeout() -> None:
    async with conversation(Box()) as (driver, peer):
        peer.held = True
        asyncio.get_running_loop().call_later(3 * TIMEOUT, peer.release)
        assert await driver.send("BN", timeout=4 * TIMEOUT) == ""


async def test_an_idle_link_is_not_lost() -> None:
    async with conversation(Box()) as (driver, _):
        await driver.send("MG 1")
        await elapse(100 * TIMEOUT)
        assert not driver.lost.done()
        assert await driver.send("MG 1") == "1"


async def test_a_reply_that_came_while_this_process_slept_counts() -> None:
    async with conversation(silent) as (driver, peer):
        loop = asyncio.get_running_loop()
        # The bytes are there, and the watchdog is due, before their reader has its turn.
        loop.call_at(loop.time() + TIMEOUT, peer.end.write, b" 1\r\n:")
        assert await driver.send("TP") == "1"


@pytest.mark.parametrize("part", [b"", b" 20", encode(RECORD)[:100]])
async def test_a_cut_in_a_reply_fails_everything_under_way(part: bytes) -> None:
    async with conversation(silent) as (driver, peer):
        reading = asyncio.create_task(driver.record() if part[:1] == b"\x87" else driver.send("TP"))
        waiting = asyncio.create_task(driver.send("MG 1"))
        await elapse(0.1)
        peer.end.write(part)
        await elapse(0.1)
        peer.end.cut()
        loss = LinkLost if part else ConnectFailed
        for task in (reading, waiting):
            with pytest.raises(loss):
                await task
        assert isinstance(driver.lost.result(), loss)


async def test_driver_whose_peer_never_answered_reports_it_missing() -> None:
    async with conversation(silent) as (driver, peer):
        peer.end.cut()
        lost = await driver.lost
        assert isinstance(lost, EndedUnanswered)
        assert "before it answered" in str(lost)


async def test_rejection_with_a_lost_code_ends_with_the_link() -> None:
    async with conversation(lambda command: b"?" if command == "BGA" else None) as (driver, peer):
        waiting = asyncio.create_task(driver.send("BGA"))
        await elapse(0.1)
        assert peer.commands == ["BGA", "TC1"]
        peer.end.cut()
        with pytest.raises(LinkLost):
            await waiting


async def test_bytes_that_fit_no_request_end_the_link() -> None:
    async with conversation(Box()) as (driver, peer):
        peer.end.write(b":")
        assert isinstance(await driver.lost, UnexpectedReply)


async def test_a_cancelled_request_leaves_the_others_in_order() -> None:
    async with conversation(Box()) as (driver, peer):
        peer.held = True
        first = asyncio.create_task(driver.send("MG 1"))
        second = asyncio.create_task(driver.send("MG 2"))
        await elapse(0.1)
        first.cancel()
        peer.release()
        assert await second == "2"
        with pytest.raises(asyncio.CancelledError):
            await first


async def test_messages_reach_their_listener() -> None:
    async with conversation(Box()) as (driver, peer):
        heard: list[str] = []
        driver.on_message = heard.append
        await driver.subscribe()
        assert peer.commands == ["CW 1", "CF I"]
        peer.end.write(bytes(code | 0x80 for code in b"limit 2\r\n"))
        await driver.send("MG 1")
        assert heard == ["limit 2"]


async def test_a_listener_that_fails_ends_the_link_as_a_defect_of_ours() -> None:
    async with conversation(Box()) as (driver, peer):

        def fail(text: str) -> None:
            raise ZeroDivisionError(text)

        driver.on_message = fail
        peer.end.write(bytes(code | 0x80 for code in b"note\r\n"))
        assert isinstance(await driver.lost, InternalError)
        assert driver._reader is not None
        with pytest.raises(ZeroDivisionError):
            await driver._reader


async def test_a_question_for_the_code_that_is_itself_refused_still_names_the_command() -> None:
    async with conversation(lambda _: b"?") as (driver, _):
        with pytest.raises(CommandRejected, match="'BGA'"):
            await driver.send("BGA")


async def test_writing_on_a_transport_that_ended_loses_the_link() -> None:
    ours, _ = loopback_pair("box")
    driver = await Driver.open(ours, timeout=TIMEOUT)
    await ours.close()
    with pytest.raises(ConnectFailed):
        await driver.send("TP")
    assert isinstance(driver.lost.result(), ConnectFailed)
    await driver.close()
    await driver.close()


async def test_the_tap_sees_both_directions() -> None:
    async with conversation(Box()) as (driver, _):
        seen: list[tuple[str, bytes]] = []
        driver.tap = lambda way, data: seen.append((way, data))
        await driver.send("MG 1")
        assert seen == [("tx", b"MG 1\r"), ("rx", b" 1\r\n:")]


async def test_opening_sends_nothing() -> None:
    async with conversation(Box()) as (_, peer):
        await elapse(10.0)
        assert peer.wire == b""


async def test_close_waits_for_the_replies_under_way() -> None:
    async with conversation(Box()) as (driver, peer):
        peer.held = True
        waiting = asyncio.create_task(driver.send("MG 1"))
        await elapse(0.1)
        closing = asyncio.create_task(driver.close())
        await elapse(0.1)
        with pytest.raises(NotConnected):
            await driver.send("MG 2")
        peer.release()
        await closing
        assert await waiting == "1"
        assert not driver.lost.done()
        with pytest.raises(NotConnected):
            await driver.send("MG 3")


async def test_close_of_a_silent_link_ends_with_the_watchdog() -> None:
    async with conversation(silent) as (driver, _):
        waiting = asyncio.create_task(driver.send("MG 1"))
        await elapse(0.1)
        await driver.close()
        assert isinstance(await outcome(waiting), LinkTimeout)
