"""Parse documents: JSON objects from clients, YAML and JSON files.

Nothing in them is executed, and nothing is silently dropped.
"""

from __future__ import annotations

import json
from collections.abc import Hashable
from pathlib import Path
from typing import Any, NoReturn

import yaml

from maya_un.errors import FileUnreadable, InvalidRequest

MOST_VALUES = 100_000
"""Most values, keys and brackets of an object; the longest job has about a third of them."""


def decode_object(body: bytes) -> dict[str, Any]:
    """Return the JSON object of a request's body.

    Raises `InvalidRequest` for anything else, NaN and infinities (which are not JSON), a key that stands twice, half a
    character and more than `MOST_VALUES` included.
    """
    require_few(body)
    try:
        value = json.loads(body, parse_constant=_refuse_constant, object_pairs_hook=_unique_json_keys)
        if b"\\u" in body:
            json.dumps(value, ensure_ascii=False).encode()  # a lone surrogate is an error here, and nowhere later
    except RecursionError as error:
        raise InvalidRequest(key="body", reason="it is nested too deeply") from error
    except ValueError as error:
        raise InvalidRequest(key="body", reason=f"it is not JSON ({error})") from error
    if not isinstance(value, dict):
        raise InvalidRequest(key="body", reason="it is not a JSON object")
    return value


def require_few(text: str | bytes, key: str = "body") -> None:
    """Raise `InvalidRequest` if JSON has more than `MOST_VALUES`; count punctuation instead of parsing."""
    marks = map(text.count, ",:[{") if isinstance(text, str) else map(text.count, b",:[{")
    if sum(marks) > MOST_VALUES:
        raise InvalidRequest(key=key, reason=f"it has more than {MOST_VALUES} values")


def _unique_json_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    once: dict[str, Any] = {}
    for key, value in pairs:
        if key in once:
            raise ValueError(f"the key {key!r} stands twice")
        once[key] = value
    return once


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is not a number in JSON")


MOST_BYTES = 250_000
"""Size of the largest file that is read."""


def read_document(path: Path) -> Any:
    """Return the data of a file (.json, anything else is read as YAML).

    Raises `FileUnreadable` for a file that cannot be read or parsed.
    """
    text = _text(path)
    try:
        return (
            json.loads(text, object_pairs_hook=_unique_yaml_keys)
            if path.suffix == ".json"
            else yaml.load(text, _Loader)
        )
    except (ValueError, yaml.YAMLError, RecursionError) as error:
        raise FileUnreadable(path=path, reason=_first_line(error)) from error


def _text(path: Path) -> str:
    try:
        with path.open("rb") as file:  # a device has no size, so the reading itself is bounded
            data = file.read(MOST_BYTES + 1)
        if len(data) > MOST_BYTES:
            raise FileUnreadable(path=path, reason=f"it is larger than {MOST_BYTES} bytes")
        return data.decode("utf-8")
    except OSError as error:
        raise FileUnreadable(path=path, reason=error.strerror or str(error)) from error
    except UnicodeDecodeError as error:
        raise FileUnreadable(path=path, reason="it is not UTF-8 text") from error


def _unique_yaml_keys(pairs: list[tuple[Any, Any]]) -> dict[Any, Any]:
    """Return pairs as a dict; raises `ValueError` for a key that stands twice, or is no text or number."""
    once: dict[Any, Any] = {}
    for key, value in pairs:
        if not isinstance(key, Hashable):
            raise ValueError(f"a key must be a text, not {key!r}")  # noqa: TRY004 - a parse error like the others
        if key in once:
            raise ValueError(f"the key {key!r} stands twice")
        once[key] = value
    return once


class _Loader(yaml.SafeLoader):
    """Safe YAML, where a key that stands twice and an alias are errors."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        def made(part: yaml.Node) -> Any:
            return self.construct_object(part, deep=True)

        return _unique_yaml_keys([(made(key), made(value)) for key, value in node.value])

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        if self.check_event(yaml.AliasEvent):
            raise yaml.YAMLError("aliases (*name) are not accepted")
        return super().compose_node(parent, index)


def _first_line(error: Exception) -> str:
    if isinstance(error, RecursionError):
        return "it is nested too deeply"
    mark = getattr(error, "problem_mark", None)
    problem = getattr(error, "problem", None) or str(error).partition("\n")[0]
    return f"{problem} (line {mark.line + 1})" if mark is not None else problem
