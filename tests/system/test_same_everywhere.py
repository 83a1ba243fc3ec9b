"""The same job dry, scaled, and in real time over TCP: same steps, same ends, the duration as predicted."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from maya_un.controller.monitor import SETTLED
from tests.system.processes import done, running

pytestmark = pytest.mark.system

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
PICK, SORT = EXAMPLES / "01_pick_and_place.yaml", EXAMPLES / "02_sort_grid.yaml"


def report(line: str, within: float = 50.0) -> dict[str, Any]:
    """Return the report of a `maya run`."""
    code, text = done(f"run {line} --json", within)
    assert code == 0, text
    return json.loads(text)


def assert_same(one: dict[str, Any], other: dict[str, Any]) -> None:
    """Both ran the same steps to the same ends; an end is read while the axes settle, under load a little later."""
    assert one["state"] == other["state"] == "done"
    for first, second in zip(one["steps"], other["steps"], strict=True):
        assert [first[key] for key in ("index", "step", "state", "code")] == [
            second[key] for key in ("index", "step", "state", "code")
        ]
        assert first["end_counts"] == pytest.approx(second["end_counts"], abs=SETTLED)


@pytest.mark.waits("about 7 s and 19 s of two whole jobs at fifty times real speed, which is what is tested")
@pytest.mark.parametrize("path", [PICK, SORT], ids=lambda path: path.stem)
def test_scaled_is_as_dry(path: Path) -> None:
    assert_same(report(f"{path} --dry-run --seed 7"), report(f"{path} --speed 50 --seed 7"))


@pytest.mark.waits("about 350 s of a whole job in real time, which is what is tested")
@pytest.mark.long
@pytest.mark.timeout(900)
def test_real_time_over_tcp_is_as_dry() -> None:
    dry = report(f"{PICK} --dry-run --seed 7")
    with running(f"dmc serve --port 0 --seed 7 --table {PICK}") as twin:
        address = twin.until(":")
        real = report(f"{PICK} --address {address}", within=880.0)
    assert_same(dry, real)
    # On a busy machine each of the hundreds of replies of a homing comes a little later.
    assert dry["duration"] == pytest.approx(real["duration"], rel=0.05)
    for first, second in zip(dry["steps"], real["steps"], strict=True):
        assert first["duration"] == pytest.approx(second["duration"], rel=0.05)
