from __future__ import annotations

import pytest

from dmc41x3.cli.terminal.completion import WORDS, CompletionNames, candidates, current_mnemonic
from dmc41x3.language.commands import FORMS

NAMES = CompletionNames(labels=("#AUTO", "#HOME"), variables=("count", "speed"), arrays=("table",))


def texts(before: str) -> list[str]:
    return [found.text for found in candidates(before, NAMES)]


@pytest.mark.parametrize(
    ("before", "offered"),
    [
        ("XQ ", ["#AUTO", "#HOME"]),
        ("XQ #H", ["#HOME"]),
        ("x=1;JP #A", ["#AUTO"]),
        ("MG @S", ["@SIN", "@SQR"]),
        ("MG cou", ["count"]),
        ("MG count+ta", ["table"]),
        ("cou", ["count"]),
        ("SP ,sp", ["speed"]),
        ("MG _TP", ["_TPA", "_TPB", "_TPC"]),
        ("MG _TPA;x=_RP", ["_RPA", "_RPB", "_RPC"]),
        (":un", [":unwatch"]),
        (":watch _T", []),
        ('MG "T', []),
        ("' TP", []),
        ("MG _QX", []),
    ],
)
def test_next_candidates(before: str, offered: list[str]) -> None:
    assert texts(before) == offered


def test_a_command_begins_with_any_mnemonic() -> None:
    assert set(texts("B")) == {name for name in FORMS if name.startswith("B")}
    assert "BG" in texts("SHA;b")
    assert "BG" in texts("help B")
    assert "BG" in texts("?B")
    assert texts("BG") == []


def test_operands_are_those_of_the_controller() -> None:
    offered = texts("MG _T")
    assert {"_TP", "_TE", "_TV", "_TT"} <= set(offered)
    assert all(text.startswith("_T") for text in offered)


def test_candidate_replaces_the_typed_part() -> None:
    (found,) = candidates("MG cou", NAMES)
    assert (found.replaces, found.meaning) == (3, "variable")


def test_every_word_of_the_terminal_is_offered() -> None:
    assert texts(":") == list(WORDS)


@pytest.mark.parametrize(
    ("before", "name"),
    [("SPA=5", "SP"), ("SPA=5;TP", "TP"), ("SPA=5; ", ""), ("x=5", ""), ("ENDIF", "ENDIF"), ("S", "")],
)
def test_the_command_under_the_cursor(before: str, name: str) -> None:
    assert current_mnemonic(before) == name
