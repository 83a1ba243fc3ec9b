from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.language.codes import ErrorCode
from dmc41x3.twin.expressions import Rejection
from dmc41x3.twin.memory import LENGTH, MOST_ARRAYS, MOST_ELEMENTS, Arrays

ONE = 65536


def code(act: Callable[[], object]) -> ErrorCode:
    with pytest.raises(Rejection) as refused:
        act()
    return refused.value.code


@pytest.fixture
def arrays() -> Arrays:
    arrays = Arrays()
    arrays.dimension("a", 3)
    return arrays


def test_elements_begin_at_zero_and_keep_their_values(arrays: Arrays) -> None:
    arrays.assign("a", 2, 5)
    assert [arrays.element("a", index) for index in range(3)] == [0, 0, 5]
    assert arrays.element("a", LENGTH) == 3 * ONE


@pytest.mark.parametrize("index", [3, -2, 24000])
def test_an_index_outside(arrays: Arrays, index: int) -> None:
    assert code(lambda: arrays.element("a", index)) is ErrorCode.INDEX_OUT_OF_RANGE
    assert code(lambda: arrays.assign("a", index, 1)) is ErrorCode.INDEX_OUT_OF_RANGE


def test_a_length_is_not_assigned(arrays: Arrays) -> None:
    assert code(lambda: arrays.assign("a", LENGTH, 1)) is ErrorCode.INDEX_OUT_OF_RANGE


def test_an_array_that_is_not_there(arrays: Arrays) -> None:
    assert code(lambda: arrays.element("b", 0)) is ErrorCode.BAD_FUNCTION
    assert code(lambda: arrays.assign("b", 0, 1)) is ErrorCode.UNDEFINED_ARRAY
    assert code(lambda: arrays.row("b")) is ErrorCode.UNDEFINED_ARRAY
    assert code(lambda: arrays.release("b")) is ErrorCode.UNDEFINED_ARRAY


@pytest.mark.parametrize("size", [0, -1, MOST_ELEMENTS + 1])
def test_a_size_that_no_array_has(arrays: Arrays, size: int) -> None:
    assert code(lambda: arrays.dimension("b", size)) is ErrorCode.OUT_OF_RANGE


def test_all_arrays_share_one_memory(arrays: Arrays) -> None:
    assert arrays.free == MOST_ELEMENTS - 3
    arrays.dimension("b", MOST_ELEMENTS - 4)
    assert code(lambda: arrays.dimension("c", 2)) is ErrorCode.ARRAY_SPACE_FULL
    arrays.dimension("c", 1)
    assert arrays.free == 0
    arrays.release("b")
    assert arrays.free == MOST_ELEMENTS - 4


def test_there_is_an_end_to_arrays() -> None:
    arrays = Arrays()
    for number in range(MOST_ARRAYS):
        arrays.dimension(f"a{number}", 1)
    assert code(lambda: arrays.dimension("more", 1)) is ErrorCode.TOO_MANY_VARIABLES
    arrays.dimension("a0", 1)


def test_dimensioned_again(arrays: Arrays) -> None:
    arrays.assign("a", 0, 9)
    arrays.dimension("a", 3)
    assert arrays.element("a", 0) == 9
    assert code(lambda: arrays.dimension("a", 4)) is ErrorCode.VARIABLE_ERROR


@given(st.dictionaries(st.text("abc", min_size=1), st.lists(st.integers(), min_size=1)))
def test_stored_array_is_read_back(contents: dict[str, list[int]]) -> None:
    arrays = Arrays()
    arrays.restore(contents)
    assert list(arrays) == sorted(contents)
    kept = arrays.contents()
    assert kept == contents
    for name in contents:
        arrays.assign(name, 0, 10**6)
    assert kept == contents
