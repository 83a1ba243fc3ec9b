"""Downloads of the tools: refused while a program runs; a former program that cannot be restored is reported."""

from __future__ import annotations

import pytest

from dmc41x3.cli.program import load
from dmc41x3.errors import CommandRejected, ProgramLost, ProgramRuns
from tests.unit.dmc41x3.cli.bench import driven

FORMER = "#A\nx=1\nEN"
INVALID = "#A\nEN\n#A\nEN"
"""The controller refuses a label that is there twice."""


async def test_a_refused_program_is_replaced_by_the_former_one() -> None:
    async with driven() as driver:
        await load(driver, FORMER)
        with pytest.raises(CommandRejected, match="Duplicate"):
            await load(driver, INVALID)
        assert (await driver.upload()).split() == FORMER.split()


async def test_a_running_program_is_not_replaced() -> None:
    async with driven() as driver:
        await load(driver, "#A\nJP #A\nEN")
        await driver.send("XQ #A")
        with pytest.raises(ProgramRuns):
            await load(driver, FORMER)


async def test_a_locked_program_that_cannot_be_restored_is_reported_as_lost() -> None:
    async with driven() as driver:
        await load(driver, FORMER)
        await driver.send("PW secret,secret")
        await driver.send("\x0c\x0bsecret,1")
        with pytest.raises(ProgramLost, match="could not be restored"):
            await load(driver, INVALID)
