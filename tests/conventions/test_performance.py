"""The page about performance and its pictures are made from the stored runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from benchmarks import against
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


def test_a_goal_that_is_missed_is_bold_and_a_figure_that_is_worse_is_named(
    modules: Callable[[str], Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    results, page = modules("performance_results"), modules("performance_page")
    better = results.Compared("b", "one", "ms", 2.0, 1.0, 1.5, "ms", 2.0, 1.0)
    worse = results.Compared("b", "two", "ms", 1.0, 2.0, 1.5, "ms", 1.0, 2.0)
    sure = results.Compared("b", "three", "ms", 1.0, 1.06, chance=0.0099)
    scattered = results.Compared("b", "four", "ms", 1.0, 1.5, chance=0.0101)
    stored = replace(results.read_comparison(results.GOALS), cases=[better, worse, sure, scattered])
    faster = replace(stored, cases=[replace(worse, reached=1.2)])
    monkeypatch.setattr(page, "read_comparison", lambda path: stored if path == results.GOALS else faster)
    text = page.page()
    assert "| b | one | 1.5 ms | **2** | 1 |  |" in text
    assert "| b | two | 1.5 ms | 1 | **2** | 1.2 |" in text
    assert "Of 2 goals, 2 are reached, as source or compiled." in text
    assert "Of the 4 figures that both commits have, with and without a goal, 1 are at most 5% worse" in text
    assert "- b, two: 1 ms before, 2 ms now.\n- b, three: 1 ms before, 1.06 ms now.\n" in text
    assert "- b, four: 1 ms before, 1.5 ms now (1%).\n" in text


def figure(*samples: float, by: str = "min") -> dict[str, dict[str, Any]]:
    """Return the figures of a benchmark with one case."""
    told = {"unit": "ms", "best": min(samples), "samples": list(samples), "by": by}
    return {"case": {**told, "goal": None, "goal_is": None, "compared": None}}


def test_a_benchmark_runs_again_while_it_is_worse(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    runs = {tmp_path: [1.0, 2.0, 2.0], against.ROOT: [3.0, 1.01, 1.0]}
    monkeypatch.setattr(against, "figures", lambda folder, _: figure(runs[folder].pop(0)))
    (case,) = against.compared(tmp_path, "b", 3)
    assert (case.before, case.after) == (1.0, 1.01)
    assert all(len(left) == 1 for left in runs.values())


@pytest.mark.parametrize(
    ("before", "after", "by", "ratio", "worse"),
    [
        ([1.0, 5.0, 9.0], [1.2, 5.0, 9.0], "min", 1.2, False),
        ([1.0, 5.0, 9.0], [1.2, 5.0, 9.0], "median", 1.0, False),
        ([1.0, 1.1, 1.2, 1.3, 1.4], [1.5, 1.6, 1.7, 1.8, 1.9], "median", 1.7 / 1.2, True),
        ([1.0, 1.1, 1.2, 1.3, 1.4], [1.01, 1.6, 1.7, 1.8, 1.9], "min", 1.01, False),
    ],
)
def test_a_figure_is_worse_unless_its_samples_scatter(
    before: list[float], after: list[float], by: str, ratio: float, *, worse: bool
) -> None:
    (case,) = against.paired("b", [figure(*before, by=by)], [figure(*after, by=by)])
    assert case.ratio == pytest.approx(ratio)
    assert case.worse == worse
    assert ("WORSE" in against.line(case), "by chance" in against.line(case)) == (worse, case.greater and not worse)


def test_the_samples_of_all_rounds_are_compared() -> None:
    rounds = [figure(1.0), figure(3.0, 4.0)]
    (case,) = against.paired("b", rounds, [figure(2.0), figure(6.0, by="median")])
    assert (case.before, case.after) == (1.0, 2.0)
    (case,) = against.paired("b", rounds, [figure(2.0, 7.0, 6.0, by="median")])
    assert (case.before, case.after) == (3.0, 6.0)


@pytest.mark.parametrize(
    ("before", "after", "worse"),
    [
        ([1.0, 1.0, 1.0, 2.0, 2.0], [1.0, 1.0, 2.0, 2.0, 2.0], False),
        ([1.0, 1.0, 1.0, 2.0], [1.0, 2.0, 2.0, 2.0], True),  # too few: all samples count
        ([1.0, 1.0, 1.0, 1.1, 1.2], [1.3, 1.3, 1.4, 1.5, 1.6], True),
    ],
)
def test_five_rounds_count_once_each(before: list[float], after: list[float], *, worse: bool) -> None:
    """Each round has nine samples that differ little from one another."""
    both = [
        [figure(*[middle + 0.001 * k for k in range(9)], by="median") for middle in side] for side in (before, after)
    ]
    (case,) = against.paired("b", *both)
    assert case.greater
    assert case.worse == worse


def test_a_checkout_that_tells_no_samples_is_compared_by_its_best_figure() -> None:
    old = figure(1.0)
    del old["case"]["samples"], old["case"]["by"]
    (case,) = against.paired("b", [old], [figure(1.04, 9.0, 9.0, by="median")])
    assert (case.before, case.after, case.chance) == (1.0, 1.04, None)


def test_figures_of_other_benchmarks_are_kept_while_the_commits_are_the_same(
    modules: Callable[[str], Any], tmp_path: Path
) -> None:
    results = modules("performance_results")
    first = replace(
        results.read_comparison(results.GOALS), cases=[results.Compared(name, "x", "ms", 1.0, 1.0) for name in "ab"]
    )
    again = replace(first, cases=[results.Compared("b", "x", "ms", 1.0, 0.5)])
    file = tmp_path / "goals.json"
    assert against.joined(file, again).cases == again.cases
    results.write_comparison(first, file)
    assert [(case.benchmark, case.after) for case in against.joined(file, again).cases] == [("a", 1.0), ("b", 0.5)]
    assert against.joined(file, replace(again, after="another")).cases == again.cases


STACKS = """\
main (a.py:1);Handle._run (asyncio/events.py:80);work (dmc41x3/twin/x.py:3);sum (numpy/y.py:1) 3
main (a.py:1);Handle._run (asyncio/events.py:80);work (dmc41x3/twin/x.py:4) 1
main (a.py:2) 5
"""


def test_a_flame_graph_has_the_shares_of_the_functions(modules: Callable[[str], Any]) -> None:
    flame = modules("flame_graph")
    work, part = flame.boxes(flame.calls_of(STACKS))
    assert [(box.function, box.row, box.share) for box in (work, part)] == [
        ("work (dmc41x3/twin/x.py)", 0, 1.0),
        ("sum (numpy/y.py)", 1, 0.75),
    ]
    assert part.width == pytest.approx(0.75 * work.width)
    assert flame.colour(work.function) != flame.colour(part.function)
    assert "sum (numpy/y.py): 75.0%" in flame.picture(STACKS, "a picture")
