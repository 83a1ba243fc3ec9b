"""Commands in a test find no robot, no configuration and no log but the test's own."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def own_places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MAYA_RUNTIME_DIR", str(tmp_path / "run"))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.delenv("MAYA_CONFIG", raising=False)
    monkeypatch.delenv("MAYA_LANG", raising=False)
    monkeypatch.delenv("MAYA_STATE_DIR", raising=False)
    monkeypatch.delenv("MAYA_TOKEN", raising=False)
    monkeypatch.delenv("MAYA_TOKEN_FILE", raising=False)
    monkeypatch.chdir(tmp_path)
