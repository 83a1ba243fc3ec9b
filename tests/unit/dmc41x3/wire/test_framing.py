from __future__ import annotations

import pytest

from dmc41x3.conformance import load
from dmc41x3.conformance.runner import literal
from dmc41x3.language.commands import TOO_LONG, split_line
from dmc41x3.language.record import AxisRecord, DataRecord, encode
from dmc41x3.wire.framing import LineSplitter, Message, RecordReply, Reply, ReplyKind, ReplySplitter, Stray

RECORD = encode(DataRecord(axes=(AxisRecord(),) * 3))


def exchanges() -> list[tuple[str, str]]:
    """Return what the conformance table has sent and received where nothing is left open and every CR ends a line."""
    return [
        (step.send, step.expect[0])
        for vector in load()
        for step in vector.steps
        if step.special is None and step.send.endswith("\r") and "DL" not in step.send and literal(step.expect[0])
    ]


def printed(reply: Reply) -> str:
    """Return a reply as it stands on the wire."""
    if not reply.ok:
        return "?"
    return reply.text + ("\r\n:" if reply.text and reply.text[-1] != "\x1a" else ":")


def marked(text: str) -> bytes:
    return bytes(code | 0x80 for code in text.encode("ascii"))


def replies(*kinds: ReplyKind, data: bytes) -> list[object]:
    splitter = ReplySplitter()
    for kind in kinds:
        splitter.expect(kind)
    return list(splitter.feed(data))


@pytest.mark.parametrize(
    ("data", "commands"),
    [
        (b"TP\r", ["TP"]),
        (b"TP\r\n", ["TP"]),
        (b"TP\n\r", ["TP"]),
        (b"\r", [""]),
        (b"TP;\r", ["TP", ""]),
        (b"A;B\r", ["A", "B"]),
        (b"A;", ["A"]),
        (b"TP", []),
        (b"\x12\x16\r", ["\x12\x16"]),
        (b"\xd4\xd0\x8d", ["TP"]),
        (b"' x;y\rTP\r", ["' x;y", "TP"]),
    ],
)
def test_commands_of_bytes(data: bytes, commands: list[str]) -> None:
    assert LineSplitter().feed(data) == commands


@pytest.mark.parametrize(("length", "fits"), [(80, True), (81, False), (500, False)])
def test_a_line_holds_80_characters(length: int, fits: bool) -> None:
    splitter = LineSplitter()
    assert splitter.feed(b"x" * length + b"\rTP\r") == [("x" * length) if fits else TOO_LONG, "TP"]


def test_the_commands_of_a_line_count_together() -> None:
    line = b"MG 1;" * 20
    assert LineSplitter().feed(line + b"\r") == ["MG 1"] * 16 + [TOO_LONG] * 5


def test_a_client_that_never_sends_cr_is_not_cut_off() -> None:
    splitter = LineSplitter()
    assert [splitter.feed(b"MG 1;") for _ in range(40)] == [["MG 1"]] * 40


def test_an_endless_line_is_not_kept() -> None:
    splitter = LineSplitter()
    for _ in range(1000):
        assert splitter.feed(b"x" * 1000) == []
    assert splitter.feed(b"\r") == [TOO_LONG]


@pytest.mark.parametrize("end", ["\\", "\x04", "\x11", "\x1a"])
def test_program_end_reads_as_a_backslash(end: str) -> None:
    splitter = LineSplitter()
    splitter.program = True
    assert splitter.feed(f"#A;BGA\rEN{end}WH\r".encode()) == ["#A;BGA", "EN", "\\", "WH"]
    assert not splitter.program


def test_a_program_is_taken_by_lines_until_its_backslash() -> None:
    splitter = LineSplitter()
    taken: list[str] = []
    for text in splitter.split(b"DL\r#A;x=1\r\n  EN\\TP\r"):
        taken.append(text)
        if text == "DL":
            splitter.program = True
    assert taken == ["DL", "#A;x=1", "  EN", "\\", "TP"]


def test_a_longer_line_may_be_allowed_until_the_backslash() -> None:
    splitter = LineSplitter()
    splitter.program, splitter.limit = True, 1000
    numbers = ",".join("7" * 90)
    assert splitter.feed(f"{numbers}\r{numbers}\\".encode()) == [numbers, numbers, "\\"]
    assert splitter.feed(f"{numbers}\r".encode()) == [TOO_LONG]


def test_golden_exchanges_are_one_reply_a_command() -> None:
    found = exchanges()
    assert len(found) > 300
    for send, receive in found:
        sent = LineSplitter().feed(send.encode("ascii"))
        if not receive or len(send) > 80 or "{N}" in send:
            continue  # data of a download, a line too long, or a reply whose end cannot be found
        received = replies(*[ReplyKind.TEXT] * len(sent), data=receive.encode("ascii"))
        assert "".join(printed(reply) for reply in received if isinstance(reply, Reply)) == receive, send
        assert len(received) == len(sent), send


def test_golden_lines_are_split_alike_by_both_sides() -> None:
    for send, _ in exchanges():
        if len(send) <= 80 and "\n" not in send:
            lines = send[:-1].split("\r")
            assert LineSplitter().feed(send.encode("ascii")) == [one for line in lines for one in split_line(line)]


def test_colon_inside_a_text_is_no_prompt() -> None:
    assert replies(ReplyKind.TEXT, data=b"at 12:30: ok\r\n:") == [Reply(True, "at 12:30: ok")]


def test_a_record_may_hold_prompts() -> None:
    data = bytearray(RECORD)
    data[82:] = b":" * len(data[82:])
    assert replies(ReplyKind.RECORD, ReplyKind.TEXT, data=bytes(data) + b"::") == [
        RecordReply(bytes(data)),
        Reply(True),
    ]


def test_a_record_can_be_rejected() -> None:
    assert replies(ReplyKind.RECORD, ReplyKind.TEXT, data=b"?:") == [Reply(False), Reply(True)]


@pytest.mark.parametrize(
    "data",
    [
        b":",
        RECORD[:2] + b"\xff\xff" + RECORD[4:],
        RECORD + b"x",
    ],
)
def test_incomplete_record_is_stray(data: bytes) -> None:
    (received,) = replies(ReplyKind.RECORD, data=data.ljust(4, b"\0"))
    assert isinstance(received, Stray)


def test_unrequested_bytes_are_stray() -> None:
    assert replies(data=b":") == [Stray(b":")]


def test_messages_are_taken_out_from_anywhere() -> None:
    note = marked("limit\r\n")
    data = note + b" 20" + note[:3] + b"0\r" + note[3:] + b"\n:" + note + RECORD + b":" + note
    assert replies(ReplyKind.TEXT, ReplyKind.RECORD, data=data) == [
        Message("limit"),
        Message("limit"),
        Reply(True, " 200"),
        Message("limit"),
        RecordReply(RECORD),
        Message("limit"),
    ]


def test_pending_counts_unanswered_commands() -> None:
    splitter = ReplySplitter()
    splitter.expect()
    splitter.expect()
    splitter.feed(b":")
    assert splitter.pending == 1
