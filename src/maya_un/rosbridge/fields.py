"""The fields of a client's message, each looked at before anybody uses it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from maya_un.errors import InvalidRequest
from maya_un.rosbridge.names import resolved, type_of

LONGEST_ID = 1_000


class Fields:
    """What a client said. Everything raises `InvalidRequest` for what is not as it should be.

    A field that is null counts as left out, as clients in JavaScript send what they do not set.
    """

    def __init__(self, message: Mapping[str, Any]) -> None:
        self._message = message

    @property
    def id(self) -> str | float | None:
        """What the client calls this message, None where it does not say."""
        found = self._message.get("id")
        if found is None or (isinstance(found, str) and len(found) <= LONGEST_ID):
            return found
        if isinstance(found, int | float) and not isinstance(found, bool) and abs(found) < 2**63:
            return found
        raise InvalidRequest(key="id", reason=f"it is a text of at most {LONGEST_ID} characters")

    def get(self, key: str) -> Any:
        """Return whatever stands there, None where nothing does."""
        return self._message.get(key)

    def text(self, key: str, default: str | None = None) -> str:
        """Return a text; without a `default` there has to be one."""
        found = self._message.get(key)
        if found is None and default is not None:
            return default
        if not isinstance(found, str):
            raise InvalidRequest(key=key, reason="it is a text")
        return found

    def one_of(self, key: str, known: tuple[str, ...], default: str) -> str:
        """Return one of some words."""
        found = self.text(key, default)
        if found not in known:
            raise InvalidRequest(key=key, reason=f"it is one of {', '.join(known)}")
        return found

    def name(self, key: str) -> tuple[str, str]:
        """Return a name of the graph as the client writes it, and in whole."""
        said = self.text(key)
        return said, resolved(said, key)

    def kind(self, key: str = "type", *, needed: bool = True) -> str:
        """Return a type, "" where one is not `needed` and not there."""
        said = self.text(key, None if needed else "")
        return type_of(said, key) if said or needed else ""

    def whole(self, key: str, default: int, least: int, most: int) -> int:
        """Return a whole number of at least `least`, and `most` for a greater one."""
        found = self._message.get(key)
        if found is None:
            return default
        if isinstance(found, float) and found.is_integer():
            found = int(found)
        if not isinstance(found, int) or isinstance(found, bool) or found < least:
            raise InvalidRequest(key=key, reason=f"it is a whole number from {least}")
        return min(found, most)

    def flag(self, key: str, default: bool | None = None) -> bool:
        """Return true or false."""
        found = self._message.get(key)
        if found is None and default is not None:
            return default
        if not isinstance(found, bool):
            raise InvalidRequest(key=key, reason="it is true or false")
        return found

    def record(self, key: str) -> dict[str, Any]:
        """Return an object; what is left out, and an empty list, is an empty one."""
        found = self._message.get(key)
        if found is None or found == []:
            return {}
        if not isinstance(found, dict):
            raise InvalidRequest(key=key, reason="it is an object")
        return found
