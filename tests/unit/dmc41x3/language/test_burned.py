"""Values of _RS."""

from __future__ import annotations

import pytest

from dmc41x3.language.codes import Burned


@pytest.mark.parametrize(
    ("bits", "damaged"),
    [
        (0, ()),
        (1, ("variables",)),
        (2, ("parameters",)),
        (4, ("program",)),
        (8, ("master reset",)),
        (7, ("parameters", "program", "variables")),
    ],
)
def test_each_bit_is_a_memory(bits: int, damaged: tuple[str, ...]) -> None:
    assert Burned.of(bits).damaged == damaged
