"""The data: a tree of objects and leaves, its order, its hashes, queries, and changes."""

from __future__ import annotations

import base64
import hashlib
import json
import struct
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

Path = tuple[str, ...]
Tree = Any
"""None, a leaf (bool, int, float, str), or a dict without empty children."""

FORBIDDEN = frozenset(".$#[]/") | {chr(code) for code in range(32)} | {"\x7f"}
DEEPEST = 32


class BadDataError(Exception):
    """Data or a path that a database does not take."""


def parts(text: str) -> Path:
    """Return a path."""
    path = tuple(part for part in text.split("/") if part)
    for key in path:
        if set(key) & FORBIDDEN or len(key.encode()) > 768:
            raise BadDataError("Invalid path: Invalid token in path")
    return path


def at(tree: Tree, path: Path) -> Tree:
    """Return what stands at a path."""
    for key in path:
        tree = tree.get(key) if isinstance(tree, dict) else None
    return tree


def put(tree: Tree, path: Path, value: Tree) -> Tree:
    """Return the tree with a value at a path; the old tree stays as it is."""
    if not path:
        return value
    children = dict(tree) if isinstance(tree, dict) else {}
    child = put(children.get(path[0]), path[1:], value)
    if child is None:
        children.pop(path[0], None)
    else:
        children[path[0]] = child
    return children or None


def resolved(value: Any, old: Tree, now: int, depth: int = 0) -> Tree:
    """Return data as a tree: server values are filled in, nulls and empty objects left out."""
    if depth > DEEPEST:
        raise BadDataError("Invalid data; couldn't parse JSON object. Path exceeds the maximum depth.")
    if isinstance(value, list):
        value = {str(index): child for index, child in enumerate(value)}
    if not isinstance(value, dict):
        return value
    if ".sv" in value:
        return _server_value(value[".sv"], old, now)
    if ".value" in value:
        return value[".value"]
    found = {}
    for key, child in value.items():
        if key == ".priority":
            continue
        if not key or set(key) & FORBIDDEN:
            raise BadDataError(f"Invalid data; couldn't parse JSON object. Invalid key {key!r}.")
        tree = resolved(child, at(old, (key,)), now, depth + 1)
        if tree is not None:
            found[key] = tree
    return found or None


def _server_value(wanted: Any, old: Tree, now: int) -> Tree:
    if wanted == "timestamp":
        return now
    if isinstance(wanted, dict) and isinstance(wanted.get("increment"), int | float):
        number = isinstance(old, int | float) and not isinstance(old, bool)
        return (old if number else 0) + wanted["increment"]
    raise BadDataError("Invalid data; unknown server value")


def order(key: str) -> tuple[int, int, str]:
    """Order keys: whole numbers of 32 bits, then text."""
    try:
        number = int(key)
    except ValueError:
        return (1, 0, key)
    return (0, number, "") if str(number) == key and abs(number) < 1 << 31 else (1, 0, key)


def exported(tree: Tree) -> Any:
    """Return a tree as JSON data: keys in order, and an array where the keys are numbers without many gaps."""
    if not isinstance(tree, dict):
        return tree
    keys = sorted(tree, key=order)
    if all(key.isdigit() and str(int(key)) == key for key in keys) and int(keys[-1]) < 2 * len(keys):
        return [exported(tree.get(str(index))) for index in range(int(keys[-1]) + 1)]
    return {key: exported(tree[key]) for key in keys}


def shallow(tree: Tree) -> Any:
    """Return a tree whose children are `true`."""
    return dict.fromkeys(sorted(tree, key=order), True) if isinstance(tree, dict) else tree


def etag(tree: Tree) -> str:
    """Return the ETag of a tree."""
    return "null_etag" if tree is None else _sha1(json.dumps(exported(tree)))


def tree_hash(tree: Tree) -> str:
    """Return the hash that the libraries compare in a transaction."""
    if tree is None:
        return ""
    if isinstance(tree, dict):
        return _sha1("".join(f":{key}:{tree_hash(tree[key])}" for key in sorted(tree, key=order)))
    if isinstance(tree, bool):
        return _sha1(f"boolean:{str(tree).lower()}")
    if isinstance(tree, int | float):
        return _sha1("number:" + struct.pack(">d", float(tree)).hex())
    return _sha1(f"string:{tree}")


def _sha1(text: str) -> str:
    return base64.b64encode(hashlib.sha1(text.encode()).digest()).decode()


@dataclass(frozen=True, slots=True)
class Query:
    """Some of the children of a node: those between two ends of an index, and of these the first or last ones.

    `start` and `end` are (value, key, inclusive); a key None stands for every key.
    """

    index: str = ".key"
    start: tuple[Any, str | None, bool] | None = None
    end: tuple[Any, str | None, bool] | None = None
    limit: int | None = None
    last: bool = False

    def of(self, tree: Tree) -> Tree:
        """Return the part of a tree that the query means."""
        if not isinstance(tree, dict):
            return tree
        keys = sorted((key for key in tree if self._within(key, tree[key])), key=lambda key: self._rank(key, tree[key]))
        if self.limit is not None:
            keys = keys[-self.limit :] if self.last else keys[: self.limit]
        return {key: tree[key] for key in keys} or None

    def _value(self, key: str, child: Tree) -> Any:
        if self.index == ".key":
            return key
        return child if self.index == ".value" else at(child, parts(self.index))

    def _rank(self, key: str, child: Tree) -> tuple[Any, ...]:
        return (*_rank(self._value(key, child), keys=self.index == ".key"), *order(key))

    def _within(self, key: str, child: Tree) -> bool:
        value = self._value(key, child)
        return (self.start is None or self._side(value, key, self.start, 1)) and (
            self.end is None or self._side(value, key, self.end, -1)
        )

    def _side(self, value: Any, key: str, end: tuple[Any, str | None, bool], sign: int) -> bool:
        wanted, name, inclusive = end
        keys = self.index == ".key"
        one, other = _rank(value, keys=keys), _rank(wanted, keys=keys)
        if one == other and name is not None:
            one, other = (*one, *order(key)), (*other, *order(name))
        if one == other:
            return inclusive
        return (one > other) == (sign > 0)


def _rank(value: Any, *, keys: bool) -> tuple[Any, ...]:
    """Order values: null, false, true, numbers, text, objects."""
    if keys:
        return order(str(value))
    if value is None:
        return (0, 0)
    if isinstance(value, bool):
        return (1, int(value))
    if isinstance(value, int | float):
        return (2, value)
    return (3, value) if isinstance(value, str) else (4, 0)


Change = tuple[Path, Any]


def changes_of(path: Path, data: Mapping[str, Any]) -> Sequence[Change]:
    """Return what an update with several paths changes; raises `BadDataError` for one within another."""
    found = [((*path, *parts(key)), value) for key, value in data.items()]
    for one, _ in found:
        for other, _ in found:
            if one != other and other[: len(one)] == one:
                raise BadDataError("Invalid data; a path of an update is an ancestor of another")
    return found


def applied(tree: Tree, changes: Iterable[Change], now: int) -> Tree:
    """Return a tree with changes."""
    new = tree
    for path, value in changes:
        new = put(new, path, resolved(value, at(tree, path), now))
    return new
