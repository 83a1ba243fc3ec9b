from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import pytest

from dmc41x3.conformance import Demand, vectors
from dmc41x3.conformance.vectors import Special, VectorStep, load

WHOLE = {
    "name": "it",
    "source": "GE",
    "certainty": "two",
    "axes": [2, 4],
    "demands": ["moves"],
    "setup": ["@ready", "CN 1"],
    "restore": ["CN -1"],
    "keep": ["SPA"],
    "whole": True,
    "udp": "no",
    "steps": [
        ["A\r", ":", "?"],
        {"wait": 0.5},
        {"until": "B\r", "expect": "x", "seconds": 2},
        {"record": "QR\r", "fields": [[2, "H", 1, 2], [4, "B", 0, 0, 3]]},
        {"close": "two"},
        {"closed": "three"},
        {"send": "C\r", "expect": ["1", "2"], "on": "two", "times": 3},
    ],
}


def table(folder: Path, entry: Mapping[str, object]) -> None:
    shared = {"sources": {"G": "this", "E": "that"}, "setups": {"ready": ["SH", "DP 0"]}}
    (folder / "shared.json").write_text(json.dumps(shared), "utf-8")
    (folder / "some.json").write_text(json.dumps([entry]), "utf-8")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(vectors, "TABLE", tmp_path)
    monkeypatch.setattr(vectors, "load", load.__wrapped__)
    return tmp_path


def test_an_entry_is_read_whole(folder: Path) -> None:
    table(folder, WHOLE)
    (vector,) = vectors.load()
    assert (vector.name, vector.group, vector.sources, vector.certainty) == ("it", "some", "GE", "two")
    assert [vector.fits(axes) for axes in (1, 2, 4, 5)] == [False, True, True, False]
    assert vector.demands == {Demand.MOVES}
    assert (vector.setup, vector.restore, vector.keep) == (("SH", "DP 0", "CN 1"), ("CN -1",), ("SPA",))
    assert (vector.whole, vector.udp) == (True, "no")
    assert vector.steps == (
        VectorStep("A\r", (":", "?")),
        VectorStep(special=Special.WAIT, seconds=0.5),
        VectorStep("B\r", ("x",), special=Special.UNTIL, seconds=2),
        VectorStep("QR\r", special=Special.RECORD, fields=((2, "H", 1, 2, 0), (4, "B", 0, 0, 3))),
        VectorStep(special=Special.CLOSE, on="two"),
        VectorStep(special=Special.CLOSED, on="three"),
        VectorStep("C\r", ("1", "2"), on="two", times=3),
    )


@pytest.mark.parametrize(
    "wrong",
    [
        {"certainty": "sure"},
        {"colour": "blue"},
        {"demands": ["money"]},
        {"setup": ["@nowhere"]},
        {"steps": [{"foo": 1}]},
    ],
)
def test_an_entry_that_is_not_understood_is_named(folder: Path, wrong: dict[str, object]) -> None:
    table(folder, WHOLE | wrong)
    with pytest.raises(ValueError, match=r"some\.json: it: "):
        vectors.load()
