"""The tests' own machinery catches what it promises to catch."""

from __future__ import annotations

import asyncio
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from dmc41x3.loops import run, run_virtual
from tests.campaign import Campaign, Ledger
from tests.conftest import _watched
from tests.conventions.source import ROOT
from tests.scheduling import in_order, scheduler
from tests.virtual_time import elapse


def campaign(name: str, *, long: bool = False, seed: int = 1) -> Campaign:
    return Campaign(name, seed, long, Ledger())


async def test_a_coroutine_runs_in_virtual_time() -> None:
    before = asyncio.get_running_loop().time()
    await elapse(3600.0)
    assert asyncio.get_running_loop().time() - before == 3600.0


def test_a_task_left_behind_fails_the_test() -> None:
    async def forgetful() -> None:
        left = asyncio.get_running_loop().create_task(elapse(5.0))
        assert not left.done()

    with pytest.raises(AssertionError, match="tasks left behind"):
        run_virtual(_watched(forgetful()))


def test_an_error_in_a_callback_fails_the_test() -> None:
    async def careless() -> None:
        asyncio.get_running_loop().call_soon(int, "seven")
        await elapse(1.0)

    with pytest.raises(AssertionError, match=r"errors nobody awaited.*seven"):
        run_virtual(_watched(careless()))


def test_time_is_not_waited_for_in_an_ordinary_loop() -> None:
    with pytest.raises(AssertionError, match="virtual time"):
        run(elapse(1.0))


def test_a_campaign_has_two_sizes_and_notes_the_one_it_took() -> None:
    short, long = campaign("a"), campaign("a", long=True)
    assert (short.size(ci=3, long=300), long.size(ci=3, long=300)) == (3, 300)
    assert long.ledger.sizes == {"a": 300}


def test_some_cases_are_drawn_and_in_the_long_run_all() -> None:
    cases = range(100)
    few, all_cases = campaign("a").some(cases, ci=3), campaign("a", long=True).some(cases, ci=3)
    assert len(set(few)) == 3
    assert sorted(all_cases) == list(cases)


def test_a_generator_depends_on_seed_test_and_case_only() -> None:
    drawn = campaign("a").rng().random()
    assert drawn == campaign("a").rng().random()
    others = [campaign("b").rng(), campaign("a", seed=2).rng(), campaign("a").rng(1)]
    assert drawn not in [other.random() for other in others]


@pytest.mark.parametrize("words", [["--seed", "5"], ["--seed=5"], ["-q", "--seed", "5", "--long"]])
def test_the_command_hands_seed_and_size_on_and_keeps_the_rest(words: list[str], tmp_path: Path) -> None:
    (tmp_path / "scripts").mkdir()
    (tmp_path / "scripts" / "setup.sh").write_text(
        f"venv={tmp_path}/venv\nbrowser=none\nfail() {{ exit 9; }}\n"
        "keep_bytecode() { :; }\nprovide_environment() { :; }\nprovide_clients() { :; }\n"
        "provide_command() { :; }\nprovide_broker() { :; }\n"
        "provide_scripts() { :; }\nprovide_ros() { :; }\nprovide_dds() { :; }\n"
        "browser_can_be() { :; }\n"
        "ros_can_be() { :; }\n",
        encoding="utf-8",
    )
    python = tmp_path / "venv" / "bin" / "python"
    python.parent.mkdir(parents=True)
    python.write_text('#!/bin/sh\necho "$MAYA_TEST_SEED ${MAYA_TEST_LONG-} $*"\n', encoding="utf-8")
    python.chmod(0o755)
    command = tmp_path / "test"
    command.write_text((ROOT / "test").read_text(encoding="utf-8"), encoding="utf-8")
    said = subprocess.run(["/bin/sh", command, *words, "x y"], capture_output=True, text=True, check=True, env={})
    quiet, long = ("-q ", "1") if "-q" in words else ("", "")
    assert said.stdout == f"5 {long} -m pytest {quiet}x y\n"


def test_workers_share_files_and_mix_those_that_start_programs() -> None:
    found = [
        "unit/a.py::a", "system/a.py::b", "system/b.py::c", "ros/a.py::d", "ros/shared/b.py::e", "unit/a.py::f",
        "conventions/a.py::g", "conventions/b.py::h",
    ]  # fmt: skip
    items: list[Any] = [SimpleNamespace(nodeid=f"tests/{nodeid}") for nodeid in found]
    assert "".join(item.nodeid[-1] for item in in_order(items)) == "ghdbecaf"
    shared = scheduler(SimpleNamespace(option=SimpleNamespace(), getvalue=lambda _: ["popen"]), None)
    scopes = [shared._split_scope(item.nodeid) for item in in_order(items)]
    assert (
        scopes
        == ["tests/conventions/"] * 2
        + [f"tests/{name}" for name in ("ros/a.py", "system/a.py", "ros/shared/", "system/b.py")]
        + ["tests/unit/a.py"] * 2
    )


def test_the_seed_must_be_a_number_or_random() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "--collect-only", "-q", "tests/conventions/test_test_tools.py"],
        cwd=ROOT,
        env={"MAYA_TEST_SEED": "abc"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == pytest.ExitCode.USAGE_ERROR
    assert "whole number or 'random'" in done.stderr
