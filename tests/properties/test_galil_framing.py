"""The cuts between pieces of bytes make no difference."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.language.record import AxisRecord, DataRecord, PlaneRecord, decode, encode
from dmc41x3.wire.framing import LineSplitter, Message, Received, RecordReply, Reply, ReplyKind, ReplySplitter

u8, u16, u32 = (st.integers(0, 2**bits - 1) for bits in (8, 16, 32))
s8, s32 = st.integers(-128, 127), st.integers(-(2**31), 2**31 - 1)
axes = st.builds(AxisRecord, u16, u8, u8, s32, s32, s32, s32, s32, s32, u16, u8, s32)
planes = st.builds(PlaneRecord, u16, u16, s32, u16)
records = st.builds(
    DataRecord,
    axes=st.lists(axes, min_size=1, max_size=8).map(tuple),
    sample=u16,
    inputs=st.tuples(*[u8] * 10),
    outputs=st.tuples(*[u8] * 10),
    handles=st.tuples(*[s8] * 8),
    error_code=u8,
    threads=u8,
    amplifier_status=u32,
    contour_segment=u32,
    contour_free=u16,
    s=planes,
    t=planes,
)

printable = st.text(st.characters(min_codepoint=32, max_codepoint=126), min_size=1, max_size=12)
lines = printable.filter(lambda text: text[0] not in ":?")
accepted = st.lists(lines, max_size=3).map(lambda texts: Reply(True, "\r\n".join(texts)))
answers = st.lists(
    accepted | st.just(Reply(False)) | records.map(lambda record: RecordReply(encode(record))) | printable.map(Message),
    max_size=6,
)
cuts = st.lists(st.integers(0, 400), max_size=6)
command_lines = st.lists(st.text("ABC 1,=?;'\n", max_size=30), max_size=5)


def pieces(data: bytes, at: Sequence[int]) -> list[bytes]:
    places = sorted({0, len(data), *(place for place in at if place < len(data))})
    return [data[start:end] for start, end in pairwise(places)]


def wire(answer: Received) -> bytes:
    match answer:
        case Reply(ok, text):
            return (f"{text}\r\n:" if text else ":").encode() if ok else b"?"
        case RecordReply(data):
            return data + b":"
        case Message(text):
            return bytes(code | 0x80 for code in f"{text}\r\n".encode())
        case _:
            raise AssertionError(answer)


def splitter_for(expected: list[Received]) -> ReplySplitter:
    splitter = ReplySplitter()
    for answer in expected:
        if not isinstance(answer, Message):
            splitter.expect(ReplyKind.RECORD if isinstance(answer, RecordReply) else ReplyKind.TEXT)
    return splitter


@given(answers, cuts)
def test_replies_are_the_same_however_the_bytes_are_cut(expected: list[Received], at: list[int]) -> None:
    splitter = splitter_for(expected)
    data = b"".join(map(wire, expected))
    assert [answer for piece in pieces(data, at) for answer in splitter.feed(piece)] == expected
    assert splitter.pending == 0


@given(answers)
def test_replies_are_the_same_byte_by_byte(expected: list[Received]) -> None:
    splitter = splitter_for(expected)
    data = b"".join(map(wire, expected))
    assert [answer for byte in data for answer in splitter.feed(bytes([byte]))] == expected


@given(accepted, printable, st.integers(0, 60))
def test_message_may_be_anywhere_in_a_text(reply: Reply, note: str, place: int) -> None:
    data = wire(reply)
    place = min(place, len(data))
    splitter = splitter_for([reply])
    received = splitter.feed(data[:place] + wire(Message(note)) + data[place:])
    assert reply in received
    assert Message(note) in received


@given(command_lines, cuts)
def test_commands_are_the_same_however_the_bytes_are_cut(texts: list[str], at: list[int]) -> None:
    data = "".join(f"{text}\r" for text in texts).encode()
    splitter = LineSplitter()
    assert [command for piece in pieces(data, at) for command in splitter.feed(piece)] == LineSplitter().feed(data)


@given(st.binary(max_size=200))
def test_no_bytes_break_the_controllers_side(data: bytes) -> None:
    splitter = LineSplitter()
    prompts = sum(1 for byte in data if byte & 0x7F in b"\r;")
    assert len(splitter.feed(data)) <= prompts


@given(records)
def test_a_record_survives_the_wire(record: DataRecord) -> None:
    assert decode(encode(record)) == record
