"""A master that hangs or ends: commands are still answered, and stop the robot. These tests end the shared master."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.ros.harness import Ros
from tests.ros.launched_layers import LaunchedLayers

pytestmark = pytest.mark.system

MAYA = str(Path(sys.executable).with_name("maya"))
NOTHING_TO_RECOVER, MASTER_GONE = "2108", "5011"
SLOW = 0.02
"""Share of the speed at which a motion outlasts the end of a master."""


@pytest.fixture
def robot(shared: LaunchedLayers) -> LaunchedLayers:
    """Return the robot, homed and at rest; without a master, nothing can ask its mechanics afterwards."""
    shared.ready()
    return shared


def maya(ros: Ros, *words: str) -> subprocess.CompletedProcess[str]:
    """Return how a command ends."""
    return subprocess.run([MAYA, *words], env=ros.environment, capture_output=True, text=True, timeout=40, check=False)


def moving(robot: LaunchedLayers) -> int:
    """Have the robot move; return the number of earlier messages."""
    robot.at_speed(SLOW)
    before = robot.mark()
    robot.begun("approach", robot.away())
    return before


def submit(ros: Ros) -> None:
    """Submit a job, by which the queue asks for /task."""
    job = ros.folder / "job.yaml"
    job.write_text("name: late\nsteps:\n  - approach: [0.5, 1.2, 0.4]\n")
    said = maya(ros, "job", "submit", str(job))
    assert said.returncode == 0, said.stderr


def require_answers(ros: Ros) -> None:
    """Fail where a command is not answered that must be, whatever the master does."""
    for command in ("stop", "status", "queue"):
        said = maya(ros, command)
        assert said.returncode == 0, (command, said.stderr)


def test_with_a_master_that_hangs_stop_status_and_queue_are_answered(robot: LaunchedLayers) -> None:
    """The queue asks for /task for the first time while the master hangs."""
    before = moving(robot)
    with robot.ros.frozen_master():
        submit(robot.ros)
        require_answers(robot.ros)
        robot.until_told("stopped", before)
        require_answers(robot.ros)
    robot.at_rest()
    robot.unharmed()


def test_without_a_master_a_first_motion_is_refused_and_stop_is_answered(robot: LaunchedLayers) -> None:
    """The queue's node first asks for /controller/follow after the master's end, and for services never called."""
    before = moving(robot)
    robot.ros.lose_master()
    for command in ("pause", "resume"):
        assert maya(robot.ros, command).returncode == 0
    robot.until_told("resumed", before)
    require_answers(robot.ros)
    robot.until_told("stopped", before)
    assert MASTER_GONE in maya(robot.ros, "jog", "z", "10mm").stderr
    assert NOTHING_TO_RECOVER in maya(robot.ros, "recover").stderr
    require_answers(robot.ros)
