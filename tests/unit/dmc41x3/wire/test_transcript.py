from __future__ import annotations

import json
from dataclasses import replace

import hypothesis.strategies as st
import pytest
from hypothesis import given

from dmc41x3.language.record import AxisRecord, AxisStatus, DataRecord, encode
from dmc41x3.wire.framing import RecordReply, Reply
from dmc41x3.wire.transcript import ConnectionTranscript, Side, WirePiece, conversations, difference, header, read

RECORD = DataRecord((AxisRecord(position=1000, reference=1000), AxisRecord(), AxisRecord()), sample=5)
times = st.integers(0, 10**9).map(lambda micros: micros / 1e6)
sides = st.sampled_from(("client", "controller"))
pieces = st.tuples(times, st.integers(1, 9), sides, st.binary(min_size=1)).map(lambda fields: WirePiece(*fields))


def recorded(record: DataRecord) -> RecordReply:
    return RecordReply(encode(record))


@given(st.lists(pieces))
def test_written_recording_is_read_back(written: list[WirePiece]) -> None:
    text = [header("10.0.0.5:23"), *(piece.line() for piece in written)]
    assert read(f"{line}\n" for line in text) == written


def test_line_follows_the_format() -> None:
    assert json.loads(WirePiece(0.0125, 1, "client", b"TP\r").line()) == {
        "t": 0.0125,
        "link": 1,
        "from": "client",
        "data": "TP\r",
    }
    assert json.loads(WirePiece(1.0, 2, "controller", event="end").line())["event"] == "end"
    assert json.loads(WirePiece(0.0, 1, "controller", b"\x87\xff").line())["data"] == "\x87\xff"


@pytest.mark.parametrize(
    "lines",
    [
        [],
        ["nonsense\n"],
        ['{"format": "other", "version": 1}\n'],
        ['{"format": "maya-dmc-capture", "version": 2}\n'],
        [header("x") + "\n", "[]\n", "\n"],
        [header("x") + "\n", '{"t": 0, "link": 1, "from": "nobody", "data": "x"}\n'],
        [header("x") + "\n", '{"t": 0, "link": 1, "from": "client", "data": "\\u20ac"}\n'],
        [header("x") + "\n", '{"t": NaN, "link": 1, "from": "client", "data": "x"}\n'],
        [header("x") + "\n", '{"t": -1, "link": 1, "from": "client", "data": "x"}\n'],
        [header("x") + "\n", '{"t": 0, "link": 1e999, "from": "client", "data": "x"}\n'],
        [header("x") + "\n", 100_000 * "[" + "\n"],
        [100_000 * "[" + "\n"],
        [header("x") + "\n", '{"t": 0, "lin', '{"t": 0, "link": 1, "from": "client", "data": "x"}\n'],
    ],
)
def test_invalid_recording_is_refused(lines: list[str]) -> None:
    with pytest.raises(ValueError, match=r"version 1|line 2"):
        read(lines)


def test_a_last_line_cut_short_is_passed_over() -> None:
    whole = WirePiece(0.0, 1, "client", b"TP\r")
    assert read([header("x") + "\n", whole.line() + "\n", '{"t": 0.5, "li']) == [whole]


def exchanges(*said: tuple[Side, bytes]) -> list[tuple[str, Reply | RecordReply | None]]:
    found = conversations(WirePiece(0.0, 1, side, data) for side, data in said)[1]
    return [(exchange.command, exchange.reply) for exchange in found.exchanges]


def test_commands_find_their_answers_wherever_the_pieces_are_cut() -> None:
    assert exchanges(
        ("client", b"TP;SH"),
        ("controller", b" 1, 2, 3\r"),
        ("client", b"A\rBG"),
        ("controller", b"\n::"),
        ("client", b"Q\rMG 1"),
        ("controller", b"?"),
    ) == [("TP", Reply(True, " 1, 2, 3")), ("SHA", Reply(True)), ("BGQ", Reply(False))]


def test_a_record_is_one_answer() -> None:
    data = encode(RECORD)
    said: list[tuple[Side, bytes]] = [("client", b"QR\rTP\r"), ("controller", data + b": 1\r\n:")]
    assert exchanges(*said) == [("QR", RecordReply(data)), ("TP", Reply(True, " 1"))]


def test_text_of_a_program_is_no_command() -> None:
    said: list[tuple[Side, bytes]] = [("client", b"DL\r#A\rTP;SHA\rEN\r\\MG 1\r"), ("controller", b":: 1.0000\r\n:")]
    assert exchanges(*said) == [("DL", Reply(True)), ("\\", Reply(True)), ("MG 1", Reply(True, " 1.0000"))]


def test_messages_are_separate_and_strays_end_the_pairing() -> None:
    conversation = ConnectionTranscript()
    conversation.said(b"TP\r", 0.0)
    conversation.heard(bytes(byte | 0x80 for byte in b"hello\r\n") + b" 1\r\n:")
    assert conversation.messages == ["hello"]
    assert conversation.complete
    conversation.heard(b"what?")
    conversation.heard(b"more")
    assert conversation.stray == b"what?more"


@pytest.mark.parametrize(
    ("command", "before", "after", "same"),
    [
        ("TP", " 100, 200, 300", " 149, 151, 300", True),
        ("TP", " 100, 200, 300", " 151, 200, 300", False),
        ("MG _TPA", " 100.0000", " 130.0000", True),
        ("MG _BGA", " 0.0000", " 1.0000", False),
        ("MG TIME", " 5.0000", " 123456.0000", True),
        ("TVA", " 0", "-25000", True),
        ("SPA=?", " 25000", " 25002", False),
        ("x=?", " 1.0000", " 1.0000", True),
        ("\x12\x16", "DMC4143 Rev 1.3a", "DMC4133 Rev 1.3k", True),
        ("ID", "FW, DMC4143 Rev 1.3a", "FW, DMC4133 Rev 1.3k", True),
        ("WH", "IHA", "IHB", True),
        ("MG _BN", " 291.0000", " 41330.0000", True),
        ("TC1", "1 Unrecognized command", "1 Unrecognized command", True),
        ("TC1", "1 Unrecognized command", "6 Number out of range", False),
        ("TP", " 1, 2, 3", " 1, 2", False),
        ("QZ", " 3, 52, 26, 36", " 4, 52, 26, 36", False),
    ],
)
def test_numbers_may_differ_between_runs(command: str, before: str, after: str, same: bool) -> None:
    how = difference(command, Reply(True, before), Reply(True, after), 50.0)
    assert how == ("" if same else f"{before!r} became {after!r}")


def test_a_prompt_is_never_a_question_mark() -> None:
    assert difference("SHA", Reply(True), Reply(False), 50.0) == "':' became '?'"
    assert difference("TP", Reply(True, " 1"), None, 50.0) == "' 1' became no answer"
    assert difference("TP", None, None, 50.0) == ""
    assert difference("QR", Reply(False), recorded(RECORD), 50.0) == "'?' became a record of 190 bytes"


@pytest.mark.parametrize(
    ("axis", "how"),
    [
        ({"position": 1050, "velocity_raw": 99, "torque_raw": 5, "error": -50}, ""),
        ({"position": 1051}, "A position 1000 became 1051"),
        ({"stop_code": 4}, "A stop_code 0 became 4"),
        ({"status": AxisStatus.MOVING | AxisStatus.SLEWING}, "A status 0x0000 became 0x8020"),
        ({"status": AxisStatus.SLEWING}, ""),
    ],
)
def test_records_are_compared_by_meaning(axis: dict[str, int], how: str) -> None:
    after = replace(RECORD, axes=(replace(RECORD.axes[0], **axis), *RECORD.axes[1:]), sample=9999)
    assert difference("QR", recorded(RECORD), recorded(after), 50.0) == how


def test_records_of_other_controllers_differ() -> None:
    fewer = replace(RECORD, axes=RECORD.axes[:2])
    assert difference("QR", recorded(RECORD), recorded(fewer), 50.0) == "3 axes became 2"
    assert difference("QR", recorded(RECORD), recorded(replace(RECORD, error_code=6)), 50.0) == "error_code 0 became 6"
    assert difference("QR", RecordReply(b"short"), RecordReply(b"longer"), 50.0) == "5 bytes became 6"
