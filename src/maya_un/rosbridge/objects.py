"""JSON objects in a stream of texts: one text may hold several, and one object may span several texts."""

from __future__ import annotations

import re

from maya_un.errors import InvalidRequest
from maya_un.rosbridge.limits import LONGEST_MESSAGE, LONGEST_SPLIT

_MARK = re.compile(r'\\.|["{}\\]', re.DOTALL)


class Objects:
    """Finds objects by their braces. Skips text between objects, and keeps an incomplete object."""

    def __init__(self) -> None:
        self._parts: list[str] = []
        self._kept = 0
        self._depth = 0
        self._quoted = False
        self._escaped = False

    @property
    def incomplete(self) -> bool:
        """Whether an object has begun that has not ended."""
        return self._depth > 0

    def forget(self) -> None:
        """Drop an incomplete object."""
        self._parts.clear()
        self._kept = self._depth = 0
        self._quoted = self._escaped = False

    def add(self, text: str) -> list[str]:
        """Return the objects that end in the next text; raises `InvalidRequest` if it is too long.

        Every character is read once, even if an object spans many texts.
        """
        if len(text) > LONGEST_SPLIT or self._kept + len(text) > LONGEST_MESSAGE:
            self.forget()
            raise InvalidRequest(key="message", reason=f"it is no JSON within {LONGEST_SPLIT} characters")
        found: list[str] = []
        begin = 0
        mark = ""
        for one in _MARK.finditer(text, 1 if self._escaped else 0):
            mark = one[0] if self._quoted else one[0][-1]
            before, self._depth = self._depth, self._after(mark)
            if self._depth > before == 0:
                begin = one.end() - 1
            elif before > self._depth == 0:
                found.append("".join((*self._parts, text[begin : one.end()])))
                self.forget()
        if self._depth:
            self._parts.append(text[begin:])
            self._kept += len(text) - begin
        self._escaped = self._quoted and mark == "\\"
        return found

    def _after(self, mark: str) -> int:
        """Return the number of open objects after a mark; marks within quotes or outside objects do not count."""
        if mark == '"':
            self._quoted = self._depth > 0 and not self._quoted
        elif not self._quoted and mark == "{":
            return self._depth + 1
        elif not self._quoted and mark == "}" and self._depth:
            return self._depth - 1
        return self._depth
