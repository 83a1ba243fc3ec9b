"""The work of `scripts/bench --peers`, at its smallest size and without the other programs."""

from __future__ import annotations

import sys
from math import cos, sin
from pathlib import Path

import numpy as np
import pytest

from benchmarks.peers import kinematics, queues, timing
from benchmarks.peers.contest import Contest, Floats, rows
from maya_un.config import Config
from maya_un.kinematics import Workspace
from scripts.performance_results import OURS
from tests.conventions.source import ROOT


@pytest.fixture(autouse=True)
def others_are_not_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in the environment of the tests; and the benchmarks find one another, as `scripts/bench` lets them."""
    for name in ("ikpy.chain", "pinocchio", "roboticstoolbox", "ruckig", "toppra.algorithm", "persistqueue"):
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))


def measured(contest: Contest) -> None:
    """Everybody who is there has a figure."""
    found = rows(contest, rounds=1)
    assert [row.error for row in found] == [""] * len(found)
    assert found[0].program == OURS


def test_the_chain_of_the_others_is_mayas_mechanism() -> None:
    places = kinematics.Places(Workspace.of(Config()).mechanism, 50)
    for joints, point in zip(places.joints, places.points, strict=True):
        chain = places.chain(joints)
        met = _end(places, chain)
        assert places.hung(met) == pytest.approx(np.array(point), abs=1e-12)
        assert places.met(point) == pytest.approx(met, abs=1e-12)
        assert places.maya(chain, met) == pytest.approx(np.array(joints), abs=1e-12)


def _end(places: kinematics.Places, chain: kinematics.Chain) -> Floats:
    """The end of a boom that turns and of a line that hangs from it at an angle."""
    a, beta, b = chain
    d = places.mechanism.delta + b * cos(beta)
    return np.array((d * sin(a), d * cos(a), places.mechanism.height - b * sin(beta)))


def test_kinematics_are_measured_without_the_others() -> None:
    left_out: dict[str, str] = {}
    contests = kinematics.contests(left_out, count=2)
    for contest in contests:
        measured(contest)
    assert set(left_out) == {"ikpy", "pinocchio", "roboticstoolbox"}


def test_motions_are_timed_without_the_others() -> None:
    left_out: dict[str, str] = {}
    for contest in timing.contests(left_out):
        durations = [side.answer() for side in contest.sides]
        assert [side.program for side in contest.sides] == [OURS, timing.PROVEN]
        assert abs(durations[0] - durations[1]) <= contest.tolerance
    assert set(left_out) == {"ruckig", "toppra"}


def test_a_motion_of_another_program_must_keep_the_limits() -> None:
    start, end, slow = np.array(timing.START), np.array(timing.END), np.zeros((2, 3))
    timing.must_keep(np.array([start, end]), slow, start, end)
    with pytest.raises(AssertionError, match="faster"):
        timing.must_keep(np.array([start, end]), slow + 1.1 * timing.SPEED, start, end)
    with pytest.raises(AssertionError, match="end"):
        timing.must_keep(np.array([start, start]), slow, start, end)


def test_jobs_are_still_there_when_the_journal_is_opened_again(tmp_path: Path) -> None:
    left_out: dict[str, str] = {}
    with queues.stores(tmp_path, left_out) as opened:
        assert list(opened) == [OURS]
        store = opened[OURS]
        store.fill(30)
        store.submit(2, each=3)
        assert sorted(store.kept()) == sorted(f"tray {number}" for number in range(1, 37))
        store.submit(1, each=1)
        assert len(store.kept()) == 37
    assert set(left_out) == {"persist-queue"}


def test_every_size_of_a_queue_is_measured(tmp_path: Path) -> None:
    found = list(queues.growth(tmp_path, (1, 10), {}))
    assert [(one.program, one.size) for one in found] == [(OURS, 1), (OURS, 10)]
    assert all(one.cost > 0.0 for one in found)


def test_a_job_of_every_size_has_so_many_tasks_and_can_be_repeated() -> None:
    from benchmarks.peers import work

    for size in (2, 500, 1_000):
        job = work.round_trip(size)
        assert (len(job.steps) - 1) * job.repeat == size  # without homing
    found = list(work.tasks((2,)))
    assert [one.size for one in found] == [2]


def test_states_reach_every_reader_of_both_servers() -> None:
    from benchmarks.peers import streams

    readers = streams.Readers(2, seconds=0.5, share=0.01)  # other tests run at the same time
    try:
        measured(readers.contest())
    finally:
        readers.close()


def test_the_command_is_measured_and_the_queue_server_is_left_out_without_redis(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from benchmarks.peers import commands

    monkeypatch.setenv("PATH", "/nowhere")
    left_out: dict[str, str] = {}
    with commands.contests(left_out) as (wall, used):
        measured(wall)
        measured(used)
    assert left_out == {
        "bluesky-queueserver": "bluesky-queueserver needs Debian's redis-server, which is not installed here"
    }
