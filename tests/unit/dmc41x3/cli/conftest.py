"""Each command is given to `dmc` and to `maya dmc`, and finds no robot and no files but the test's own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from dmc41x3.cli import main as dmc
from maya_un.cli import main as maya


@pytest.fixture(autouse=True)
def own_places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MAYA_RUNTIME_DIR", str(tmp_path / "run"))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    for name in ("DMC_ADDRESS", "DMC_LANG", "MAYA_CONFIG", "MAYA_LANG"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture(params=["dmc", "maya dmc"])
def run(request: pytest.FixtureRequest) -> Callable[[Sequence[str]], int]:
    """Carries out a command line behind `dmc` or `maya dmc`, and returns its exit code."""
    return dmc.main if request.param == "dmc" else lambda line: maya.main(["dmc", *line])
