from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from maya_un.cli.dmc_tools.replay import Difference, compared
from maya_un.cli.main import main
from maya_un.galil.transcript import Piece, header
from tests.unit.cli.dmc_tools.bench import benched

SESSION = [
    Piece(0.0, 1, "client", event="open"),
    Piece(0.1, 1, "client", b"SHA;PRA=25000;SPA=25000;BGA\r"),
    Piece(0.1, 1, "controller", b"::::"),
    Piece(0.6, 1, "client", b"MG _BGA\r"),
    Piece(0.6, 1, "controller", b" 1.0000\r\n:"),
    Piece(5.0, 1, "client", b"MG _BGA;TPA\r"),
    Piece(5.0, 1, "controller", b" 0.0000\r\n: 24990\r\n:"),
    Piece(6.0, 1, "client", event="end"),
]


async def replayed(pieces: list[Piece], tolerance: float = 50.0) -> list[Difference]:
    async with benched() as bench:
        return (await compared(bench.dial, pieces, tolerance)).differences


async def test_a_client_that_keeps_its_pace_meets_the_same_motion() -> None:
    assert await replayed(SESSION) == []
    assert asyncio.get_running_loop().time() == pytest.approx(6.0, abs=0.1)


async def test_a_tolerance_may_be_narrower() -> None:
    assert await replayed(SESSION, 5.0) == [Difference(5.0, 1, "TPA", "' 24990' became ' 25000'")]


async def test_answers_that_differ_are_told_with_their_time() -> None:
    other = [piece._replace(data=piece.data.replace(b" 1.0000", b" 0.0000")) for piece in SESSION]
    assert await replayed(other) == [Difference(0.6, 1, "MG _BGA", "' 0.0000' became ' 1.0000'")]


async def test_connections_are_kept_apart() -> None:
    pieces = [
        Piece(0.0, 1, "client", b"WH\r"),
        Piece(0.0, 1, "controller", b"IHA\r\n:"),
        Piece(0.1, 2, "client", b"WH;x=1\r"),
        Piece(0.1, 2, "controller", b"IHB\r\n::"),
        Piece(0.2, 1, "client", b"MG x\r"),
        Piece(0.2, 1, "controller", b" 2.0000\r\n:"),
    ]
    assert await replayed(pieces) == [Difference(0.2, 1, "MG x", "' 2.0000' became ' 1.0000'")]


async def test_a_program_is_loaded_as_it_was() -> None:
    pieces = [
        Piece(0.0, 1, "client", b"DL\r#A\rx=1;y=2\rEN\r\\"),
        Piece(0.0, 1, "controller", b"::"),
        Piece(0.1, 1, "client", b"XQ #A\r"),
        Piece(0.1, 1, "controller", b":"),
        Piece(0.2, 1, "client", b"MG y\r"),
        Piece(0.2, 1, "controller", b" 2.0000\r\n:"),
        Piece(0.3, 1, "client", b"UL\r"),
        Piece(0.3, 1, "controller", b"#A\r\nx=1;y=2\r\nEN\r\n\x1a:"),
    ]
    assert await replayed(pieces) == []


async def test_silence_is_an_answer_that_lacks_and_not_the_end() -> None:
    pieces = [
        Piece(0.0, 1, "client", b"IHS=>-2\r"),
        Piece(0.0, 1, "controller", b":"),
        Piece(0.5, 1, "client", b"TP\r"),
        Piece(0.5, 1, "controller", b" 0, 0, 0\r\n:"),
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
    answer: str, code: int, last: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "w.jsonl"
    pieces = [Piece(1000.0, 1, "client", b"TP\r"), Piece(1000.0, 1, "controller", f"{answer}\r\n:".encode())]
    file.write_text("\n".join([header("sim"), *(piece.line() for piece in pieces)]) + "\n", encoding="utf-8")
    assert main(["dmc", "replay", str(file)]) == code  # virtual time: a thousand seconds take none
    assert capsys.readouterr().out.splitlines()[-1] == last
