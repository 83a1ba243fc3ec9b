"""Commands that only read, sent to a virtual controller in motion: nothing changes."""

from __future__ import annotations

import pytest

from dmc41x3.language.catalogue import CATALOGUE, Arguments, EntryKind
from dmc41x3.language.reading import QUERIES, REPORTS, only_reads
from tests.unit.dmc41x3.twin.bench import Bench

COMMANDS = [*sorted(REPORTS), *(f"{name} ?" for name in sorted(QUERIES)), "MG _TPA", "MG TIME", "speed=?", "path[1]=?"]


def moving() -> Bench:
    """Axis A jogs, B is in a sequence with C, and there are variables and an array."""
    bench = Bench()
    bench.do("speed=3", "DM path[3]", "JGA=-2048;BGA", "LMBC;LI ,5000,4000;LE;BGS", "KPB=7")
    return bench.at(0.5)


def known(bench: Bench) -> dict[str, str]:
    """Return the values of all operands, variables and arrays, and the program."""
    found = {text: bench.say(text) for text in ("LV", "LA", "LL", "TH")}
    for entry in CATALOGUE.values():
        if entry.kind in {EntryKind.COMMAND, EntryKind.KEYWORD} and entry.name.isupper() and len(entry.name) == 2:
            for axis in ("A", "B", "C") if entry.arguments is Arguments.AXES else ("",):
                operand = f"_{entry.name}{axis}"
                found[operand] = bench.say(f"MG {operand}")
    return found


@pytest.mark.parametrize("command", COMMANDS)
def test_reading_command_is_answered_and_changes_nothing(command: str) -> None:
    assert only_reads(command)
    asked, untouched = moving(), moving()
    assert asked.say(command).endswith(":")
    assert known(asked) == known(untouched)
    asked.at(2.0)
    untouched.at(2.0)
    assert asked.say("TP") == untouched.say("TP")
    assert asked.say("SC") == untouched.say("SC")
