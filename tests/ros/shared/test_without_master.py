"""A master that hangs or ends: commands are still answered, and stop the robot. These tests end the shared master."""

from __future__ import annotations

import pytest

from tests.ros.harness import Ros
from tests.ros.launched_layers import LaunchedLayers

pytestmark = pytest.mark.system

NOTHING_TO_RECOVER, MASTER_GONE = "2108", "5011"


@pytest.fixture
def robot(shared: LaunchedLayers) -> LaunchedLayers:
    """Return the robot, homed and at rest; without a master, nothing can ask its mechanics afterwards."""
    shared.ready()
    return shared


def submit(ros: Ros) -> None:
    """Submit a job, by which the queue asks for /task."""
    job = ros.folder / "job.yaml"
    job.write_text("name: late\nsteps:\n  - approach: [0.5, 1.2, 0.4]\n")
    said = ros.maya("job", "submit", str(job))
    assert said.returncode == 0, said.stderr


def require_answers(ros: Ros) -> None:
    """Fail where a command is not answered that must be, whatever the master does."""
    for command in ("stop", "status", "queue"):
        said = ros.maya(command)
        assert said.returncode == 0, (command, said.stderr)


def test_with_a_master_that_hangs_stop_status_and_queue_are_answered(robot: LaunchedLayers) -> None:
    """The queue asks for /task for the first time while the master hangs."""
    before = robot.moving()
    with robot.ros.frozen_master():
        submit(robot.ros)
        require_answers(robot.ros)
        robot.until_told("stopped", before)
        require_answers(robot.ros)
    robot.at_rest()
    robot.unharmed()


def test_without_a_master_a_first_motion_is_refused_and_stop_is_answered(robot: LaunchedLayers) -> None:
    """The queue's node first asks for /controller/follow after the master's end, and for services never called."""
    before = robot.moving()
    robot.ros.lose_master()
    for command in ("pause", "resume"):
        assert robot.ros.maya(command).returncode == 0
    robot.until_told("resumed", before)
    require_answers(robot.ros)
    robot.until_told("stopped", before)
    assert MASTER_GONE in robot.ros.maya("jog", "z", "10mm").stderr
    assert NOTHING_TO_RECOVER in robot.ros.maya("recover").stderr
    require_answers(robot.ros)
