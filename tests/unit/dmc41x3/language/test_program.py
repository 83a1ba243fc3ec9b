"""Programs as bytes, and what splits their answers."""

from __future__ import annotations

import pytest

from dmc41x3.errors import InvalidValue, ProgramDiffers
from dmc41x3.language import transfer
from dmc41x3.wire.framing import LineSplitter, Reply, ReplyKind, ReplySplitter


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ("", ()),
        ("#A\rEN\r", ("#A", "EN")),
        ("#A\r\nEN", ("#A", "EN")),
        ("#A\nEN\n", ("#A", "EN")),
        ("\n", ("",)),
        ("#A\n\nEN\n", ("#A", "", "EN")),
        (" x=1 ;' a comment \r", (" x=1 ;' a comment ",)),
    ],
)
def test_lines_of_a_program(text: str, lines: tuple[str, ...]) -> None:
    assert transfer.program_lines(text) == lines


@pytest.mark.parametrize(
    ("lines", "key"),
    [
        (["x" * 81], "line 0"),
        (["#A", 'MG "ñ"'], "line 1"),
        (["a\\b"], "line 0"),
        (["a\tb"], "line 0"),
        (["#A"] * 4001, "program"),
    ],
)
def test_invalid_program_is_refused_before_it_is_sent(lines: list[str], key: str) -> None:
    with pytest.raises(InvalidValue) as caught:
        transfer.require_loadable(lines)
    assert caught.value.details["key"] == key


def test_a_full_memory_of_full_lines_is_loadable() -> None:
    transfer.require_loadable(["x" * 80] * 4000)


def test_probe_is_a_program_if_downloads_are_accepted() -> None:
    splitter = LineSplitter()
    taken: list[str] = []
    for command in splitter.split(transfer.PROBE):
        taken.append(command)
        splitter.program = splitter.program or command == "DL"
    assert taken == ["DL", "'", "\\", "", "TC1"]


def test_probe_is_a_comment_if_downloads_are_refused() -> None:
    assert LineSplitter().feed(transfer.PROBE) == ["DL", "'\\", "TC1"]


def test_bytes_of_a_download() -> None:
    assert transfer.program_download(["#A", "MG 1;EN"]) == b"DL\r#A\rMG 1;EN\r\\TC1\r"


def test_lines_that_are_to_stay_are_not_sent_again() -> None:
    assert transfer.program_download(["#A", "EN", "#B", "EN"], 2) == b"DL 2\r#B\rEN\r\\TC1\r"
    assert transfer.download_probe(2) == b"DL #\r'\\\rTC1\r"
    assert transfer.download_probe(0) == transfer.PROBE


@pytest.mark.parametrize(
    ("sent", "found", "line"),
    [
        (["#A", "EN"], ["#A", "AB"], 1),
        (["#A", "EN"], ["#A"], 1),
        (["#A"], ["#A", "EN"], 1),
        (["#A"], ["#A "], 0),
    ],
)
def test_the_first_difference_is_named(sent: list[str], found: list[str], line: int) -> None:
    with pytest.raises(ProgramDiffers) as caught:
        transfer.require_same_lines(sent, found)
    assert caught.value.details["line"] == line


def replies(kinds: list[ReplyKind], data: bytes, cut: int) -> list[object]:
    splitter = ReplySplitter()
    for kind in kinds:
        splitter.expect(kind)
    return [item for piece in (data[:cut], data[cut:]) for item in splitter.feed(piece)]


@pytest.mark.parametrize(
    ("kind", "data", "reply"),
    [
        (ReplyKind.TRANSFER, b":: 0\r\n:", Reply(True, " 0")),
        (ReplyKind.TRANSFER, b"::: 0\r\n:", Reply(True, " 0")),
        (ReplyKind.TRANSFER, b"?:17 words: many\r\n:", Reply(False, "17 words: many")),
        (ReplyKind.TRANSFER, b"??::60 words\r\n:", Reply(False, "60 words")),
        (ReplyKind.TRANSFER, b" 0\r\n:", Reply(True, " 0")),
        (ReplyKind.LISTING, b"#A\r\n:odd\r\nEN\r\n\x1a:", Reply(True, "#A\r\n:odd\r\nEN\r\n")),
        (ReplyKind.LISTING, b"\x1a:", Reply(True, "")),
        (ReplyKind.LISTING, b":\r\n\x1a:", Reply(True, ":\r\n")),
        (ReplyKind.LISTING, b"?", Reply(False)),
    ],
)
def test_answers_of_transfers_wherever_they_are_cut(kind: ReplyKind, data: bytes, reply: Reply) -> None:
    for cut in range(len(data) + 1):
        assert replies([kind, ReplyKind.TEXT], data + b" 5\r\n:", cut) == [reply, Reply(True, " 5")]
