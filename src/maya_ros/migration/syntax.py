"""The syntax of Python 2 and 3 by parso: nodes of its tree as calls, dotted names, scopes and texts."""

from __future__ import annotations

import ast
import re
import warnings
from collections.abc import Iterator
from typing import Any, NamedTuple

from parso.grammar import load_grammar

_GRAMMAR = "3.12"
_LONGEST_LINE = 10_000
"""Longer lines stay as they are [characters]."""


def parse(text: str) -> list[Any]:
    """Return all nodes of a source, in its order. Any text is parsed; parso goes on behind an error."""
    return list(walk(load_grammar(version=_GRAMMAR).parse(text)))


class PythonCall(NamedTuple):
    """A call: its node, the dotted text of what is called ("" if it is none), and its arguments with their names."""

    node: Any
    called: str
    arguments: list[tuple[str, Any]]

    def argument(self, name: str, place: int) -> Any:
        """Return an argument by its name or its place, None without it."""
        plain = [value for given, value in self.arguments if not given]
        named = [value for given, value in self.arguments if given == name]
        return named[0] if named else plain[place] if place < len(plain) else None


_STATEMENTS = (
    (
        re.compile(r"^(\s*|.*:\s+)(?:print|exec)\s*(?:>>\s*[\w.]+\s*,)?(?=[\s\"'`])(?!\s*[(=.])\s*(.*?),?\s*$"),
        r"\1print(\2)",
    ),
    (re.compile(r"^(\s*except\b.*?)\s*,\s*(\w+\s*:.*)$"), r"\1 as \2"),
    (re.compile(r"^(\s*raise\s+[\w.]+)\s*,\s*(.*)$"), r"\1(\2)"),
    (re.compile(r"<>"), "!="),
    (re.compile(r"`([^`]*)`"), r"repr(\1)"),
    (re.compile(r"\b0([0-7]+)\b(?![.\w])"), r"0o\1"),
    (re.compile(r"\b([0-9]+)[lL]\b"), r"\1"),
    (re.compile(r"\b[uU][rR](?=[\"'])"), "r"),
)
"""Statements and literals of Python 2, and the same in Python 3."""


def modern(text: str) -> str:
    """Return a source with its Python 2 statements written in Python 3, line by line, so that more of it is parsed.

    This is for reading only. A line whose brackets have no end stays as it is.
    """
    return "\n".join(map(_modern_line, text.split("\n")))


def _modern_line(line: str) -> str:
    if len(line) > _LONGEST_LINE or "#" in line:
        return line
    for pattern, new in _STATEMENTS:
        changed = pattern.sub(new, line)
        if changed.count("(") == changed.count(")"):
            line = changed
    return line


def walk(root: Any) -> Iterator[Any]:
    """Yield a node and all below it, in the order of the source."""
    left = [root]
    while left:
        node = left.pop()
        yield node
        left += reversed(getattr(node, "children", ()))


def scope(node: Any) -> int:
    """Return the number of the function around a node, 0 outside of functions."""
    while node is not None and node.type != "funcdef":
        node = node.parent
    return id(node) if node is not None else 0


def code(node: Any) -> str:
    """Return the source of a node on one line, without the blanks before it."""
    return " ".join(node.get_code(include_prefix=False).split())


def dotted(node: Any) -> str:
    """Return a name with its attributes, like "self.goal.a", "" for any other expression."""
    if node.type == "name":
        return node.value
    if node.type not in {"atom_expr", "power"} or node.children[0].type != "name":
        return ""
    trailers = node.children[1:]
    if not all(one.type == "trailer" and one.children[0] == "." for one in trailers):
        return ""
    return ".".join([node.children[0].value, *(one.children[1].value for one in trailers)])


def calls(node: Any) -> list[PythonCall]:
    """Return the calls in an expression like a.b(c).d(e), in their order; `node` is that of the whole expression."""
    found: list[PythonCall] = []
    names = [node.children[0].value] if node.children[0].type == "name" else []
    for trailer in node.children[1:]:
        if trailer.type != "trailer":
            break
        opening = trailer.children[0]
        if opening == "." and names:
            names.append(trailer.children[1].value)
        elif opening == "(":
            last = trailer is node.children[-1]
            found.append(PythonCall(node if last else trailer, ".".join(names), arguments(trailer)))
            names = []
        else:
            names = []
    return found


def arguments(trailer: Any) -> list[tuple[str, Any]]:
    """Return the arguments of a call with their names: "" for one by position, "**" for one with stars."""
    inner = trailer.children[1:-1]
    given = inner[0].children if inner and inner[0].type == "arglist" else inner
    found: list[tuple[str, Any]] = []
    for one in given:
        if one.type == "argument" and len(one.children) == 3 and one.children[1] == "=":
            found.append((one.children[0].value, one.children[2]))
        elif one.type == "argument":
            found.append(("**", one))
        elif one.type != "operator":
            found.append(("", one))
    return found


def value(node: Any) -> str:
    """Return the text of a string literal, also of Python 2; "" for one that cannot be read."""
    code = node.value.lstrip("uUbBrR")
    quote = code[:3] if code[:3] in {'"""', "'''"} else code[:1]
    body = code[len(quote) : len(code) - len(quote)]
    if "\\" not in body or "r" in node.value[: len(node.value) - len(code)].lower():
        return body
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            value = ast.literal_eval(code)
    except (ValueError, SyntaxError):
        return ""
    return value if isinstance(value, str) else ""


def number(code: str) -> float | None:
    """Return the number that a text is, None for any other text."""
    try:
        return float(code)
    except ValueError:
        return None
