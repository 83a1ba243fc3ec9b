"""A ROS for tests that need one; without one they are skipped with the reason."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.ros import workspace as workspaces
from tests.ros.driver_client import Driver
from tests.ros.harness import Ros
from tests.ros.launched_layers import LaunchedLayers, launched_layers
from tests.ros.workspace import Workspace, clean_environment

HERE = Path(__file__).parent
OTHER_PYTHON = "#!/bin/sh\necho 'this is no Python for ROS' >&2\nexit 1\n"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Skip tests that need a ROS if there is none; all tests in this folder need one."""
    reason = workspaces.missing()
    for item in items:
        if reason is not None and HERE in item.path.parents:
            item.add_marker(pytest.mark.skip(reason=f"no ROS: {reason}"))


def pytest_collection_finish(session: pytest.Session) -> None:
    """Build the packages before the first test that needs them, whose time it would take."""
    if any(needs_ros(item) for item in session.items) and workspaces.missing() is None:
        workspaces.provide()


def needs_ros(item: pytest.Item) -> bool:
    return HERE in item.path.parents and "workspace" in getattr(item, "fixturenames", ())


@pytest.fixture(scope="session")
def workspace() -> Workspace:
    """Return the packages, built."""
    return workspaces.provide()


@pytest.fixture
def ros(tmp_path: Path, workspace: Workspace) -> Iterator[Ros]:
    """Return a ROS of the test's own."""
    with Ros(tmp_path, workspace) as own:
        yield own


@pytest.fixture
def driver(ros: Ros) -> Driver:
    """Return a node that obeys the test."""
    return ros.driver()


@pytest.fixture(scope="module")
def launched(tmp_path_factory: pytest.TempPathFactory, workspace: Workspace) -> Iterator[LaunchedLayers]:
    """Return all layers of a robot that the tests of a module share."""
    with launched_layers(tmp_path_factory.mktemp("launched"), workspace) as up:
        yield up


@pytest.fixture
def robot(launched: LaunchedLayers) -> LaunchedLayers:
    """Return that robot, homed, at rest and at full speed."""
    launched.ready()
    return launched


@pytest.fixture
def other_python(tmp_path: Path) -> str:
    """Return a PATH whose first python3 is one that knows nothing of ROS, as pyenv's does not."""
    shims = tmp_path / "shims"
    shims.mkdir()
    for name in ("python", "python3"):
        (shims / name).write_text(OTHER_PYTHON)
        (shims / name).chmod(0o755)
    return f"{shims}:{clean_environment()['PATH']}"
