"""A secret that a test wrote anywhere fails the whole run."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conventions.source import ROOT
from tests.secrecy import PIECE, secret

TEST = """
def test_it(tmp_path):
    (tmp_path / "{name}").write_text("before {content} behind")
"""


@pytest.mark.parametrize(
    ("workers", "name", "content", "code"),
    [
        ("-n1", "maya.log", secret("key"), 1),
        ("-n0", "maya.log", secret("key"), 1),
        ("-n0", "maya.log", "." * (PIECE - 9) + secret("key"), 1),
        ("-n0", "maya.log", "nothing", 0),
        ("-n0", "maya.secret", secret("key"), 0),
    ],
)
def test_written_secrets_fail_the_run(workers: str, name: str, content: str, code: int, tmp_path: Path) -> None:
    (tmp_path / "test_it.py").write_text(TEST.format(name=name, content=content))
    options = ["-p", "tests.secrecy", "-p", "no:cacheprovider", workers, f"--basetemp={tmp_path / 'made'}"]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", *options, "test_it.py"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == code, done.stdout
    assert ("secrets found" in done.stdout) == (code == 1)
    assert (name in done.stdout) == (code == 1)
    (tmp_path / "test_it.py").unlink()
    for path in (tmp_path / "made").rglob(name):
        path.unlink()  # or the run of this test would fail for it
