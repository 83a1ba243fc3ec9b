"""The page about performance and its pictures are made from the stored runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from tests.conventions.source import ROOT

PICTURES = ("performance-growth.svg", "performance-limit.svg", "performance-peers.svg")


@pytest.fixture
def modules(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], Any]:
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    return import_module


@pytest.fixture
def other_results(modules: Callable[[str], Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Have the page and the pictures made from a run in which everything takes twice as long for the others."""
    results = modules("performance_results")
    *_, run = results.read()
    slow = replace(
        run,
        date="2031-01-02",
        rows=[replace(row, ratio=None if row.ratio is None else 2.0 * row.ratio) for row in run.rows],
        growth=[replace(one, cost=2.0 * one.cost) for one in run.growth],
        motions=[replace(one, carried_out=2.0 * one.carried_out) for one in run.motions],
    )
    results.write([run, slow], tmp_path / "peers.json")
    changed = results.read(tmp_path / "peers.json")
    for name in ("performance_page", "performance_figures"):
        monkeypatch.setattr(modules(name), "read", lambda: changed)


def test_the_page_is_made_from_the_stored_runs(modules: Callable[[str], Any]) -> None:
    stored = (ROOT / "docs" / "explanation" / "performance.md").read_text(encoding="utf-8")
    assert stored.endswith(modules("performance_page").page())


def test_a_picture_is_made_from_the_stored_runs_and_is_the_same_when_drawn_again(
    modules: Callable[[str], Any],
) -> None:
    draw = modules("draw_docs")
    for name in PICTURES:
        first = draw.drawn(name)
        assert draw.drawn(name) == first
        assert draw.same((ROOT / "docs" / "images" / name).read_text(encoding="utf-8"), first), name


@pytest.mark.usefixtures("other_results")
def test_other_results_make_another_page_and_other_pictures(modules: Callable[[str], Any]) -> None:
    page = modules("performance_page").page()
    assert "2031-01-02" in page
    assert not (ROOT / "docs" / "explanation" / "performance.md").read_text(encoding="utf-8").endswith(page)
    draw = modules("draw_docs")
    for name in PICTURES:
        stored = (ROOT / "docs" / "images" / name).read_text(encoding="utf-8")
        assert not draw.same(stored, draw.drawn(name)), name


@pytest.mark.usefixtures("other_results")
def test_the_page_says_how_far_the_ratios_of_two_runs_differ(modules: Callable[[str], Any]) -> None:
    page = modules("performance_page")
    before, after = page.read()
    changes = dict(page.ratio_changes(before, after))
    assert changes
    assert list(changes.values()) == pytest.approx([1.0] * len(changes))
    assert f"Of {len(changes)} ratios, 0 differ by at most 20%" in " ".join(page.page().split())


def test_every_program_of_the_stored_run_gave_the_same_answer_as_maya(modules: Callable[[str], Any]) -> None:
    *_, run = modules("performance_results").read()
    assert [f"{row.work}, {row.program}: {row.error}" for row in run.rows if row.error] == []
    assert not run.quick
    assert {row.subject for row in run.rows} == set(modules("performance_page").SUBJECTS)
    assert all(row.difference is not None and row.difference <= row.tolerance for row in run.rows)
