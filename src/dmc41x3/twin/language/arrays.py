"""Arrays of the controller: named rows of numbers that share one memory (DM, DA)."""

from __future__ import annotations

from collections.abc import Iterator

from dmc41x3.language.codes import ErrorCode
from dmc41x3.twin.refusal import Rejection

MOST_ELEMENTS = 24_000
"""Elements of all arrays together (DM, from firmware 1.2a on)."""

MOST_ARRAYS = 30

LENGTH = -1
"""Index under which an array tells its length."""


class Arrays:
    """The arrays by name; elements are raw fixed point."""

    def __init__(self) -> None:
        self._rows: dict[str, list[int]] = {}

    def __contains__(self, name: str) -> bool:
        return name in self._rows

    def __iter__(self) -> Iterator[str]:
        return iter(sorted(self._rows))

    def __len__(self) -> int:
        return len(self._rows)

    @property
    def free(self) -> int:
        """How many elements can still be dimensioned (`_DM`)."""
        return MOST_ELEMENTS - sum(map(len, self._rows.values()))

    def dimension(self, name: str, size: int) -> None:
        """Make an array of zeros.

        Raises `Rejection`: 6 for a size below 1 or above the memory, 66 where too little is left, 67 for one array too
        many, 9 for an array of another size under this name. To dimension one again as it is changes nothing, so that
        a program can be started twice; what a real box does then is not documented.
        """
        if not 1 <= size <= MOST_ELEMENTS:
            raise Rejection(ErrorCode.OUT_OF_RANGE)
        present = self._rows.get(name)
        if present is not None:
            if len(present) != size:
                raise Rejection(ErrorCode.VARIABLE_ERROR)
            return
        if len(self._rows) >= MOST_ARRAYS:
            raise Rejection(ErrorCode.TOO_MANY_VARIABLES)
        if size > self.free:
            raise Rejection(ErrorCode.ARRAY_SPACE_FULL)
        self._rows[name] = [0] * size

    def row(self, name: str) -> list[int]:
        """Return the elements of an array, to be used in place; raises `Rejection` (82) for an unknown one."""
        try:
            return self._rows[name]
        except KeyError:
            raise Rejection(ErrorCode.UNDEFINED_ARRAY) from None

    def element(self, name: str, index: int) -> int:
        """Return an element; raises `Rejection` (57, 56) for an unknown array or an index outside it."""
        row = self._rows.get(name)
        if row is None:
            raise Rejection(ErrorCode.BAD_FUNCTION)
        if 0 <= index < len(row):
            return row[index]
        if index == LENGTH:
            return len(row) << 16
        raise Rejection(ErrorCode.INDEX_OUT_OF_RANGE)

    def assign(self, name: str, index: int, value: int) -> None:
        """Set an element; raises `Rejection` (82, 56) for an unknown array or an index outside it."""
        row = self.row(name)
        if not 0 <= index < len(row):
            raise Rejection(ErrorCode.INDEX_OUT_OF_RANGE)
        row[index] = value

    def release(self, name: str) -> None:
        """Forget an array (DA); raises `Rejection` (82) for an unknown one."""
        self.row(name)
        del self._rows[name]

    def clear(self) -> None:
        """Forget all of them."""
        self._rows.clear()

    def contents(self) -> dict[str, list[int]]:
        """Return a copy of everything."""
        return {name: list(row) for name, row in self._rows.items()}

    def restore(self, contents: dict[str, list[int]]) -> None:
        """Have these arrays and no others."""
        self._rows = {name: list(row) for name, row in contents.items()}
