"""Python of versions 2 and 3: what is found in single lines, and that any text is read."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_ros.migration import commands, markup, python
from maya_ros.migration.finding import ScriptFinding
from maya_ros.migration.original import Severity

HEAD = """\
import math
import rospy, actionlib, gclib
from std_msgs.msg import String, Empty
from maya_controller.config import constants as c, events
from maya_controller.msg import *
from maya_robot.msg import MayaPrimitive as Task
"""


def found(text: str) -> list[tuple[int, str]]:
    """Return line and rule of the findings to change or check below `HEAD`, counted from 1 behind it."""
    return lines([*python.read(HEAD + text)], HEAD.count("\n"))


def lines(findings: list[ScriptFinding], before: int = 0) -> list[tuple[int, str]]:
    return sorted({(one.line - before, one.key) for one in findings if one.kind is not Severity.SAME})


@pytest.mark.parametrize(
    ("line", "rules"),
    [
        ("MoveGoal(a=90, b=1.5, c=1.2)", ["degrees"]),
        ("MoveGoal(-90.0, 1.5, 1.2)", ["degrees"]),
        ("MoveGoal(math.degrees(1.2), 1.5, 1.2)", ["degrees"]),
        ("MoveGoal(math.radians(90), 1.5, 1.2)", []),
        ("MoveGoal(a=c.A_MAX, b=1.5, c=1.2)", []),
        ("MoveGoal(a=0, b=1.5, c=1.2)", []),
        ("MoveGoal(a=1.2, b=1.5, c=1.2)", ["degrees-maybe"]),
        ("MoveGoal(alpha=1, b=1.5, c=1.2)", ["field"]),
        ("MoveGoal()", []),
        ("MoveGoal(*joints)", []),
        ("MoveGoal(**joints)", []),
        ("MoveGoal(1.2)", ["arguments"]),
        ("Task('pick')", ["arguments"]),
        ("Task(command='PICK')", ["primitive"]),
        ("Task(command=Task.PICK)", []),
        ("Task.OPEN", []),
        ("c.B_MAX, c.SIGMA", []),
        ("c.MAX_B", ["constant"]),
        ("c.B_MAX = 2", ["constant-set"]),
        ("from maya_controller.config import SP_A", ["constant-place"]),
        ("from maya_controller import config; config.SP_A, config.constants.SP_A", ["constant-place"]),
        ("events.ESTOP", []),
        ("events.EMERGENCY", ["event-word"]),
        ("rospy.Publisher('/send_task', Task)", []),
        ("rospy.Publisher('send_task', String)", ["type"]),
        ("rospy.Publisher('/maya_event', String)", ["second-publisher"]),
        ("rospy.Subscriber('/maya_events', String, print)", ["name"]),
        ("actionlib.SimpleActionClient('/move', MoveAction)", []),
        ("actionlib.SimpleActionClient('/move', HomeAction)", ["type"]),
        ("actionlib.SimpleActionServer('/home', HomeAction, f)", ["second-publisher"]),
        ("rospy.wait_for_message('/maya_event', String).data == 'idle'", ["event-text"]),
        ("g = gclib.py(); g.GAssign('a', 'b')", ["gclib-missing"]),
        ("g = gclib.py(); g.GCommand('MG _LFB'); g.GCommand('TV')", ["limit-operand"]),
        ("g = gclib.py(); g.GCommand('XX')", ["dmc"]),
        ("g = gclib.py(); g.GCommand('XX' + n)", []),
        ("from maya_controller.config.constants import SP_A, SP_D", ["constant"]),
        ("from maya_controller.config.events import read, HOMED, OPENED", ["event-word"]),
        ("from maya_controller.msg import Positions", ["type-unknown"]),
        ("import maya_robot.inv_kin_calculator as ik; ik.joints(1, 2, 3); ik.inverse(1)", ["function", "nodes-python"]),
        ("import maya_process.firebase_bridge", ["module"]),
        ("import os; os.system('roslaunch maya_robot robot.launch --sim_mode:=true')", ["launch-dashes"]),
        ("xs = xrange(3); d.has_key(1)", ["python-2-names"]),
        ("reduce = len; reduce(x)", []),
        ("from six.moves import xrange; xrange(3)", []),
    ],
)
def test_a_line_is_judged(line: str, rules: list[str]) -> None:
    assert [rule for _, rule in found(line)] == rules


@pytest.mark.parametrize(
    "line",
    [
        "print goal, MoveGoal(90, 1, 1)", "print >>f, MoveGoal(90, 1, 1)", "print 'x' % MoveGoal(90, 1, 1)",
        "if x <> MoveGoal(90, 1, 1): pass", "raise ValueError, MoveGoal(90, 1, 1)", "n = 0777; MoveGoal(90, 1, 1)",
        "n = 10L; MoveGoal(90, 1, 1)", "s = ur'a'; MoveGoal(90, 1, 1)", "`MoveGoal(90, 1, 1)`",
        "exec MoveGoal(90, 1, 1)", "try: pass\nexcept E, e: MoveGoal(90, 1, 1)", "def f((a, b)): MoveGoal(90, 1, 1)",
        "print",
    ],
)  # fmt: skip
def test_python_2_is_one_finding_and_hides_nothing(line: str) -> None:
    rules = sorted(rule for _, rule in found(f"print 'old'\n{line}"))
    assert rules == (["python-2"] if line == "print" else ["degrees", "python-2"])


def test_a_message_is_followed_through_names_and_callbacks() -> None:
    assert found(
        "class Demo:\n"
        "    def __init__(self):\n"
        "        self.client = actionlib.SimpleActionClient('/home', HomeAction)\n"
        "        rospy.Subscriber('/maya_event', String, self.heard)\n"
        "        rospy.Subscriber('/hardware_sensor', RawSensorData, self.sensed)\n"
        "        rospy.Subscriber('/chatter', String, self.chat)\n"
        "    def heard(self, event):\n"
        "        text = event.data\n"
        "        return text == 'homed' or event.data == events.IDLE\n"
        "    def sensed(self, event):\n"
        "        return event.position, event.torque\n"
        "    def chat(self, event):\n"
        "        return event.data != 'homed'\n"
        "    def run(self):\n"
        "        result = self.client.get_result()\n"
        "        return result.success, result.homed, self.client.get_result().done\n"
    ) == [(9, "event-text"), (11, "field"), (16, "field")]


SHELL = [
    ("roslaunch maya_process process.launch sim_mode:=false", []),
    ("roslaunch maya_process process.launch sim:=false", ["launch-argument"]),
    ("roslaunch maya_ui ui.launch", ["launch-file"]),
    ("rosrun maya_process process_controller.py", []),
    ("rosrun maya_controller home.py && echo", ["program"]),
    ("$ rostopic pub -r 10 /stop_queue std_msgs/Empty '{}'", []),
    ("rostopic pub /stop_queue std_msgs/Bool 'data: true'", ["type"]),
    ("rosservice call /maya_command '{task: {command: home}}'", []),
    ("rosservice call /maya_command '{command: home}'", ["message"]),
    ("rosservice call /gripper '{data: [1'", []),
    ("  # rosservice call /maya_command '{command: home}'", []),
    ("echo 'unbalanced; roslaunch maya_ui x.launch", ["launch-file"]),
    ("apt-get install ros-kinetic-desktop", ["apt"]),
    ("python3 demo.py", []),
    ("/usr/bin/env python2.7 demo.py", ["python-command"]),
    ("sudo pip install gclib", ["galilsuite"]),
    ('say "run scripts/ros; roslaunch maya_robot robot.launch"', []),
]


@pytest.mark.parametrize(("line", "rules"), SHELL)
def test_a_shell_line_is_judged(line: str, rules: list[str]) -> None:
    assert [rule for _, rule in lines([*commands.read_shell(line)])] == rules


def test_a_command_over_two_lines_is_one() -> None:
    text = "echo\nroslaunch maya_robot \\\n  robot.launch \\\n  --sim_mode:=true\n"
    assert lines([*commands.read_shell(text)]) == [(2, "launch-dashes")]


READERS = [
    python.read, commands.read_shell, commands.read_dmc, commands.read_cmake, markup.read_launch, markup.read_package,
    lambda text: commands.read_definition(text, "MayaPrimitive"),
]  # fmt: skip
PIECES = st.lists(
    st.sampled_from(
        ["MoveGoal(", "a=", "90", ")", "msg.data", " == ", "'homed'", "events.", "c.", "print ", "\n", "    ",
         "import ", "from maya_robot", ".msg", " import *", "rospy.Subscriber('/maya_event', String, f", "def f(",
         "self", "):", "lambda ", "[", "]", "{", "}", ",", ".", "\\", '"""', "`", "<>", "x = ", "gclib.py()",
         ".GCommand('", "_LFA", ";", "<launch>", "<include file='$(find maya_robot)/launch/", "/>",
         "roslaunch maya_robot ", ":=", "---", "#", "0777", "ur'", "\x00"]
    ), max_size=30,
).map("".join)  # fmt: skip


@pytest.mark.parametrize("number", range(len(READERS)))
@given(text=PIECES | st.text(max_size=80))
def test_any_text_is_read(number: int, text: str) -> None:
    for one in READERS[number](text):
        assert one.line >= 1
        assert all(sentence or one.rule is None for sentence in one.sentences("en"))
