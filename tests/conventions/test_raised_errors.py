"""An error that is raised as a bare class has no required details; the type checker looks at calls."""

from __future__ import annotations

import ast

from maya_un import errors
from tests.conventions import source

LEAVES = {leaf.__name__: leaf for leaf in errors.by_code().values()}


def test_an_error_raised_bare_has_no_required_details() -> None:
    raised = [
        (module.name, node.exc)
        for module in source.modules()
        for node in ast.walk(module.tree)
        if isinstance(node, ast.Raise)
    ]
    bare = [(name, raised.id) for name, raised in raised if isinstance(raised, ast.Name) and raised.id in LEAVES]
    assert bare
    assert [one for one in bare if any(LEAVES[one[1]].declared.values())] == []
