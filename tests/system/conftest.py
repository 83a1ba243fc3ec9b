"""Commands in a test find no robot, no configuration and no log but the test's own."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest


def move_in(folder: Path, patch: pytest.MonkeyPatch) -> None:
    """Have commands keep everything in a folder."""
    patch.setenv("MAYA_RUNTIME_DIR", str(folder / "run"))
    patch.setenv("XDG_CONFIG_HOME", str(folder / "config"))
    patch.setenv("XDG_STATE_HOME", str(folder / "state"))


@pytest.fixture(scope="module", autouse=True)
def places_of_the_module(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Keep a robot that the tests of a module share from that of another module, which runs at the same time."""
    with pytest.MonkeyPatch.context() as patch:
        move_in(tmp_path_factory.mktemp("module"), patch)
        yield


@pytest.fixture(autouse=True)
def own_places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    move_in(tmp_path, monkeypatch)
    monkeypatch.delenv("MAYA_CONFIG", raising=False)
    monkeypatch.delenv("MAYA_LANG", raising=False)
    monkeypatch.delenv("MAYA_STATE_DIR", raising=False)
    monkeypatch.delenv("MAYA_TOKEN", raising=False)
    monkeypatch.delenv("MAYA_TOKEN_FILE", raising=False)
    monkeypatch.chdir(tmp_path)
