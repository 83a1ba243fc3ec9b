"""The file of what is burned: whole or not at all, and harmless whatever stands in it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from dmc41x3.twin.memory import ChecksumError, Memory
from tests.campaign import Campaign

EVERYTHING = ChecksumError.VARIABLES | ChecksumError.PARAMETERS | ChecksumError.PROGRAM


def filled(path: Path | None) -> Memory:
    memory = Memory(path)
    memory.contents.parameters = {"A": {"SP": 2000.0, "motor_off": True}, "unit": {"CF": "B"}}
    memory.contents.program = "#AUTO\r\nEN\r\n"
    memory.contents.variables = {"x": 65536, "y": -1}
    memory.contents.arrays = {"a": [1, 2, 3]}
    memory.store()
    return memory


def test_stored_memory_is_read_again(tmp_path: Path) -> None:
    path = tmp_path / "memory.json"
    assert Memory(path).contents.parameters is None
    stored = filled(path)
    again = Memory(path)
    assert (again.contents, again.errors) == (stored.contents, 0)
    assert list(tmp_path.iterdir()) == [path]


def test_without_a_path_it_lives_as_long_as_the_object() -> None:
    memory = filled(None)
    memory.load()
    assert memory.contents.variables == {"x": 65536, "y": -1}
    memory.erase()
    assert (memory.contents.parameters, memory.contents.program) == (None, "")


def test_erased_is_as_never_written(tmp_path: Path) -> None:
    path = tmp_path / "memory.json"
    filled(path).erase()
    assert not path.exists()
    assert Memory(path).errors == 0


def _changed(path: Path, change: Any) -> Memory:
    found = json.loads(path.read_text(encoding="utf-8"))
    change(found)
    path.write_text(json.dumps(found), encoding="utf-8")
    return Memory(path)


@pytest.mark.parametrize(
    ("part", "change", "error"),
    [
        ("parameters", {"A": {"SP": 4000.0}}, ChecksumError.PARAMETERS),
        ("program", "#AUTO\r\nMG 1\r\n", ChecksumError.PROGRAM),
        ("variables", {"variables": {"x": 1}, "arrays": {}}, ChecksumError.VARIABLES),
    ],
)
def test_damaged_part_is_empty_and_the_others_are_restored(
    tmp_path: Path, part: str, change: Any, error: ChecksumError
) -> None:
    path = tmp_path / "memory.json"
    whole = filled(path).contents
    memory = _changed(path, lambda found: found[part].update(data=change))
    assert memory.errors == error
    assert (memory.contents.parameters is None) == (part == "parameters")
    assert memory.contents.program == ("" if part == "program" else whole.program)
    assert memory.contents.variables == ({} if part == "variables" else whole.variables)
    assert memory.contents.arrays == ({} if part == "variables" else whole.arrays)


@pytest.mark.parametrize(
    "text", ["", "{", "[]", "null", "7", '{"version": 2}', '{"version": 1}', "\x00" * 10, "[" * 9999]
)
def test_nonsense_is_a_damaged_memory(tmp_path: Path, text: str) -> None:
    path = tmp_path / "memory.json"
    path.write_text(text, encoding="utf-8")
    memory = Memory(path)
    assert memory.errors == EVERYTHING
    assert memory.contents.variables == {}


def test_a_folder_in_its_place_is_a_damaged_memory(tmp_path: Path) -> None:
    assert Memory(tmp_path).errors == EVERYTHING


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=10,
)


@given(VALUES)
@example({"unit": {"TM": 10**400}})
def test_data_of_any_kind_under_a_right_checksum_harms_nothing(data: Any) -> None:
    from dmc41x3.twin.memory import BurnedContents, _checksum, _take

    contents = BurnedContents()
    for part in ("parameters", "program", "variables"):
        _take(contents, part, {"data": data, "checksum": _checksum(data)})
    assert contents.parameters is None or isinstance(contents.parameters, dict)
    assert isinstance(contents.program, str)
    assert isinstance(contents.variables, dict)


def test_a_file_with_one_byte_changed_anywhere_never_raises_and_never_lies(tmp_path: Path, campaign: Campaign) -> None:
    path = tmp_path / "memory.json"
    whole = filled(path).contents
    good = path.read_bytes()
    rng = campaign.rng()
    for _ in range(campaign.size(ci=200, long=5000)):
        damaged = bytearray(good)
        damaged[rng.randrange(len(good))] ^= 1 << rng.randrange(8)
        path.write_bytes(damaged)
        memory = Memory(path)
        if not memory.errors:
            assert memory.contents == whole
