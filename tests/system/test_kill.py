"""SIGKILL at random instants of running jobs: no job is lost, nothing is done twice, nothing is silently left out.

The robot runs in a separate process, in virtual time, with its queue in a real file (`kill_worker`, which checks the
choices of each restart). The mechanics' ledger alone records the facts.
"""

from __future__ import annotations

import select
import signal
from dataclasses import dataclass
from math import dist
from pathlib import Path
from random import Random
from typing import Any

import pytest

from tests.campaign import Campaign
from tests.fork_server import WarmPopen
from tests.journals import looked_up
from tests.system.kill_worker import Ledger, Plan, plan

GROUPS = 10
"""The campaign is cut into so many tests."""

INSTANTS = 400
"""A process is killed within so many statements and facts of its life, ..."""

STARTING = 0.15
"""... or, so often, while it comes up ..."""

LONGEST_START = 2.0
"""... within this time [s]."""

EXACT = 5e-4
"""A part is put down so near to where it was to be [m]: counts of the boom are 0.1 mm apart there."""


def lives(folder: Path, seed: int, kill: Random | None) -> bool:
    """Run a worker, until it is killed at a random instant where `kill` draws it; return whether it was."""
    worker = WarmPopen(["-m", "tests.system.kill_worker", str(folder), str(seed)], errors=folder / "stderr")
    with worker.stdout as said:
        if kill is not None:
            _until_the_instant(said, kill)
            worker.kill()
        while said.read(65536):
            pass
    code = worker.wait()
    assert code in {0, -signal.SIGKILL}, (folder / "stderr").read_text(encoding="utf-8")
    return code != 0


def _until_the_instant(said: Any, rng: Random) -> None:
    """Return after a number of bytes and a moment, or at the end of the output."""
    if rng.random() < STARTING:
        select.select([], [], [], rng.uniform(0.0, LONGEST_START))
        return
    left = rng.randrange(1, INSTANTS)
    while left > 0:
        piece = said.read(left)
        if not piece:
            return
        left -= len(piece)
    select.select([], [], [], rng.expovariate(1e3))


@dataclass(frozen=True, slots=True)
class Outcome:
    """The ledger's facts about the jobs of a plan."""

    jobs: Plan
    ledger: Ledger

    @property
    def given_up(self) -> set[str]:
        """The jobs that a person gave up."""
        return {line["job"] for line in self.ledger.of("said") if line["choice"] == "abort"}

    def carried(self, part: str) -> list[tuple[str, Any]]:
        """Return the gripper's actions on a part, in order."""
        return [(line["what"], line["place"]) for line in self.ledger.of("open", "close") if line["part"] == part]

    def require(self) -> None:
        """Every part was picked and placed at the planned positions, once, in order, and never fell."""
        for name, carries in self.jobs.items():
            wanted = [(kind, place) for leg in carries for kind, place in (("close", leg.here), ("open", leg.there))]
            found = self.carried(carries[0].part)
            if name in self.given_up:
                assert len(found) <= len(wanted)
            else:
                assert [kind for kind, _ in found] == [kind for kind, _ in wanted], name
            for (_, place), (_, there) in zip(found, wanted, strict=False):
                assert dist(place, there) < EXACT
        assert not [line for line in self.ledger.of("open") if line["fell"]]
        assert not [line for line in self.ledger.of("close") if line["part"] is None], "a pick of nothing"


def judge(folder: Path, seed: int) -> None:
    """Compare what is kept with what happened."""
    ledger = Ledger(folder)
    outcome = Outcome(plan(seed), ledger)
    outcome.require()
    kept = dict(looked_up(folder / "maya.db", "SELECT name, state FROM jobs WHERE name LIKE 'job%'"))
    assert kept == {name: "cancelled" if name in outcome.given_up else "done" for name in outcome.jobs}
    accepted = {line["number"]: line["job"] for line in ledger.of("accepted")}
    assert dict(looked_up(folder / "maya.db", "SELECT id, name FROM jobs WHERE name LIKE 'job%'")) == accepted
    skipped = {(line["job"], line["index"]) for line in ledger.of("said") if line["choice"] == "skip"}
    steps = looked_up(
        folder / "maya.db", "SELECT name, \"index\", steps.state FROM steps JOIN jobs ON jobs.id = job WHERE key <> ''"
    )
    for name, index, state in steps:
        if name not in outcome.given_up:
            assert state == "done" or (state == "skipped" and (name, index) in skipped), (name, index, state)


@pytest.mark.system
@pytest.mark.parametrize("group", range(GROUPS))
def test_whenever_it_is_killed_every_part_is_carried_once(campaign: Campaign, tmp_path: Path, group: int) -> None:
    kills, case = campaign.size(ci=2, long=50), 0
    while kills > 0:
        case += 1
        rng, seed = campaign.rng(case), 1000 * group + case
        folder = tmp_path / str(case)
        folder.mkdir()
        killed = True
        while killed and kills > 0:
            killed = lives(folder, seed, rng)
            kills -= killed
        if killed:
            lives(folder, seed, None)
        judge(folder, seed)


def test_a_line_that_a_kill_tore_is_dropped(tmp_path: Path) -> None:
    written = tmp_path / "ledger.jsonl"
    written.write_bytes(b'{"what": "up", "at": [0.5, 1.5, 1.5]}\n{"what": "clo')
    assert [line["what"] for line in Ledger(tmp_path).lines] == ["up"]
    Ledger(tmp_path).write("homed")
    assert [line["what"] for line in Ledger(tmp_path).lines] == ["up", "homed"]
