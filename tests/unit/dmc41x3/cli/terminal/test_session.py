from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path

import pytest

from dmc41x3.cli.terminal.session import RETRY, TerminalSession
from dmc41x3.cli.terminal.words import carry_out
from dmc41x3.driver import Driver
from dmc41x3.language.record import AxisRecord, DataRecord, encode
from dmc41x3.wire.emergency import StopOutcome
from dmc41x3.wire.transport import LoopbackTransport, Transport, loopback_pair
from tests.unit.dmc41x3.cli.bench import Heard, benched, say, talking
from tests.unit.dmc41x3.scripted import Peer
from tests.virtual_time import elapse

MESSAGE = '#A\nMG "hello"\nEN\n'


async def test_greeting_names_the_controller() -> None:
    async with talking() as (_, heard, _bench):
        assert heard.said == [("note", "DMC4133 Rev 1.3k at bench")]


async def test_answers_are_printed_unchanged_and_in_order() -> None:
    async with talking() as (session, heard, _):
        await say(session, "x=5;MG x*2;TP", "", "MG -1", "^R^V")
        assert heard.all("answer") == [":", " 10.0000", " 0, 0, 0", "-1.0000", "DMC4133 Rev 1.3k"]
        assert session.waiting == 0


async def test_a_refusal_has_code_and_words_and_does_not_end_the_line() -> None:
    async with talking() as (session, heard, _):
        await say(session, "MOA;BGA;MG 7")
        assert heard.said[1:] == [
            ("answer", ":"),
            ("refused", "? 20 Begin not valid with motor off"),
            ("answer", " 7.0000"),
        ]
        assert session.refused


@pytest.mark.parametrize(("command", "hinted"), [("bga", True), ("BGQ", False), ("zz", False)])
async def test_lowercase_commands_are_explained(command: str, hinted: bool) -> None:
    async with talking() as (session, heard, _):
        await say(session, command)
        assert ("capitals: BG" in heard.all("refused")[0]) is hinted


@pytest.mark.parametrize("command", ["DL", "DL #A", "ED", "QD a[]", 'MG "x"{N}'])
async def test_line_that_would_swallow_later_answers_is_not_sent(command: str) -> None:
    async with talking() as (session, heard, _):
        await say(session, command, "MG 1")
        assert heard.said[-2][0] == "trouble"
        assert heard.said[-2][1].startswith(f"Not sent: {command}: ")
        assert heard.last == ("answer", " 1.0000")


async def test_a_record_is_a_table() -> None:
    async with talking() as (session, heard, _):
        await say(session, "DP 7,-8,9", "QR")
        lines = heard.last[1].splitlines()
        assert [line.split()[:2] for line in lines[1:]] == [["A", "7"], ["B", "-8"], ["C", "9"]]


async def test_names_are_learned_from_answers() -> None:
    async with talking() as (session, _, _bench):
        await say(session, "speed=5")
        assert session.names.variables == ("speed",)
        await say(session, "speed=?", "DM table[4]")
        assert session.names.arrays == ("table",)
        await say(session, "DA speed")
        assert session.names.variables == ()
        assert session.names.axes == "ABC"


async def test_messages_of_programs_are_shown() -> None:
    async with talking() as (session, heard, _):
        await session.link.driver.download(MESSAGE)
        await say(session, "XQ #A")
        await elapse(0.1)
        assert heard.all("message") == ["hello"]


async def test_the_panel_follows_and_watches() -> None:
    async with talking() as (session, _, _bench):
        await say(session, ":watch _TPA*2", ":watch nothing", "PRA=1000;BGA")
        await elapse(2.0)
        assert session.record is not None
        assert session.record.axes[0].position == 1000
        assert session.watched == {"_TPA*2": "2000.0000", "nothing": session.watched["nothing"]}
        assert session.watched["nothing"].startswith("?")
        assert session.silence <= 0.2
        await say(session, ":unwatch _TPA*2", ":unwatch")
        assert session.watched == {}


async def test_refused_expression_is_retried_at_intervals() -> None:
    async with talking() as (session, _, _bench):
        await say(session, ":watch later")
        await elapse(0.5)
        assert session.watched["later"].startswith("?")
        await say(session, "later=3")
        await elapse(0.2 * (RETRY + 1))
        assert session.watched == {"later": "3.0000"}


async def test_a_hidden_panel_asks_for_nothing() -> None:
    async with talking() as (session, _, _bench):
        sent: list[bytes] = []
        await say(session, ":panel")
        session.link.driver.tap = lambda _, data: sent.append(data)
        await elapse(5.0)
        assert sent == []


async def test_stop_brakes_moving_axes_and_leaves_programs() -> None:
    async with talking() as (session, heard, bench):
        await session.link.driver.download("#A\nWT 60000\nEN\n")
        await say(session, "XQ #A", "JGA=5000;JGC=-5000;BGAC")
        await elapse(1.0)
        await say(session, ":stop")
        assert heard.all("note")[-2:] == [
            "Stopping A, C.",
            "Programs still run (thread 0) and may move again; HX ends them.",
        ]
        await elapse(1.0)
        assert not any(axis.moving for axis in bench.controller.machine.unit.axes)
        assert await session.link.driver.value("_XQ0") >= 0.0


async def test_stop_without_motion_is_reported() -> None:
    async with talking() as (session, heard, _):
        await say(session, ":stop")
        assert heard.last == ("note", "Nothing moves.")


async def test_a_sequence_is_stopped_on_its_path() -> None:
    async with talking() as (session, heard, _):
        await say(session, "LM AB;LI 20000,10000;LE;VS 5000;BGS")
        await elapse(1.0)
        await say(session, ":stop")
        assert heard.last == ("note", "Stopping A, B.")
        await elapse(2.0)
        a = await session.link.driver.value("_TPA")
        b = await session.link.driver.value("_TPB")
        assert 0.0 < a < 20000.0
        assert a == pytest.approx(2.0 * b, abs=2.0)


async def test_lost_link_is_reported_once_and_reconnected() -> None:
    async with talking() as (session, heard, bench):
        bench.controller.cut()
        await elapse(0.5)
        assert not session.link.up
        assert [text.partition(":")[0] for text in heard.all("trouble")] == ["LINK LOST"]
        await say(session, "TP")
        assert heard.last[1].startswith("Not sent: TP.")
        await say(session, ":reconnect", "MG 1")
        assert heard.last == ("answer", " 1.0000")
        assert session.trouble == ""


async def test_absent_controller_does_not_end_the_session() -> None:
    async with talking() as (session, heard, bench):
        bench.controller.cut()
        bench.away = True
        await elapse(0.5)
        await say(session, ":reconnect")
        assert "nobody there" in heard.last[1]
        bench.away = False
        await say(session, ":reconnect")
        assert session.link.up


async def test_connecting_twice_at_once_leaves_one_link() -> None:
    async with talking() as (session, _, bench):
        await asyncio.gather(session.reconnect(), session.reconnect())
        await say(session, "MG 1")
        assert session.link.up
        await elapse(0.1)
        assert len(bench.controller.connections) == 1


async def test_a_stop_without_a_link_does_not_pretend() -> None:
    async with talking() as (session, heard, bench):
        bench.controller.cut()
        await elapse(0.5)
        await say(session, ":stop")
        assert heard.last[0] == "trouble"
        assert heard.last[1].startswith("NOT STOPPED")


async def test_a_stop_without_a_link_goes_past_it() -> None:
    async with benched() as bench:
        heard = Heard()
        session = TerminalSession(bench.dial, "bench", heard, lambda: StopOutcome("", "AC"))
        await session.connect()
        bench.controller.cut()
        await elapse(0.5)
        await session.stop()
        assert heard.last == ("note", "Stopping A, C.")
        await session.close()


async def test_messages_of_other_ports_are_left_until_requested() -> None:
    async with benched() as bench:
        other = await Driver.open(await bench.dial(), timeout=5.0)
        await other.subscribe()
        heard = Heard()
        session = TerminalSession(bench.dial, "bench", heard)
        await session.connect()
        assert "`:messages`" in heard.last[1]
        assert await session.link.driver.value("_CF") == ord("A")
        await session.link.take_messages()
        assert await session.link.driver.value("_CF") == ord("B")
        await session.close()
        assert await other.value("_CF") == ord("A")
        await other.close()


async def test_messages_go_to_no_former_receiver_that_has_left() -> None:
    async with benched() as bench:
        other = await Driver.open(await bench.dial(), timeout=5.0)
        await other.subscribe()
        session = TerminalSession(bench.dial, "bench", Heard())
        await session.connect()
        await session.link.take_messages()
        await other.close()
        await elapse(0.1)
        await session.close()
        third = await Driver.open(await bench.dial(), timeout=5.0)
        assert [await third.value("_CF"), await third.value("_CW")] == [ord("S"), 1.0]
        await third.close()


@pytest.mark.parametrize("again", [False, True])
async def test_taken_settings_are_given_back(*, again: bool) -> None:
    async with benched() as bench:
        session = TerminalSession(bench.dial, "bench", Heard())
        await session.connect()
        if again:
            await session.link.take_messages()
        other = await Driver.open(await bench.dial(), timeout=5.0)
        assert [await other.value("_CF"), await other.value("_CW")] == [ord("A"), 1.0]
        await session.close()
        assert [await other.value("_CF"), await other.value("_CW")] == [ord("S"), 2.0]
        await other.close()


class Slow:
    """A controller that answers the first questions of a terminal, and then falls silent on request."""

    def __init__(self) -> None:
        self.peers: list[Peer] = []
        self.tasks: list[asyncio.Task[None]] = []

    async def dial(self) -> Transport:
        ours, theirs = loopback_pair("slow")
        peer = Peer(theirs, _answers())
        self.peers.append(peer)
        self.tasks.append(asyncio.create_task(peer.run()))
        return ours

    @property
    def end(self) -> LoopbackTransport:
        return self.peers[-1].end


def _answers() -> Callable[[str], bytes]:
    record = encode(DataRecord((AxisRecord(), AxisRecord(), AxisRecord()))) + b":"

    def answer(command: str) -> bytes:
        if command == "QR":
            return record
        return b" 83.0000\r\n:" if command.startswith(("MG", "L", "\x12")) else b":"

    return answer


async def test_slow_controller_blocks_neither_typing_nor_stopping() -> None:
    slow, heard = Slow(), Heard()
    session = TerminalSession(slow.dial, "slow", heard)
    await session.connect()
    work = asyncio.create_task(session.work(carry_out))
    peer = slow.peers[-1]
    peer.held = True
    session.enter("BN")
    session.enter("TP")
    await elapse(1.0)
    assert session.waiting == 2
    assert peer.commands[-1] == "BN"
    session.enter(":stop")
    await elapse(0.1)
    assert peer.commands[-3:] == ["ST S", "ST T", "QR"]  # on the wire, though nothing has been answered
    peer.release()
    await session.settled()
    assert heard.all("answer") == [":", ":"]
    work.cancel()
    await asyncio.wait({work})
    await session.close()
    await asyncio.wait(slow.tasks)


async def test_lines_wait_on_request() -> None:
    async with talking() as (session, heard, _):
        before = asyncio.get_running_loop().time()
        await say(session, ":wait 2.5", "MG 1")
        assert asyncio.get_running_loop().time() - before == pytest.approx(2.5, abs=0.01)
        assert heard.last == ("answer", " 1.0000")


async def test_upload_without_a_file_shows_the_program(tmp_path: Path) -> None:
    file = tmp_path / "a.dmc"
    file.write_text(MESSAGE, encoding="ascii")
    async with talking() as (session, heard, _):
        await say(session, f":download {file}", ":upload")
        assert heard.said[-2:] == [
            ("note", f"Downloaded: 3 lines from {file}"),
            ("answer", MESSAGE.rstrip("\n")),
        ]
        assert session.names.labels == ("#A",)


async def test_recording_is_made_during_lines(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    async with talking() as (session, heard, _):
        session.enter(f":scope _TPA --rate 10 --for 1 --csv {file}")
        session.enter("MG 1")
        await elapse(0.1)
        assert heard.last == ("answer", " 1.0000")
        await session.settled()
        assert heard.last == ("note", f"11 samples, 10.0 a second: {file}")
        assert len(file.read_text(encoding="utf-8").splitlines()) == 12


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (":nonsense", "There is no ':nonsense'"),
        (":watch", "needs an expression"),
        (":wait long", "0 to 3600"),
        (":wait -1", "0 to 3600"),
        (":unwatch _TPA", "There is no '_TPA'. Known: none"),
        (":download /nowhere/x.dmc", "Reading /nowhere/x.dmc failed: No such file"),
        (":upload /nowhere/x.dmc", "Writing /nowhere/x.dmc failed: No such file"),
        (":scope", "CHANNELS"),
        (":scope _TPA", "--csv FILE or --png FILE"),
        (":scope _TPA --rate fast --csv a", "CHANNELS"),
        (":scope _TPA --colour red --csv a", "There is no '--colour'"),
        (":scope nothing --csv a", "refused"),
    ],
)
async def test_impossible_request_is_one_sentence(line: str, words: str) -> None:
    async with talking() as (session, heard, _):
        await say(session, line)
        assert heard.last[0] == "trouble"
        assert words in heard.last[1]


@pytest.mark.parametrize(
    ("line", "begins"), [("help BG", "BG  "), ("?bg", "BG  "), ("? SH", "SH  "), (":help TP", "TP  ")]
)
async def test_help_on_a_command(line: str, begins: str) -> None:
    async with talking() as (session, heard, _):
        await say(session, line)
        assert heard.last[0] == "note"
        assert heard.last[1].startswith(begins)


@pytest.mark.parametrize("line", ["help", "?", ":help"])
async def test_help_on_the_terminal(line: str) -> None:
    async with talking() as (session, heard, _):
        await say(session, line)
        assert "F12 stops all motion" in heard.last[1]


async def test_help_on_an_unknown_command() -> None:
    async with talking() as (session, heard, _):
        await say(session, "help QX")
        assert heard.last[1].startswith("QX is no command")
