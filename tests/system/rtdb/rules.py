"""Security rules: as much of their language as rules for robots need.

Expressions with && || ! == != === !== < <= > >= + and literals, `auth`, `now`, `root`, `data`, `newData`, $variables,
and the methods val, exists, child, parent, hasChild, hasChildren, isString, isNumber, isBoolean, contains, beginsWith.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from tests.system.rtdb.tree import Path, Tree, at, exported, parts

_WORDS = re.compile(
    r"\s*(?:(?P<number>\d+(?:\.\d+)?)|(?P<text>'[^']*'|\"[^\"]*\")|(?P<name>[$A-Za-z_][\w$]*)"
    r"|(?P<sign>===|!==|==|!=|<=|>=|&&|\|\||[-!<>+()\[\].,]))"
)
_BINDING = {"||": 1, "&&": 2, "==": 3, "===": 3, "!=": 3, "!==": 3, "<": 4, "<=": 4, ">": 4, ">=": 4, "+": 5}

Names = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Snapshot:
    """A place in the tree, as rules see it."""

    root: Tree
    path: Path = ()

    @property
    def tree(self) -> Tree:
        return at(self.root, self.path)

    def val(self) -> Any:
        return exported(self.tree)

    def exists(self) -> bool:
        return self.tree is not None

    def child(self, path: str) -> Snapshot:
        return Snapshot(self.root, (*self.path, *parts(path)))

    def parent(self) -> Snapshot:
        return Snapshot(self.root, self.path[:-1])

    def hasChild(self, path: str) -> bool:  # noqa: N802 - the names of the language
        return self.child(path).exists()

    def hasChildren(self, keys: list[str] | None = None) -> bool:  # noqa: N802
        if keys is None:
            return isinstance(self.tree, dict)
        return all(self.hasChild(key) for key in keys)

    def isString(self) -> bool:  # noqa: N802
        return isinstance(self.tree, str)

    def isNumber(self) -> bool:  # noqa: N802
        return isinstance(self.tree, int | float) and not isinstance(self.tree, bool)

    def isBoolean(self) -> bool:  # noqa: N802
        return isinstance(self.tree, bool)


Expression = Callable[[Names], Any]


class _Parser:
    """Reads an expression into a function."""

    def __init__(self, text: str) -> None:
        self._words: list[tuple[str, str]] = []
        place = 0
        while text[place:].strip():
            found = _WORDS.match(text, place)
            if found is None:
                raise ValueError(f"not understood in a rule: {text[place:]}")
            self._words.append((str(found.lastgroup), found[str(found.lastgroup)]))
            place = found.end()
        self._words.append(("end", ""))

    def whole(self) -> Expression:
        found = self._binary(0)
        self._take("")
        return found

    def _take(self, wanted: str | None = None) -> tuple[str, str]:
        word = self._words.pop(0)
        if wanted is not None and word[1] != wanted:
            raise ValueError(f"{wanted!r} is missing in a rule before {word[1]!r}")
        return word

    def _binary(self, least: int) -> Expression:
        left = self._unary()
        while (binding := _BINDING.get(self._words[0][1], 0)) > least:
            left = _joined(self._take()[1], left, self._binary(binding))
        return left

    def _unary(self) -> Expression:
        if self._words[0][1] == "!":
            self._take()
            inner = self._unary()
            return lambda names: not inner(names)
        return self._postfix(self._primary())

    def _primary(self) -> Expression:
        kind, word = self._take()
        if kind == "number":
            return lambda _: float(word)
        if kind == "text":
            return lambda _: word[1:-1]
        if word == "(":
            inner = self._binary(0)
            self._take(")")
            return inner
        if word == "[":
            items = self._list("]")
            return lambda names: [item(names) for item in items]
        constants = {"true": True, "false": False, "null": None}
        if word in constants:
            return lambda _: constants[word]
        return lambda names: names[word]

    def _postfix(self, value: Expression) -> Expression:
        while self._words[0][1] in {".", "[", "("}:
            sign = self._take()[1]
            if sign == ".":
                value = _member(value, self._take()[1])
            elif sign == "[":
                key = self._binary(0)
                self._take("]")
                value = _item(value, key)
            else:
                value = _call(value, self._list(")"))
        return value

    def _list(self, end: str) -> list[Expression]:
        found = []
        while self._words[0][1] != end:
            found.append(self._binary(0))
            if self._words[0][1] == ",":
                self._take()
        self._take(end)
        return found


def _joined(sign: str, left: Expression, right: Expression) -> Expression:
    return {
        "||": lambda names: left(names) or right(names),
        "&&": lambda names: left(names) and right(names),
        "==": lambda names: left(names) == right(names),
        "===": lambda names: left(names) == right(names),
        "!=": lambda names: left(names) != right(names),
        "!==": lambda names: left(names) != right(names),
        "<": lambda names: left(names) < right(names),
        "<=": lambda names: left(names) <= right(names),
        ">": lambda names: left(names) > right(names),
        ">=": lambda names: left(names) >= right(names),
        "+": lambda names: left(names) + right(names),
    }[sign]


def _member(value: Expression, name: str) -> Expression:
    def found(names: Names) -> Any:
        inner = value(names)
        if isinstance(inner, Snapshot):
            return getattr(inner, name)
        if isinstance(inner, str):
            return {"length": len(inner), "contains": lambda part: part in inner, "beginsWith": inner.startswith}[name]
        return inner.get(name)  # of null this raises, and the rule does not hold

    return found


def _item(value: Expression, key: Expression) -> Expression:
    return lambda names: value(names).get(key(names))


def _call(value: Expression, arguments: list[Expression]) -> Expression:
    return lambda names: value(names)(*(argument(names) for argument in arguments))


@dataclass(slots=True)
class Rules:
    """Rules as they are uploaded: {"rules": {…}}."""

    tree: Mapping[str, Any]
    _known: dict[str, Expression] = field(default_factory=dict)

    @classmethod
    def read(cls, text: str) -> Rules:
        """Return the rules in JSON text."""
        return cls(json.loads(text)["rules"])

    def may_read(self, path: Path, auth: Any, root: Tree, now: int) -> bool:
        """Return whether a path may be read: a rule at it or above it allows it."""
        names = {"auth": auth, "now": now, "root": Snapshot(root)}
        return any(
            self._holds(node.get(".read"), {**names, **found, "data": Snapshot(root, path[:depth])})
            for depth, (node, found) in enumerate(self._along(path))
        )

    def may_write(self, path: Path, auth: Any, root: Tree, new: Tree, now: int) -> bool:
        """Return whether the value at a path may change as it does from `root` to `new`."""
        names = {"auth": auth, "now": now, "root": Snapshot(root)}

        def here(depth: int, found: Names) -> Names:
            return {**names, **found, "data": Snapshot(root, path[:depth]), "newData": Snapshot(new, path[:depth])}

        along = list(self._along(path))
        if not any(self._holds(node.get(".write"), here(depth, found)) for depth, (node, found) in enumerate(along)):
            return False
        if at(new, path) is None:
            return True
        for depth, (node, found) in enumerate(along):
            if ".validate" in node and not self._holds(node[".validate"], here(depth, found)):
                return False
        if len(along) <= len(path):
            return True
        node, found = along[-1]
        return self._valid_below(node, path, {**names, **found}, root, new)

    def _valid_below(self, node: Mapping[str, Any], path: Path, names: Names, root: Tree, new: Tree) -> bool:
        tree = at(new, path)
        for key in tree if isinstance(tree, dict) else ():
            below, found = _step(node, key, names)
            deeper = (*path, key)
            if below is None:
                continue
            here = {**found, "data": Snapshot(root, deeper), "newData": Snapshot(new, deeper)}
            if ".validate" in below and not self._holds(below[".validate"], here):
                return False
            if not self._valid_below(below, deeper, found, root, new):
                return False
        return True

    def _along(self, path: Path) -> list[tuple[Mapping[str, Any], Names]]:
        """Return the rules at each place on the way to a path, with the variables that are known there."""
        node: Mapping[str, Any] | None = self.tree
        names: Names = {}
        found: list[tuple[Mapping[str, Any], Names]] = [(self.tree, names)]
        for key in path:
            assert node is not None
            node, names = _step(node, key, names)
            if node is None:
                break
            found.append((node, names))
        return found

    def _holds(self, rule: Any, names: Names) -> bool:
        if rule is None or isinstance(rule, bool):
            return bool(rule)
        if rule not in self._known:
            self._known[rule] = _Parser(rule).whole()
        try:
            return self._known[rule](names) is True
        except (AttributeError, KeyError, TypeError):
            return False


def _step(node: Mapping[str, Any], key: str, names: Names) -> tuple[Mapping[str, Any] | None, Names]:
    if isinstance(node.get(key), dict):
        return node[key], names
    for name, below in node.items():
        if name.startswith("$") and isinstance(below, dict):
            return below, {**names, name: key}
    return None, names
