"""Programs written for the original: they run on our graph, and their types can be made by its Pythons."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from maya_ros.graph import types
from maya_ros.graph.table import TABLE, Kind
from tests.ros.harness import Ros
from tests.ros.workspace import PACKAGES

Run = Callable[..., subprocess.CompletedProcess[str]]

PROGRAM = '''
"""A program as the manual describes them: it compares events with constants, and uses the names of the manual."""

import math as m
import threading

import actionlib
import rospy
from geometry_msgs.msg import Point
from maya_controller.config import constants as c
from maya_controller.config import events
from maya_controller.msg import HomeAction, HomeGoal, MoveAction, MoveGoal
from maya_robot.msg import MayaPrimitive
from maya_robot.srv import MayaCommand
from std_msgs.msg import String
from std_srvs.srv import SetBool

unseen = {"HOMED", "MOVING", "IDLE", "GRIPPER_OPEN", "GRIPPER_CLOSED"}
seen_all = threading.Event()


def on_event(msg):
    unseen.difference_update([name for name in unseen if msg.data == getattr(events, name)])
    if not unseen:
        seen_all.set()
    assert (msg.data != events.HOMED) == (not msg.data.startswith("homed "))
    assert msg.data not in (events.FAULT, events.LIMIT), msg.data


def result_of(client, goal):
    # SimpleActionClient misses the end of a goal that ends before send_goal has returned
    result = None
    while result is None:
        client.send_goal_and_wait(goal, rospy.Duration(30.0), rospy.Duration(5.0))
        result = client.get_result()
    return result


rospy.init_node("original")
rospy.Subscriber("/maya_event", String, on_event)
home = actionlib.SimpleActionClient("/home", HomeAction)
move = actionlib.SimpleActionClient("/move", MoveAction)
for client in (home, move):
    client.wait_for_server()
homed = result_of(home, HomeGoal())
assert homed.success, homed.message
assert not c.A_0 < 0.0
goal = MoveGoal(a=m.radians(45), b=1.5, c=1.5)
moved = result_of(move, goal)
assert moved.success, moved.message
assert abs(rospy.wait_for_message("/maya_position", Point).x) > 0.1
rospy.wait_for_service("/gripper")
gripper = rospy.ServiceProxy("/gripper", SetBool)
assert gripper(False).success
assert gripper(True).success
assert not result_of(move, MoveGoal(a=45, b=1.5, c=1.5)).success
rospy.wait_for_service("/maya_command")
answer = rospy.ServiceProxy("/maya_command", MayaCommand)(MayaPrimitive(command=MayaPrimitive.CAN_TELEOP))
seen_all.wait(30.0)  # an event may come after the answer of the request that causes it
print("answer", answer.success, sorted(unseen))
'''


@pytest.mark.system
def test_a_program_of_the_original_compares_events_with_constants(ros: Ros, tmp_path: Path) -> None:
    ros.launch("maya_robot", "robot.launch")
    ros.until_nodes("/hw_simulator", "/robot_controller")
    file = tmp_path / "original.py"
    file.write_text(PROGRAM)
    said = ros.tool("/usr/bin/python3", str(file), within=120.0)
    assert "answer True []" in said


GENERATORS = Path("/usr/lib/genpy")
ACTIONS = Path("/usr/lib/actionlib_msgs/genaction.py")
SHARED = ("std_msgs", "actionlib_msgs", "geometry_msgs", "trajectory_msgs")
MODULES = ("genmsg", "genpy", "em.py", *SHARED)
"""Parts of ROS that run under Python 2 too, as Debian installs them for Python 3."""
USE = """
from io import BytesIO
from maya_process.msg import ProcessQueue
from maya_robot.msg import MayaPrimitive, TaskGoal
import maya_controller.msg, maya_controller.srv, maya_robot.srv, maya_process.srv
task = MayaPrimitive(command=MayaPrimitive.PICK)
task.target.x = 0.41
data = BytesIO()
ProcessQueue([TaskGoal(task).task]).serialize(data)
read = ProcessQueue().deserialize(data.getvalue()).tasks[0]
assert (read.command, read.target.x, read.open) == ("pick", 0.41, False), read
print(MayaPrimitive._md5sum)
print(maya_controller.msg.MoveAction._md5sum)
print(maya_robot.srv.MayaCommand._md5sum)
"""


@pytest.mark.parametrize("name", ["/usr/bin/python3", "python2.7", "python3.8"])
def test_messages_are_made_and_used_by_the_python_of_kinetic_and_noetic(name: str, tmp_path: Path) -> None:
    """Needs that Python with PyYAML; $MAYA_TEST_YAML is a folder with PyYAML for it."""
    python = shutil.which(name) or ""
    here = tmp_path / "ros"
    here.mkdir()
    for module in MODULES:
        (here / module).symlink_to(Path("/usr/lib/python3/dist-packages") / module)
    made = tmp_path / "made"
    path = os.pathsep.join([str(made), str(here), os.environ.get("MAYA_TEST_YAML", "")])
    environment = {"PATH": os.environ["PATH"], "PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"}

    def run(*words: str | Path) -> subprocess.CompletedProcess[str]:
        return subprocess.run([python, *words], env=environment, capture_output=True, text=True, check=False)

    if not python or run("-c", "import yaml").returncode:
        pytest.skip(f"there is no {name} with PyYAML")
    _make_all(run, tmp_path, made)
    done = run("-c", USE)
    move = next(row for row in TABLE if row.form is Kind.ACTION and row.name == "/move")
    sums = [types.md5sum("maya_robot/MayaPrimitive"), types.md5sum(f"{move.type}Action")]
    assert done.stdout.split() == [*sums, types.service_md5sum("maya_robot/MayaCommand")], done.stderr


def _make_all(run: Run, folder: Path, made: Path) -> None:
    """Make the modules of all message packages, as catkin does."""
    packages = ("maya_controller", "maya_robot", "maya_process")
    includes = [word for name in SHARED for word in ("-I", f"{name}:/usr/share/{name}/msg")]
    for package in packages:
        definitions = folder / "msg" / package
        shutil.copytree(PACKAGES / package / "msg", definitions)
        includes += ["-I", f"{package}:{definitions}"]
        for action in sorted((PACKAGES / package).glob("action/*.action")):
            done = run(ACTIONS, action, "-o", definitions)
            assert done.returncode == 0, done.stderr
    for package in packages:
        (made / package).mkdir(parents=True)
        (made / package / "__init__.py").touch()
        _make(run, package, "msg", sorted((folder / "msg" / package).glob("*.msg")), made, includes)
        _make(run, package, "srv", sorted((PACKAGES / package / "srv").glob("*.srv")), made, includes)


def _make(run: Run, package: str, form: str, files: list[Path], made: Path, includes: list[str]) -> None:
    target = made / package / form
    target.mkdir()
    done = run(GENERATORS / f"gen{form}_py.py", "-p", package, "-o", target, *includes, *files)
    assert done.returncode == 0, done.stderr
    names = sorted(path.stem for path in target.glob("_[A-Z]*.py"))
    (target / "__init__.py").write_text("".join(f"from .{name} import *\n" for name in names))
