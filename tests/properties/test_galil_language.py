"""The language reads back what it writes: numbers, commands, lines."""

from __future__ import annotations

from fractions import Fraction

from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.language import numbers
from dmc41x3.language.commands import (
    ASSIGN,
    CONTROL,
    FORMS,
    QUERY,
    SKIPPED,
    ArgumentForm,
    Command,
    Expression,
    parse,
    split_line,
)
from dmc41x3.wire.framing import LineSplitter

raws = st.integers(numbers.RAW_MIN, numbers.RAW_MAX)
literals = st.integers(-(2**31), 2**31) | st.floats(-1e10, 1e10, allow_nan=False)
expressions = st.sampled_from(
    ["_TPA", "target", "speed[0]", "$FF", "(a+1)*2", "f[a,b]", "@ABS[x]", "x+y", '"a,b"'],
).map(Expression)
values = literals | expressions
fields = (
    st.lists(values | st.just(SKIPPED) | st.just(QUERY), min_size=1, max_size=8)
    .map(tuple)
    .filter(lambda args: args != (SKIPPED,))
)
masks = st.text("ABCDEFGHMNST", min_size=1, max_size=8) | st.just("*")
letters = st.sampled_from([*"ABCDEFGHST*", "~a"])
modifiers = st.none() | values.filter(lambda value: not isinstance(value, Expression) or "<" not in value.text)
names = st.from_regex(r"[a-z][a-z0-9]{0,7}(\[[a-z0-9]{1,3}\])?", fullmatch=True)
words = st.sampled_from(['"text",_TPA', "#AUTO,0", "a[],0,2,1", "1", "A", "T=>-3", "_TPA,_TPB", "*"])


def mnemonics(form: ArgumentForm) -> st.SearchStrategy[str]:
    return st.sampled_from([name for name, its in FORMS.items() if its is form])


axes_commands = (
    st.builds(Command, mnemonics(ArgumentForm.AXES), masks)
    | st.builds(Command, mnemonics(ArgumentForm.AXES), st.just(""), fields)
    | st.builds(Command, mnemonics(ArgumentForm.AXES), letters, fields)
)
segments = st.builds(Command, st.sampled_from(["LI", "VP", "CR"]), st.just(""), fields, modifiers, modifiers)
others = (
    st.builds(Command, st.sampled_from(sorted(FORMS)))
    | st.builds(Command, st.sampled_from(sorted(CONTROL)))
    | st.builds(Command, mnemonics(ArgumentForm.PLAIN), st.just(""), fields)
    | st.builds(Command, mnemonics(ArgumentForm.VERBATIM), text=words)
    | st.builds(Command, st.just(ASSIGN), text=names, args=st.tuples(values | st.just(QUERY)))
)
commands = axes_commands | segments | others


@given(commands)
def test_a_command_reads_back_as_written(command: Command) -> None:
    assert parse(command.format()) == command


@given(commands)
def test_the_blank_behind_the_letters_means_nothing(command: Command) -> None:
    text = command.format()
    if text[:2] in FORMS and text[2:3] == " ":
        assert parse(f"{text[:2]}  {text[3:]}") == command


@given(st.lists(segments | axes_commands, min_size=1, max_size=5))
def test_a_line_of_commands_reads_back_as_written(line: list[Command]) -> None:
    assert [parse(text) for text in split_line(";".join(command.format() for command in line))] == line


@given(st.text("AB;' x=", max_size=40))
def test_both_splits_of_a_line_agree(line: str) -> None:
    assert LineSplitter().feed(line.encode() + b"\r") == split_line(line)


@given(raws)
def test_hexadecimal_print_is_exact(raw: int) -> None:
    assert numbers.parse_fixed(numbers.format_value(Fraction(raw, 65536), 8, 4, hex=True)) == raw


@given(raws)
def test_a_printed_value_is_nearest_to_its_number(raw: int) -> None:
    printed = Fraction(numbers.format_value(Fraction(raw, 65536)).strip())
    assert abs(printed - Fraction(raw, 65536)) <= Fraction(1, 10_000)


@given(st.lists(st.integers(-(2**31), 2**31 - 1), min_size=1, max_size=8))
def test_positions_of_several_axes_read_back(counts: list[int]) -> None:
    reply = numbers.join_positions(numbers.format_value(count, 10, 0) for count in counts)
    assert [numbers.parse_number(number) for number in reply.split(",")] == counts
