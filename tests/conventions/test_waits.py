"""A test that waits in real time states the reason in its mark `waits`."""

from __future__ import annotations

import ast

from tests.conventions import source


def is_mark(node: ast.expr) -> bool:
    """Return whether an expression is `pytest.mark.waits`."""
    return isinstance(node, ast.Attribute) and node.attr == "waits" and ast.unparse(node.value) == "pytest.mark"


def has_reason(call: ast.Call) -> bool:
    """Return whether a call has exactly one argument, a text that is not empty."""
    if call.keywords or len(call.args) != 1:
        return False
    (reason,) = call.args
    return isinstance(reason, ast.Constant) and isinstance(reason.value, str) and bool(reason.value.strip())


def marks_in(tree: ast.Module) -> tuple[list[int], list[int]]:
    """Return the lines of all marks, and the lines of those with a reason."""
    nodes = [node for node in ast.walk(tree) if isinstance(node, ast.expr)]
    calls = [node for node in nodes if isinstance(node, ast.Call) and is_mark(node.func) and has_reason(node)]
    return sorted(node.lineno for node in nodes if is_mark(node)), sorted(call.func.lineno for call in calls)


def test_every_mark_has_one_reason() -> None:
    found = {module.name: marks_in(module.tree) for module in source.test_modules()}
    assert any(marks for marks, _ in found.values())
    assert [name for name, (marks, explained) in found.items() if marks != explained] == []


def test_a_mark_without_a_reason_is_found() -> None:
    for wrong in ("", "()", "('')", "(' ')", "(3)", "('a', 'b')", "(reason='a')"):
        marks, explained = marks_in(ast.parse(f"@pytest.mark.waits{wrong}\ndef test(): pass"))
        assert (marks, explained) == ([1], []), wrong
