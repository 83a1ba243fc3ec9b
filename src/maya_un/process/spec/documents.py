"""Read documents that users write: YAML or JSON files. Nothing is executed, and nothing is silently dropped."""

from __future__ import annotations

import json
from collections.abc import Hashable
from pathlib import Path
from typing import Any

import yaml

from maya_un.errors import FileUnreadable

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
    """Return pairs as a dict; raises `ValueError` for a key that occurs twice, or is no text or number."""
    once: dict[Any, Any] = {}
    for key, value in pairs:
        if not isinstance(key, Hashable):
            raise ValueError(f"a key must be a text, not {key!r}")  # noqa: TRY004 - a parse error like the others
        if key in once:
            raise ValueError(f"the key {key!r} stands twice")
        once[key] = value
    return once


class _Loader(yaml.SafeLoader):
    """Safe YAML, in which a repeated key and an alias are errors."""

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
