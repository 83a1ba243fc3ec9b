"""Edges of `maya up`: entry points, and the error for one that is missing."""

from __future__ import annotations

from importlib.metadata import EntryPoint, entry_points

import pytest

from maya_un.edges import GROUP, edge
from maya_un.errors import EdgeNotInstalled


@pytest.mark.parametrize("point", entry_points(group=GROUP), ids=lambda point: point.name)
def test_every_edge_has_both_functions(point: EntryPoint) -> None:
    found = edge(point.name)
    assert callable(found.endpoint)
    assert callable(found.configured)


def test_rosbridge_is_an_edge() -> None:
    assert "ros" in entry_points(group=GROUP).names


def test_a_missing_edge_is_named() -> None:
    with pytest.raises(EdgeNotInstalled, match="provides the interface fieldbus"):
        edge("fieldbus")
