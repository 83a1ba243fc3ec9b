"""The twin's arithmetic against a second interpreter: both must come to the same number, or both refuse."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from random import Random

import pytest

from dmc41x3.twin.context import OperandScope
from dmc41x3.twin.expressions import Rejection, evaluate
from tests.campaign import Campaign
from tests.second_interpreter import ARRAY, AXIS_VARIABLE, OUTPUTS, SERIES, STEP, VARIABLES, VOLTS, second
from tests.unit.dmc41x3.twin.bench import Bench


class Writer:
    """Makes up expressions."""

    def __init__(self, rng: Random) -> None:
        self.rng = rng

    def expression(self, depth: int) -> str:
        parts = [self.term(depth)]
        for _ in range(self.rng.choice((0, 1, 1, 1, 2, 3))):
            parts += [self.rng.choice("+-*/%&|=<>") + self.rng.choice(("", "", "", "=", ">")), self.term(depth)]
            # Not every pair of characters is an operator; the misspelled ones are for the refusals.
            if parts[-2] not in ("<=", ">=", "<>"):
                parts[-2] = parts[-2][0]
        return self.rng.choice(("", "", "", " ")).join(parts)

    def term(self, depth: int) -> str:
        if depth <= 0 or self.rng.random() < 0.4:
            return self.leaf()
        inner = self.expression(depth - 1)
        kind = self.rng.randrange(8)
        if kind < 3:
            return f"({inner})"
        if kind == 3:
            return f"-{self.term(depth - 1)}"
        if kind == 4:
            return f"arr[{self.rng.choice((inner, '0', '3', '-1', '1.9', '4'))}]"
        if kind == 5:
            return f"@{self.rng.choice(('IN', 'OUT', 'AN'))}[{self.rng.choice((inner, '1', '2', '8', '81', '9'))}]"
        return f"@{self.rng.choice(('ABS', 'INT', 'FRAC', 'RND', 'COM', 'FLOT', 'REAL'))}[{inner}]"

    def leaf(self) -> str:
        rng = self.rng
        small = (0, 1, 2, 3, 7, 10, 90, 1000)
        kinds: list[Callable[[], str]] = [
            lambda: str(rng.choice(small)),
            lambda: str(rng.choice((*small, rng.randrange(2**31), rng.randrange(3 * 10**9)))),
            lambda: f"{rng.choice(('', '0', rng.randrange(1000), rng.randrange(2**31)))}.{rng.randrange(10**6)}",
            lambda: f"-{rng.choice((rng.randrange(2**31), 2**31))}",
            lambda: f"${rng.randrange(16 ** rng.randrange(1, 9)):X}{rng.choice(('', f'.{rng.randrange(65536):04X}'))}",
            lambda: f'"{"".join(rng.choices("abcXY Z(1", k=rng.randrange(1, 7)))}"',
            lambda: rng.choice(("_SPA", "_SP~a", "_BV", "~a")),
            lambda: rng.choice(tuple(VARIABLES)),
            lambda: rng.choice(tuple(VARIABLES)),
        ]
        return rng.choice(kinds)()

    def spoiled(self, text: str) -> str:
        """Change, drop or insert a character or two."""
        for _ in range(self.rng.choice((1, 1, 2))):
            place = self.rng.randrange(len(text) + 1)
            new = self.rng.choice(("", *'0123456789ABFabv+-*/%&|=<>()[]"@_$.~^?,{ #!'))
            text = text[:place] + new + text[place + self.rng.randrange(2) :]
        return text


@pytest.fixture(scope="module")
def names() -> OperandScope:
    """A controller on which the same things are defined."""
    bench = Bench()
    bench.do("DM arr[4]", "SPC=1000", f"~a={AXIS_VARIABLE}", *(f"SB {bit}" for bit in OUTPUTS))
    unit = bench.machine.unit
    unit.variables.update({name: int(value * 65536) for name, value in VARIABLES.items()})
    unit.arrays.row("arr")[:] = [int(value * 65536) for value in ARRAY]
    for number, value in VOLTS.items():
        unit.analog[number - 1] = float(value)
    return OperandScope(unit)


def twin(text: str, names: OperandScope) -> Fraction | None:
    try:
        return Fraction(evaluate(text, names), 65536)
    except Rejection:
        return None


def test_both_interpreters_compute_the_same_number(campaign: Campaign, names: OperandScope) -> None:
    writer = Writer(campaign.rng())
    refused = 0
    size = campaign.size(ci=5_000, long=100_000)
    for _ in range(size):
        text = writer.expression(3)
        expected, _ = second(text)
        refused += expected is None
        assert twin(text, names) == expected, text
    assert 0.1 < refused / size < 0.6


def test_both_interpreters_refuse_the_same_texts(campaign: Campaign, names: OperandScope) -> None:
    writer = Writer(campaign.rng())
    accepted = 0
    size = campaign.size(ci=5_000, long=100_000)
    for _ in range(size):
        text = writer.spoiled(writer.expression(1))
        expected, reader = second(text)
        accepted += expected is not None
        got = twin(text, names)
        if not reader.foreign:
            assert (got == expected) if reader.exact else (got is None) == (expected is None), text
    assert 0.1 < accepted / size < 0.9


def test_both_interpreters_agree_on_angles_and_roots(campaign: Campaign, names: OperandScope) -> None:
    rng = campaign.rng()
    writer = Writer(rng)
    for _ in range(campaign.size(ci=2_000, long=40_000)):
        inner = rng.choice(
            (
                writer.expression(1),
                f"{rng.uniform(-1.1, 1.1):.6f}",
                f"{rng.uniform(-800, 800):.5f}",
                f"{rng.choice((-270, -90, 90, 270, 450))}+(tiny*{rng.randrange(-3, 4)})",
                str(30 * rng.randrange(-30, 30)),
            )
        )
        text = f"@{rng.choice(tuple(SERIES))}[{inner}]"
        expected, _ = second(text)
        got = twin(text, names)
        assert (got is None) == (expected is None), text
        assert got is None or expected is None or abs(got - expected) <= STEP, text


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("@SIN[30]", Fraction(1, 2)),
        ("@TAN[45]", Fraction(1)),
        ("@ACOS[-1]", Fraction(180)),
        ("@ATAN[1]", Fraction(45)),
        ("@SQR[-2]", Fraction(92682, 65536)),
        ("1+2*3", Fraction(9)),
        ("-7%3", Fraction(-1)),
        ("2147483647+1", Fraction(-(2**31))),
        ("@FLOT[-1.5]", Fraction(-1077936128)),
        ("@REAL[$3FC00000]", Fraction(3, 2)),
        ('"A"', Fraction(0x41 * 2**24)),
    ],
)
def test_the_second_interpreter_itself(text: str, value: Fraction) -> None:
    assert second(text)[0] == value
