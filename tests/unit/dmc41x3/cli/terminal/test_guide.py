from __future__ import annotations

import pytest

from dmc41x3.cli.terminal import completion
from dmc41x3.language.commands import FORMS


def test_every_command_is_explained() -> None:
    assert [name for name in FORMS if completion.entry(name) is None] == []
    assert all(entry.purpose for entry in completion.entries())


def test_unknown_command_has_no_entry() -> None:
    assert completion.entry("QX") is None
    assert completion.entry("@SIN") is None
    assert completion.entry("") is None


def test_page_shows_the_syntax_and_the_default() -> None:
    first, second = completion.page("sp").splitlines()
    assert first.startswith("SP  ")
    assert second.strip() == "SP ABC, SP 1,2,3 or SPA=1; default 25000; operand _SP"


@pytest.mark.parametrize(
    ("name", "fact"), [("AM", "in a program only"), ("DL", "not in a program"), ("LI", "LI"), ("@SIN", "sine")]
)
def test_page_shows_the_allowed_places_of_a_name(name: str, fact: str) -> None:
    assert fact in completion.page(name)


@pytest.mark.parametrize(
    ("name", "fact"), [("_LFA", "1 while the forward switch is free"), ("_lr", "reverse switch"), ("_TPB", "TP  ")]
)
def test_operands_are_explained_with_their_axis_and_without(name: str, fact: str) -> None:
    assert fact in completion.page(name)


def test_unknown_operand_has_no_page() -> None:
    assert "_QX is no command" in completion.page("_QX")
    assert "_ is no command" in completion.page("_")


def test_commands_without_an_operand_are_not_listed_as_one() -> None:
    names = {entry.name for entry in completion.operands()}
    assert {"TP", "BG", "XQ", "BN"} <= names
    assert not {"SH", "MG", "WT"} & names
    assert "operand" not in completion.page("SH")


def test_help_on_the_terminal_fits_a_small_screen() -> None:
    lines = completion.OVERVIEW.splitlines()
    assert max(map(len, lines)) <= 80
    assert len(lines) <= 16
