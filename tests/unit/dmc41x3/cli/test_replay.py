from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from dmc41x3.cli.recording import AnswerDifference, compared
from dmc41x3.wire.transcript import WirePiece, header
from tests.unit.dmc41x3.cli.bench import benched

Run = Callable[[Sequence[str]], int]

SESSION = [
    WirePiece(0.0, 1, "client", event="open"),
    WirePiece(0.1, 1, "client", b"SHA;PRA=25000;SPA=25000;BGA\r"),
    WirePiece(0.1, 1, "controller", b"::::"),
    WirePiece(0.6, 1, "client", b"MG _BGA\r"),
    WirePiece(0.6, 1, "controller", b" 1.0000\r\n:"),
    WirePiece(5.0, 1, "client", b"MG _BGA;TPA\r"),
    WirePiece(5.0, 1, "controller", b" 0.0000\r\n: 24990\r\n:"),
    WirePiece(6.0, 1, "client", event="end"),
]


async def replayed(pieces: list[WirePiece], tolerance: float = 50.0) -> list[AnswerDifference]:
    async with benched() as bench:
        return (await compared(bench.dial, pieces, tolerance)).differences


async def test_a_client_that_keeps_its_pace_meets_the_same_motion() -> None:
    assert await replayed(SESSION) == []
    assert asyncio.get_running_loop().time() == pytest.approx(6.0, abs=0.1)


async def test_a_tolerance_may_be_narrower() -> None:
    assert await replayed(SESSION, 5.0) == [AnswerDifference(5.0, 1, "TPA", "' 24990' became ' 25000'")]


async def test_different_answers_are_shown_with_their_time() -> None:
    other = [piece._replace(data=piece.data.replace(b" 1.0000", b" 0.0000")) for piece in SESSION]
    assert await replayed(other) == [AnswerDifference(0.6, 1, "MG _BGA", "' 0.0000' became ' 1.0000'")]


async def test_connections_are_kept_separate() -> None:
    pieces = [
        WirePiece(0.0, 1, "client", b"WH\r"),
        WirePiece(0.0, 1, "controller", b"IHA\r\n:"),
        WirePiece(0.1, 2, "client", b"WH;x=1\r"),
        WirePiece(0.1, 2, "controller", b"IHB\r\n::"),
        WirePiece(0.2, 1, "client", b"MG x\r"),
        WirePiece(0.2, 1, "controller", b" 2.0000\r\n:"),
    ]
    assert await replayed(pieces) == [AnswerDifference(0.2, 1, "MG x", "' 2.0000' became ' 1.0000'")]


async def test_a_program_is_loaded_as_it_was() -> None:
    pieces = [
        WirePiece(0.0, 1, "client", b"DL\r#A\rx=1;y=2\rEN\r\\"),
        WirePiece(0.0, 1, "controller", b"::"),
        WirePiece(0.1, 1, "client", b"XQ #A\r"),
        WirePiece(0.1, 1, "controller", b":"),
        WirePiece(0.2, 1, "client", b"MG y\r"),
        WirePiece(0.2, 1, "controller", b" 2.0000\r\n:"),
        WirePiece(0.3, 1, "client", b"UL\r"),
        WirePiece(0.3, 1, "controller", b"#A\r\nx=1;y=2\r\nEN\r\n\x1a:"),
    ]
    assert await replayed(pieces) == []


async def test_silence_is_an_answer_that_lacks_and_not_the_end() -> None:
    pieces = [
        WirePiece(0.0, 1, "client", b"IHS=>-2\r"),
        WirePiece(0.0, 1, "controller", b":"),
        WirePiece(0.5, 1, "client", b"TP\r"),
        WirePiece(0.5, 1, "controller", b" 0, 0, 0\r\n:"),
    ]
    (last,) = (found for found in await replayed(pieces) if found.command == "TP")
    assert last.how == "' 0, 0, 0' became no answer"


@pytest.mark.parametrize(
    ("answer", "code", "last"),
    [
        (" 0, 0, 0", 0, "1 commands; 0 answers differ from the recording."),
        (" 0, 900, 0", 1, "1 commands; 1 answers differ from the recording."),
    ],
)
def test_the_exit_code_says_whether_anything_differs(
    run: Run, answer: str, code: int, last: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "w.jsonl"
    pieces = [WirePiece(1000.0, 1, "client", b"TP\r"), WirePiece(1000.0, 1, "controller", f"{answer}\r\n:".encode())]
    file.write_text("\n".join([header("sim"), *(piece.line() for piece in pieces)]) + "\n", encoding="utf-8")
    assert run(["replay", str(file)]) == code  # virtual time: a thousand seconds take none
    assert capsys.readouterr().out.splitlines()[-1] == last
