"""The parser of a command line: built for the command that the line names, with all commands otherwise."""

from __future__ import annotations

import pytest
import typer

from dmc41x3.cli.parsing import parser

app = typer.Typer()
tools = typer.Typer()
app.add_typer(tools, name="tools")


@app.command()
def first_one() -> int:
    return 1


@app.command("other")
def second() -> int:
    return 2


@tools.command()
def hammer() -> int:
    return 3


@pytest.mark.parametrize("name", ["first-one", "other", "tools"])
def test_parser_holds_the_named_command_alone(name: str) -> None:
    assert set(parser(app, name).commands) == {name}


@pytest.mark.parametrize("name", ["", "second", "first_one", "hammer", "--help"])
def test_parser_holds_all_commands_where_none_is_named(name: str) -> None:
    assert set(parser(app, name).commands) == {"first-one", "other", "tools"}
    assert parser(app, name) is parser(app, "")
