"""Values of _RS."""

from __future__ import annotations

import pytest

from dmc41x3.errors import MemoryDamaged
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


def test_damage_is_an_error_when_soundness_is_required() -> None:
    Burned().require_sound()
    with pytest.raises(MemoryDamaged, match="program, variables"):
        Burned(program=False, variables=False).require_sound()
