"""A test that keeps the alarm of its time limit to itself, or never ends its fixtures, cannot hold up the run."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conventions.source import ROOT

STUBBORN = """
import threading, pytest
def wait():
    while True:
        try:
            threading.Event().wait()
        except BaseException:
            pass
@pytest.fixture
def held():
    yield
    wait()
@pytest.mark.timeout(1.0)
def test_first(): wait()
@pytest.mark.timeout(1.0)
def test_second(held): raise ValueError
def test_third(): pass
"""


@pytest.mark.waits("2 s or 4 s until the last limits of one test or two tests are over")
@pytest.mark.parametrize("workers", ["-n0", "-n1"])
def test_that_never_ends_is_ended_and_named(workers: str, tmp_path: Path) -> None:
    (tmp_path / "test_stubborn.py").write_text(STUBBORN)
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-p",
        "tests.hard_timeout",
        "-p",
        "no:cacheprovider",
        workers,
        "-rA",
        tmp_path,
    ]
    done = subprocess.run(
        command, cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert "in wait" in done.stderr
    if workers == "-n1":
        assert "while running 'test_stubborn.py::test_first'" in done.stdout
        assert "while running 'test_stubborn.py::test_second'" in done.stdout
        assert "1 passed" in done.stdout.splitlines()[-1]
