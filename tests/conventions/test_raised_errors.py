"""Whoever raises an error names every detail that its sentence shows."""

from __future__ import annotations

import ast
import string

from maya_un import errors, messages
from tests.conventions import source

LEAVES = {leaf.__name__: leaf for leaf in errors.by_code().values()}


def named_in_sentence(code: int) -> set[str]:
    return {name for _, name, _, _ in string.Formatter().parse(messages.table()[code]) if name}


def wrong_details(call: ast.Call, leaf: str) -> set[str]:
    """Return the details that a call lacks; those it adds are kept as data and shown by nobody."""
    if any(keyword.arg is None for keyword in call.keywords):
        return set()  # `**details` hands on those of another error
    return named_in_sentence(LEAVES[leaf].code) - {keyword.arg for keyword in call.keywords if keyword.arg}


def called_leaf(node: ast.AST) -> str:
    if not isinstance(node, ast.Call):
        return ""
    name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
    return name if name in LEAVES else ""


def test_errors_are_made_with_the_details_of_their_sentence() -> None:
    made = [
        (module, node, called_leaf(node))
        for module in source.modules()
        for node in ast.walk(module.tree)
        if called_leaf(node)
    ]
    assert made
    lacking = [
        f"{module.path}:{node.lineno}: {leaf} lacks {sorted(wrong_details(node, leaf))}"
        for module, node, leaf in made
        if isinstance(node, ast.Call) and wrong_details(node, leaf)
    ]
    assert not lacking


def test_an_error_raised_bare_has_a_sentence_without_details() -> None:
    raised = [
        (module.name, node.exc)
        for module in source.modules()
        for node in ast.walk(module.tree)
        if isinstance(node, ast.Raise)
    ]
    bare = [(name, raised.id) for name, raised in raised if isinstance(raised, ast.Name) and raised.id in LEAVES]
    assert [one for one in bare if named_in_sentence(LEAVES[one[1]].code)] == []
