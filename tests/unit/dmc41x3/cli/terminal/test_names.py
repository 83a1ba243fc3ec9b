from __future__ import annotations

import pytest

from dmc41x3.cli.terminal.completion import CompletionNames, ask, assigned
from tests.unit.dmc41x3.cli.bench import driven
from tests.unit.dmc41x3.scripted import conversation


async def test_the_controller_lists_its_names() -> None:
    async with driven() as driver:
        await driver.download("#B\nEN\n#A\nEN\n")
        await driver.batch(["y=1", "x=2", "DM ring[8]"])
        assert await ask(driver, "AB") == CompletionNames(("#A", "#B"), ("x", "y"), ("ring",), "AB")


async def test_refused_or_empty_lists_are_no_names() -> None:
    async with conversation(lambda command: b" 1 no\r\n:" if command == "TC1" else b"?") as (driver, _):
        assert await ask(driver, "ABC") == CompletionNames()


@pytest.mark.parametrize(
    ("command", "name"),
    [("x=5", "x"), ("count = count+1", "count"), ("x=?", None), ("x=", None), ("a[0]=1", None), ("MG x", None)],
)
def test_an_assignment_makes_a_name(command: str, name: str | None) -> None:
    assert assigned(command) == name


def test_a_name_is_kept_once_and_in_order() -> None:
    assert CompletionNames(variables=("b",)).with_variable("a").with_variable("b").variables == ("a", "b")
