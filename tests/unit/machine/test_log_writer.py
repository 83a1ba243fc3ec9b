"""The mechanics' record as lines of JSON: each thing once, in order, and the sums of the record itself."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any

import pytest

from maya_un.machine.log_writer import MechanicsRecordWriter
from maya_un.machine.mechanics import MayaMechanics
from tests.unit.machine.test_mechanics import A, B, go, powered, run, settle


class Lines:
    """The lines that a chronicle wrote."""

    def __init__(self, maya: MayaMechanics) -> None:
        self.all: list[dict[str, Any]] = []
        self.maya = maya
        self.chronicle = MechanicsRecordWriter(maya, self._add, epoch=1e9)

    def _add(self, text: str) -> None:
        assert text.endswith("\n")
        assert text.count("\n") == 1
        self.all.append(json.loads(text))

    def of(self, *kinds: str) -> list[dict[str, Any]]:
        return [line for line in self.all if line["kind"] in kinds]

    def run(self, until: float) -> None:
        """Advance to `until` [s], and look every 50 ms as the served twin does."""
        while self.maya.now < until:
            run(self.maya, min(until, self.maya.now + 0.05))
            self.chronicle.look()


def test_chronicle_begins_with_the_machine_itself() -> None:
    maya = powered(part=(0.3, 0.4, 0.1))
    [start] = Lines(maya).all
    assert start["kind"] == "start"
    assert (start["time"], start["epoch"], start["format"]) == (0.0, 1e9, 1)
    assert start["joints"] == [1.0, 1.25, 1.25]
    assert start["parts"] == {"part": [0.3, 0.4, 0.1]}
    assert start["truth"]["torque_per_load"] == maya.truth.torque_per_load


def test_chronicle_writes_motion_without_gaps_and_nothing_at_rest() -> None:
    maya = powered()
    lines = Lines(maya)
    lines.run(1.0)
    assert len(lines.all) == 1
    end = go(maya, A, 20_000.0)
    lines.run(end + 1.0)
    motions = lines.of("motion")
    assert [line["since"] for line in motions[1:]] == [line["time"] for line in motions[:-1]]
    assert all(line["time"] - line["since"] <= 0.1 for line in motions)
    assert motions[0]["since"] <= 1.05
    assert end <= motions[-1]["time"] <= end + 0.1
    assert motions[-1]["joints"] == pytest.approx(maya.true_joints(), abs=1e-12)


def test_chronicle_writes_a_stall_at_once_and_sums_as_the_record_does() -> None:
    maya = powered()
    lines = Lines(maya)
    lines.run(go(maya, B, -600_000.0, 200_000.0) + 0.5)  # the lines are tight after 500 mm
    [contact] = lines.of("contact")
    assert contact["axes"] == ["b"]
    lines.run(go(maya, B, 600_000.0, 200_000.0) + 0.5)
    assert [line["axes"] for line in lines.of("contact")] == [["b"], []]
    motions, whole = lines.of("motion"), maya.record.whole
    assert max(line["tension"] for line in motions) == whole.tension
    assert sum(line["stalled"][B] for line in motions) == pytest.approx(whole.stalled[B])
    assert whole.stalled[B] > 0.5
    total = motions[-1]["total"]
    assert total.pop("drops") == 0
    assert total == json.loads(json.dumps({key: value for key, value in asdict(whole).items() if key != "drops"}))
    assert [line["time"] for line in lines.all] == sorted(line["time"] for line in lines.all)


def test_chronicle_writes_the_gripper_and_a_drop() -> None:
    maya = powered()
    maya.output(1, True)  # open
    x, y, z = maya.gripper_point()
    maya.add_part("part", (x, y, z))
    lines = Lines(maya)
    maya.output(1, False)
    settle(maya, B, -100_000.0, 200_000.0)  # lifts it
    maya.output(1, True)
    assert [line["kind"] for line in lines.all] == ["start", "grip", "motion", "release", "drop"]
    grip, release, drop = lines.of("grip", "release", "drop")
    assert (grip["part"], grip["carried"], grip["closed"]) == ("part", "part", True)
    assert (release["part"], release["carried"], release["closed"]) == ("part", None, False)
    assert drop["height"] == maya.record.drops[0].height > 0.005
    assert drop["place"] == release["place"]
    lines.run(maya.now + 0.1)
    assert lines.all[-1]["kind"] == "drop"
