"""How a job is to be queued, as people write it: read, checked, changed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from reprlib import repr

from maya_un.errors import InvalidRequest, InvalidValue
from maya_un.process.journal.rows import JobOptions
from maya_un.schema.jobs import OnFailure

ORDINARY = JobOptions()
"""The default options."""

MOST_PRIORITY = 100
MOST_RETRIES = 10
LONGEST_NOTES = 2000
MOST_DEPENDENCIES = 100


def read_options(data: Mapping[str, object], old: JobOptions = ORDINARY) -> JobOptions:
    """Return `old` with what plain data changes in it; raises `InvalidRequest` for another key, `InvalidValue`."""
    changes: dict[str, object] = {}
    for key, value in data.items():
        if key not in _READERS:
            raise InvalidRequest(key=key, reason=f"there is no such key; known are {', '.join(_READERS)}")
        changes[key] = _READERS[key](key, value)
    return replace(old, **changes)  # pyright: ignore[reportArgumentType] - each reader returns its field's type


def checked(options: JobOptions) -> JobOptions:
    """Return `options`; raises `InvalidValue` for what lies outside its range."""
    return read_options({key: getattr(options, key) for key in _READERS})


def _whole(low: int, high: int) -> Callable[[str, object], int]:
    def read(key: str, value: object) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise InvalidValue(key=key, value=repr(value), reason=f"it must be a whole number from {low} to {high}")
        return value

    return read


def _flag(key: str, value: object) -> bool:
    if not isinstance(value, bool):
        raise InvalidValue(key=key, value=repr(value), reason="it must be true or false")
    return value


def _notes(key: str, value: object) -> str:
    if not isinstance(value, str) or len(value) > LONGEST_NOTES:
        raise InvalidValue(key=key, value=repr(value), reason=f"it must be a text of at most {LONGEST_NOTES} letters")
    if not all(letter.isprintable() or letter in "\n\t" for letter in value):
        raise InvalidValue(key=key, value=repr(value), reason="it must be printable")
    return value


def _numbers(key: str, value: object) -> tuple[int, ...]:
    if not isinstance(value, Sequence) or isinstance(value, str) or len(value) > MOST_DEPENDENCIES:
        reason = f"it must be a list of at most {MOST_DEPENDENCIES} numbers of jobs"
        raise InvalidValue(key=key, value=repr(value), reason=reason)
    number = _whole(1, 2**53)
    return tuple(dict.fromkeys(number(f"{key}.{place}", item) for place, item in enumerate(value)))


def _on_failure(key: str, value: object) -> OnFailure:
    try:
        return OnFailure(str(value))
    except ValueError:
        raise InvalidValue(key=key, value=repr(value), reason=f"it is {' or '.join(OnFailure)}") from None


_READERS: dict[str, Callable[[str, object], object]] = {
    "priority": _whole(-MOST_PRIORITY, MOST_PRIORITY),
    "held": _flag,
    "depends_on": _numbers,
    "notes": _notes,
    "on_failure": _on_failure,
    "retries": _whole(0, MOST_RETRIES),
    "stepwise": _flag,
}
