"""The program in memory: downloads byte for byte, labels, listings, the line editor, what may not happen meanwhile."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.language.codes import ErrorCode
from dmc41x3.twin.expressions import Rejection
from dmc41x3.twin.program import Draft, Program, label_of, statements
from tests.unit.dmc41x3.twin.program_bench import ProgramBench

LINES = st.lists(
    st.text(alphabet=st.characters(min_codepoint=0x20, max_codepoint=0x7E, exclude_characters="\\#"), max_size=80),
    max_size=20,
)


@given(LINES, st.sampled_from(["\r", "\r\n"]))
def test_an_upload_is_the_download(lines: list[str], end: str) -> None:
    bench = ProgramBench()
    assert bench.raw(f"DL{end}" + "".join(line + end for line in lines) + "\\") == b"::"
    uploaded = "".join(f"{line}\r\n" for line in lines) or "\r\n"
    assert bench.raw("UL\r") == uploaded.encode() + b"\x1a:"


@given(LINES, st.integers(1, 40))
def test_download_may_be_cut_anywhere(lines: list[str], size: int) -> None:
    bench = ProgramBench()
    data = "DL\r" + "".join(f"{line}\r\n" for line in lines) + "\\"
    replies = [bench.raw(data[place : place + size]) for place in range(0, len(data), size)]
    assert b"".join(replies) == b"::"
    assert replies[-1].endswith(b":")
    assert bench.program() == ([] if lines == [""] else lines)


def test_the_controller_is_silent_until_the_end() -> None:
    bench = ProgramBench()
    assert bench.raw("DL\r") == b""
    assert bench.raw("#A;MG 1\rBGA;ST;TP\r") == b""
    assert bench.raw("EN\r\\") == b"::"
    assert bench.say("WH") == "IHA\r\n:"


@pytest.mark.parametrize("end", ["\\", "\x1a", "\x11", "\x04"])
def test_download_ends(end: str) -> None:
    bench = ProgramBench()
    assert bench.raw(f"DL\rEN{end}") == b"::"
    assert bench.program() == ["EN"]


def test_line_end_after_the_backslash_is_a_separate_command() -> None:
    assert ProgramBench().raw("DL\rEN\r\\\r") == b":::"


def test_comments_blanks_and_empty_lines_are_kept() -> None:
    lines = ["'a comment; and more", "", "  MG 1  ", "NO x", "#A;MG 2;'said", ""]
    bench = ProgramBench()
    assert bench.raw("DL\r" + "".join(f"{line}\r" for line in lines) + "\\") == b"::"
    assert bench.raw("UL\r") == b"'a comment; and more\r\n\r\n  MG 1  \r\nNO x\r\n#A;MG 2;'said\r\n\r\n\x1a:"


@pytest.mark.parametrize(
    ("lines", "code"),
    [
        (["M" * 81], ErrorCode.DOWNLOAD_ERROR),
        (["#A", "#B", "#A"], ErrorCode.BAD_LABEL),
        (["#TOOLONG8"], ErrorCode.BAD_LABEL),
        (["#"], ErrorCode.BAD_LABEL),
        (["#1A"], ErrorCode.BAD_LABEL),
        (["#A-B"], ErrorCode.BAD_LABEL),
        ([f"#L{number}" for number in range(511)], ErrorCode.TOO_MANY_LABELS),
        ([""] * 4000, ErrorCode.DOWNLOAD_ERROR),
    ],
)
def test_a_bad_line_is_refused_and_no_half_program_stays(lines: list[str], code: ErrorCode) -> None:
    bench = ProgramBench("EN")
    assert bench.raw("DL\r" + "".join(f"{line}\r" for line in lines) + "EN\r\\") == b"?::"
    assert bench.say("TC") == f" {code}\r\n:"
    assert bench.program() == []
    assert bench.code("XQ") == ErrorCode.UNDEFINED_LABEL


def test_the_most_that_fits() -> None:
    bench = ProgramBench()
    bench.download("\n".join([*(f"#L{number}" for number in range(510)), *["'" * 80] * 3490]))
    assert len(bench.program()) == 4000
    assert bench.value("_DL") == 0.0


@pytest.mark.parametrize(
    ("how", "expected"),
    [
        ("DL", ["NEW"]),
        ("DL 0", ["NEW"]),
        ("DL 1", ["#A", "NEW"]),
        ("DL #B", ["#A", "MG 1", "NEW"]),
        ("DL #", ["#A", "MG 1", "#B", "EN", "NEW"]),
        ("DL #B+1", ["#A", "MG 1", "#B", "NEW"]),
        ("DL 4", ["#A", "MG 1", "#B", "EN", "NEW"]),
    ],
)
def test_download_may_keep_the_lines_before_it(how: str, expected: list[str]) -> None:
    bench = ProgramBench("#A\nMG 1\n#B\nEN")
    bench.download("NEW", how)
    assert bench.program() == expected


def test_a_bad_line_behind_the_program_leaves_the_program() -> None:
    bench = ProgramBench("#A\nEN")
    assert bench.raw("DL #\r#A\rMG 1\r\\") == b"?::"
    assert bench.program() == ["#A", "EN"]


@pytest.mark.parametrize(
    ("command", "code"),
    [
        ("DL #NOPE", ErrorCode.UNDEFINED_LABEL),
        ("DL 5", ErrorCode.INVALID_LABEL),
        ("DL -1", ErrorCode.INVALID_LABEL),
        ("ED 5", ErrorCode.INVALID_LABEL),
        ("LS #NOPE", ErrorCode.UNDEFINED_LABEL),
        ("LS 3,1", ErrorCode.OUT_OF_RANGE),
        ("BP 1", ErrorCode.OPERAND_ERROR),
    ],
)
def test_misuse_has_its_code(command: str, code: ErrorCode) -> None:
    assert ProgramBench("#A\nMG 1\n#B\nEN").code(command) == code


@pytest.mark.parametrize("command", ["DL", "DL #", "ED", "ED 0", "BN", "BP"])
def test_running_program_forbids_commands(command: str) -> None:
    bench = ProgramBench("#A\nWT 1000;JP #A")
    bench.do("XQ #A,3")
    assert bench.code(command) == ErrorCode.NOT_WHILE_PROGRAM_RUNS
    bench.do("HX 3")
    assert bench.say(command) in (":", "")


def test_a_program_that_was_started_during_a_download_is_not_replaced_under_way() -> None:
    bench = ProgramBench("#A\nWT 1000;JP #A")
    other = bench.connect()
    assert bench.raw("DL #\rEN\r") == b""
    assert bench.machine.receive(other, b"XQ\r", bench.now) == b":"
    assert bench.raw("\\") == b"?"
    assert bench.program() == ["#A", "WT 1000;JP #A"]


def test_lists() -> None:
    bench = ProgramBench("#B;MG 1\n#A\nEN")
    assert bench.say("LS") == "0 #B;MG 1\r\n1 #A\r\n2 EN\r\n:"
    assert bench.say("LS 1,1") == "1 #A\r\n:"
    assert bench.say("LS #A") == "1 #A\r\n2 EN\r\n:"
    assert bench.say("LS 7") == ":"
    assert bench.say("LL") == "#A=1\r\n#B=0\r\n:"
    assert bench.value("_DL") == 508.0


def test_the_line_editor_replaces_lines_in_their_place() -> None:
    bench = ProgramBench("#A\nMG 1\nMG 2\nEN")
    assert bench.raw("ED 1\rMG 11\rMG 22\r\x11") == b"::"
    assert bench.program() == ["#A", "MG 11", "MG 22", "EN"]
    assert bench.raw("ED\rMG 33\rEN\r\x11") == b"::"
    assert bench.program() == ["#A", "MG 11", "MG 22", "MG 33", "EN"]
    assert bench.raw("ED 1\r#A\r\x11") == b"?::"
    assert bench.say("TC") == f" {int(ErrorCode.BAD_LABEL)}\r\n:"
    assert bench.program() == ["#A", "MG 11", "MG 22", "MG 33", "EN"]


def test_a_reset_brings_the_burned_program_back() -> None:
    bench = ProgramBench("#A\nEN")
    bench.do("BP")
    bench.download("#B\nEN")
    bench.raw("RS\r")
    bench.handle = bench.connect()
    assert bench.program() == ["#A", "EN"]


def test_reset_forgets_unburned_settings() -> None:
    bench = ProgramBench("#A\nEN")
    bench.raw("RS\r")
    bench.handle = bench.connect()
    assert bench.program() == []


@pytest.mark.parametrize(
    ("line", "label"),
    [
        ("#A", "A"),
        ("#A;MG 1", "A"),
        ("#A 'why", "A"),
        ("#LIMSWI", "LIMSWI"),
        ("#T_1;EN", "T_1"),
        ("#ABCDEFGH", None),
        (" #A", None),
        ("#a+1", None),
        ("A", None),
    ],
)
def test_labels(line: str, label: str | None) -> None:
    assert label_of(line) == label


@pytest.mark.parametrize(
    ("line", "parts"),
    [
        ("", []),
        ("#A", []),
        ("#A;MG 1", ["MG 1"]),
        ("#A MG 1", ["MG 1"]),
        ("MG 1;MG 2", ["MG 1", "MG 2"]),
        (" MG 1 ; ; MG 2 ;", ["MG 1", "MG 2"]),
        ('MG "a;b";EN', ['MG "a;b"', "EN"]),
        ('MG "it\'s";EN', ['MG "it\'s"', "EN"]),
        ("MG 1;'all; of it", ["MG 1"]),
        ("MG 1 'said; once", ["MG 1"]),
        ("'#A", []),
        ('MG "open;EN', ['MG "open;EN']),
    ],
)
def test_statements(line: str, parts: list[str]) -> None:
    assert statements(line) == parts


@given(LINES)
def test_a_text_loaded_is_the_text(lines: list[str]) -> None:
    program = Program()
    text = "".join(f"{line}\r\n" for line in lines)
    program.load(text)
    assert program.text() == text
    program.load(text.replace("\r\n", "\n"))
    assert program.text() == text


def test_a_bad_text_is_not_loaded() -> None:
    program = Program()
    program.load("#A\r\nEN\r\n")
    with pytest.raises(Rejection):
        program.load("#A\r\n#A\r\n")
    assert program.text() == "#A\r\nEN\r\n"


def test_a_line_behind_the_last_statement_starts_behind_it() -> None:
    program = Program()
    program.load("#A\nMG 1\n\nMG 2;EN\n'end\n")
    assert [program.start(line) for line in range(5)] == [0, 0, 1, 1, 3]
    with pytest.raises(Rejection):
        program.start(5)


def test_a_draft_counts_labels_and_lines() -> None:
    draft = Draft(["#A", "EN"])
    draft.append("#B")
    assert draft.labels == {"A": 0, "B": 2}
