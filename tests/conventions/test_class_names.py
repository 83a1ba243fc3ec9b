"""A class has a name of its own, so that a reader who searches for it finds one definition."""

from __future__ import annotations

import ast
from collections import defaultdict

from tests.conventions import source

SHARED = {
    "Event": "the base of all events, and what the public packages `client` and `supervisor` call theirs",
    "Robot": "the layer between `Controller` and `Process`, and what the public package `supervisor` calls a robot",
}
"""Names that several classes have, and why."""


def definitions() -> dict[str, list[str]]:
    """Return the modules that define a class of each name."""
    found: defaultdict[str, list[str]] = defaultdict(list)
    base = source.ROOT / "src"
    for path in sorted(base.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef):
                found[node.name].append(str(path.relative_to(base)))
    return found


def test_a_class_name_is_defined_once() -> None:
    shared = {name: files for name, files in definitions().items() if len(files) > 1 and name not in SHARED}
    assert not shared, f"give these classes names of their own: {shared}"


def test_every_exception_is_still_needed() -> None:
    found = definitions()
    assert [name for name in SHARED if len(found[name]) < 2] == []
