"""Expected replies: literal text in which `<...>` stands for what may differ from one controller to the next.

`<n>` is a whole number and `<v>` one with four decimals, both with the slot for their sign; `< >` a blank or none;
`<2..8>` a number between two; `<axes>` how many axes there are; `<handle>` a letter A to H; `<line>` any text
within a line, `<lines>` any text at all; `<<` is the character itself.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

_NUMBER = r" ?-?\d+(?:\.\d+)?"
_FIXED = {
    "n": r" ?-?\d+",
    "v": r" ?-?\d+\.\d{4}",
    " ": " ?",
    "handle": "[A-H]",
    "line": "[^\r\n]+",
    "lines": "(?s:.*?)",
}
_TOKEN = re.compile(r"<<|<([^<>]+)>")
_RANGE = re.compile(r"(-?\d+(?:\.\d+)?)\.\.(-?\d+(?:\.\d+)?)")


@dataclass(frozen=True, slots=True)
class Pattern:
    """One expected reply: its form, and the ranges in which the numbers it captures must lie."""

    form: re.Pattern[bytes]
    ranges: tuple[tuple[float, float], ...]

    def matches(self, data: bytes) -> bool:
        """Tell whether `data` is such a reply, from its first byte to its last."""
        return self._within(self.form.fullmatch(data))

    def begins(self, data: bytes) -> int:
        """Return how many bytes at the beginning of `data` are such a reply, -1 where none are."""
        found = self.form.match(data)
        return found.end() if found is not None and self._within(found) else -1

    def _within(self, found: re.Match[bytes] | None) -> bool:
        if found is None:
            return False
        numbers = map(float, found.groups())
        return all(low <= number <= high for number, (low, high) in zip(numbers, self.ranges, strict=True))


def compiled(text: str, axes: int) -> Pattern:
    """Return the pattern that `text` describes on a controller with `axes` axes; raises `ValueError`."""
    form, ranges, at = "", list[tuple[float, float]](), 0
    for token in _TOKEN.finditer(text):
        form += re.escape(text[at : token.start()]) + _form(token[1], axes, ranges)
        at = token.end()
    form += re.escape(text[at:])
    return Pattern(re.compile(form.encode("latin-1")), tuple(ranges))


def literal(text: str) -> bool:
    """Tell whether an expected reply leaves nothing open."""
    return "<" not in text


def _form(name: str | None, axes: int, ranges: list[tuple[float, float]]) -> str:
    if name is None:
        return "<"
    if name == "axes":
        return str(axes)
    if name in _FIXED:
        return _FIXED[name]
    bounds = _RANGE.fullmatch(name)
    if bounds is None:
        raise ValueError(f"<{name}> stands for nothing")
    ranges.append((float(bounds[1]), float(bounds[2])))
    return f"({_NUMBER})"
