"""The robot that these tests share. Their files run in the order of their names: the last one ends the master."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.ros.launched_layers import LaunchedLayers, launched_layers
from tests.ros.workspace import Workspace


@pytest.fixture(scope="package")
def shared(tmp_path_factory: pytest.TempPathFactory, workspace: Workspace) -> Iterator[LaunchedLayers]:
    """Return all layers of a robot."""
    with launched_layers(tmp_path_factory.mktemp("together"), workspace) as up:
        yield up


@pytest.fixture
def robot(shared: LaunchedLayers) -> Iterator[LaunchedLayers]:
    """Return the robot, homed and at rest; a test that leaves it otherwise is judged after the fact."""
    shared.ready()
    yield shared
    shared.unharmed()
