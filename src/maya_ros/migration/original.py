"""The original stack (technical manual, 2019) and what replaces each part of it here. This is the only list.

The manual gives the names of the original, but not the fields of its messages. So fields are compared with the present
definitions, and everything that does not fit is reported. A rule holds its sentences for `maya migrate` and the row of
the table in docs/how-to/move-from-the-original.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType

from dmc41x3.i18n import marked

PACKAGES = ("maya_controller", "maya_robot", "maya_process", "maya_ui")
"""The packages of the original; all of them exist here."""

EVENT_TOPIC = "/maya_event"

RENAMED = MappingProxyType({"/maya_events": EVENT_TOPIC})
"""Names of topics that the manual prints, by the names that exist."""

LAUNCH: Mapping[str, frozenset[str]] = MappingProxyType(
    {
        "maya_controller/controller.launch": frozenset(
            {"gui", "core_debug", "rvizconfig", "sim_mode", "skip_home", "address", "speed", "ns"}
        ),
        "maya_robot/robot.launch": frozenset({"core_debug", "sim_mode", "skip_home", "address", "speed", "ns"}),
        "maya_process/process.launch": frozenset(
            {"core_debug", "sim_mode", "skip_home", "custom_gui", "skip_firebase", "address", "speed", "ros2", "ns"}
        ),
    }
)
"""The launch files, all of which the original had, and their arguments here."""

PROGRAMS: Mapping[str, frozenset[str]] = MappingProxyType(
    {
        "maya_controller": frozenset({
            "hardware_interface.py", "sensor_converter.py", "hw_simulator.py", "describe.py", "joint_gui.py",
            "joint_sliders.py", "on_display.py",
        }),
        "maya_robot": frozenset({"primitive_server.py", "robot_controller.py"}),
        "maya_process": frozenset({
            "firebase_bridge.py", "process_controller.py", "ros_coms.py", "ros2.py", "rosbridge.py",
            "firebase_coms_launcher.sh",
        }),
        "maya_ui": frozenset({"maya_ui.py"}),
    }
)  # fmt: skip
"""The programs that rosrun and launch files find here, by package."""

MODULES: Mapping[str, frozenset[str]] = MappingProxyType(
    {
        "maya_controller.config": frozenset({"constants", "events"}),
        "maya_controller.config.events": frozenset({"read"}),
        "maya_robot.inv_kin_calculator": frozenset({"joints", "place"}),
        "maya_robot.model": frozenset({"model"}),
        "maya_controller.simulation.virtual_maya": frozenset({"virtual_maya"}),
    }
)
"""Modules of the original that scripts can import here, with their functions. Constants and words come on top."""

NODE_PYTHON = frozenset(
    {"maya_robot.inv_kin_calculator", "maya_robot.model", "maya_controller.simulation.virtual_maya"}
)
"""Modules that only the Python of the nodes can import, because they import `maya_un`."""


class Severity(StrEnum):
    """Meaning of a finding: to change, to check by a person, or to leave as it is."""

    CHANGE = "change"
    CHECK = "check"
    SAME = "same"


@dataclass(frozen=True, slots=True)
class Rule:
    """A difference: `why` and `instead` are sentences whose details a finding fills in.

    `old` is the first cell of its row in the documentation; the other cells are the sentences with `example`.
    """

    key: str
    old: str
    why: str
    instead: str
    kind: Severity = Severity.CHANGE
    example: Mapping[str, str] = field(default_factory=dict[str, str])


_CONVERT = marked(
    "Convert the whole file: `2to3 -w FILE` (package 2to3 of Debian and Ubuntu); under Python 3.13 or newer `pip "
    "install fissix` and `python3 -m fissix -w FILE`. Check divisions: 1/2 is 0.5 in Python 3. Then run `maya "
    "migrate` again."
)

PYTHON_2 = Rule(
    "python-2", "Python 2.7",
    marked("This file is not valid Python 3 (line {at}: {reason}), and this ROS runs Python 3."),
    _CONVERT,
    example={"at": "7", "reason": "Missing parentheses in call to 'print'"},
)  # fmt: skip
PYTHON_2_NAMES = Rule(
    "python-2-names", "`raw_input`, `xrange`, `unicode`, `.iteritems()`, `import Queue`",
    marked("Python 3 has no {names}."),
    _CONVERT,
    example={"names": "raw_input"},
)  # fmt: skip
SHEBANG = Rule(
    "shebang", "`#!/usr/bin/env python`",
    marked("Debian and Ubuntu have no command {name}, except in a virtual environment."),
    marked("Write `#!/usr/bin/env python3`."),
    example={"name": "python"},
)  # fmt: skip
EVENT_TEXT = Rule(
    "event-text", "`msg.data == 'homed'` on /maya_event",
    marked("A message on /maya_event is a word, a space and a JSON object with the state. It never equals the word."),
    marked("Compare with the constant `events.{constant}` (`from maya_controller.config import events`): it equals "
    "every message that begins with its word. Or compare the word: `msg.data.split(' ')[0] == '{word}'`."),
    example={"constant": "HOMED", "word": "homed"},
)  # fmt: skip
EVENT_KEY = Rule(
    "event-key", "`HANDLERS[msg.data]` on /maya_event",
    marked("A message on /maya_event is a word, a space and a JSON object, so it is no key of a dictionary or a set of "
    "words."),
    marked("Read the word first: `word, state = events.read(msg.data)` (`from maya_controller.config import events`), "
    "and look up `word`."),
)  # fmt: skip
EVENT_WORD = Rule(
    "event-word", "`events.OPENED`, a constant that is not there",
    marked("`maya_controller.config.events` has no {name}."),
    marked("Take one of: {known}."),
    example={"name": "OPENED", "known": "GRIPPER_OPEN, GRIPPER_CLOSED, …"},
)  # fmt: skip
DEGREES = Rule(
    "degrees", "`MoveGoal(a=90, …)`, degrees at /move",
    marked("The original took `a` in degrees. /move takes radians: it refuses this value, or goes to another angle."),
    marked("Write {new}."),
    example={"new": "`math.radians(90)`"},
)  # fmt: skip
DEGREES_MAYBE = Rule(
    "degrees-maybe", "`MoveGoal(a=angle, …)`, an angle of unknown unit",
    marked("The original took `a` in degrees, /move takes radians. The unit of {value} is not known here."),
    marked("If it is in degrees, write `math.radians({value})`."),
    Severity.CHECK, example={"value": "angle"},
)  # fmt: skip
FIELD = Rule(
    "field", "fields of messages, services and actions",
    marked("{type} has no field {name}."),
    marked("Its fields are: {known}."),
    example={"type": "maya_robot/MayaPrimitive", "name": "position", "known": "command, target, open"},
)  # fmt: skip
ARGUMENTS = Rule(
    "arguments", "`MayaPrimitive('pick', 0.4, 1.1, 0.4)`, values by position",
    marked("{type} has {expected} fields, and {given} values are given by position. rospy raises TypeError."),
    marked("Give values by name. The fields are: {known}."),
    example={"type": "maya_robot/MayaPrimitive", "expected": "3", "given": "4", "known": "command, target, open"},
)  # fmt: skip
PRIMITIVE = Rule(
    "primitive", "other commands than those of the manual",
    marked("There is no primitive {name}. Names are in small letters."),
    marked("Take one of: {known}."),
    example={"name": "Pick", "known": "home, pick, place, approach, gripper, can_teleop, line, move"},
)  # fmt: skip
CONSTANT = Rule(
    "constant", "constants that are not in the manual",
    marked("`maya_controller.config.constants` has no {name}."),
    marked("Take one of: {known}."),
    example={"name": "MAX_TENSION", "known": "MAYA_HEIGHT, DELTA, …"},
)  # fmt: skip
CONSTANT_PLACE = Rule(
    "constant-place", "`from maya_controller.config import SP_A`",
    marked("`maya_controller.config` is a package, and has no {name} itself."),
    marked("Import it from `maya_controller.config.constants`."),
    example={"name": "SP_A"},
)  # fmt: skip
CONSTANT_SET = Rule(
    "constant-set", "editing `constants.py`, or `constants.SP_A = 2000`",
    marked("The module only shows the configuration. An assignment changes this program alone, not the robot."),
    marked("Set `{key}` in the configuration file (`maya config init` writes it), and start again."),
    example={"key": "axes.a.speed_counts"},
)  # fmt: skip
MODULE = Rule(
    "module", "`from maya_controller.hardware import _home`, inner modules",
    marked("The module {name} has nothing for scripts here: nodes are programs, and their code is in `maya_un`."),
    marked("Use the topics, services and actions, such as /home. "
    "These modules remain: {known}."),
    example={"name": "maya_controller.hardware", "known": "maya_controller.config, …"},
)  # fmt: skip
FUNCTION = Rule(
    "function", "`from maya_robot.inv_kin_calculator import validate_ws`",
    marked("The module {module} has no {name}."),
    marked("It has: {known}. To check a point from any Python, call `/call_operation` with the operation `reach`."),
    example={"module": "maya_robot.inv_kin_calculator", "name": "validate_ws", "known": "joints, place"},
)  # fmt: skip
NODES_ONLY = Rule(
    "nodes-python", "`from maya_robot import inv_kin_calculator`",
    marked("{module} imports `maya_un`, which only the Python of the nodes has (`.venv-ros`). Its angles are radians. "
    "It raises `maya_un.errors.Unreachable`, not ValueError."),
    marked("Run the script under that Python, or call `/call_operation` with the operation `reach`."),
    Severity.CHECK, example={"module": "maya_robot.inv_kin_calculator"},
)  # fmt: skip
NAME = Rule(
    "name", "`/maya_events`",
    marked("Nothing is published on {old}."),
    marked("Write {new}."),
    example={"old": "/maya_events", "new": "/maya_event"},
)  # fmt: skip
TYPE = Rule(
    "type", "another type for a name of the graph",
    marked("{name} has the type {expected}, not {given}. ROS does not connect them."),
    marked("Use {expected}."),
    example={"name": "/gripper", "expected": "std_srvs/SetBool", "given": "Gripper"},
)  # fmt: skip
OWN_NAME = Rule(
    "second-publisher", "a node of your own for /maya_event, /home, /move …",
    marked("A node of Maya publishes or serves {name} already. A second one misleads the other nodes, or takes its "
    "place."),
    marked("Publish on another name, or leave Maya's node ({node}) out."),
    Severity.CHECK, example={"name": "/maya_event", "node": "hw_simulator or hardware_interface"},
)  # fmt: skip
TYPE_UNKNOWN = Rule(
    "type-unknown", "types of the original that are not in the manual",
    marked("The package {package} has no type {name}."),
    marked("Take one of: {known}."),
    example={"package": "maya_robot", "name": "Position", "known": "MayaPrimitive, MayaCommand, Task"},
)  # fmt: skip
DEFINITION = Rule(
    "definition", "a copy of `MayaPrimitive.msg` in your package",
    marked("This is another definition of {type} than Maya's. Its md5 sum differs, so ROS connects neither side."),
    marked("Delete this file, depend on {package} and use its type. Its fields are: {known}."),
    example={"type": "maya_robot/MayaPrimitive", "package": "maya_robot", "known": "command, target, open"},
)  # fmt: skip
LAUNCH_DASHES = Rule(
    "launch-dashes", "`roslaunch … --sim_mode:=false`",
    marked("roslaunch takes no dashes before an argument, and refuses them as an unknown option."),
    marked("Write `{new}`."),
    example={"new": "sim_mode:=false"},
)  # fmt: skip
LAUNCH_ARGUMENT = Rule(
    "launch-argument", "arguments of launch files that are not in the manual",
    marked("{file} has no argument {name}. roslaunch refuses it in an include, and ignores it on the command line."),
    marked("Take one of: {known}."),
    example={"file": "maya_controller/controller.launch", "name": "sim", "known": "sim_mode, skip_home, …"},
)  # fmt: skip
LAUNCH_FILE = Rule(
    "launch-file", "other launch files",
    marked("The package {package} has no launch file {name}."),
    marked("Take one of: {known}."),
    example={"package": "maya_ui", "name": "ui.launch", "known": "maya_process/process.launch, …"},
)  # fmt: skip
PROGRAM = Rule(
    "program", "other programs, for example `hw_interface.py`",
    marked("The package {package} has no program {name}."),
    marked("Take one of: {known}."),
    example={"package": "maya_controller", "name": "hw_interface.py", "known": "hardware_interface.py, …"},
)  # fmt: skip
STATE_PUBLISHER = Rule(
    "state-publisher", '`type="state_publisher"`',
    marked("robot_state_publisher has no program state_publisher any more."),
    marked('Write `type="robot_state_publisher"`; or include controller.launch, which starts it.'),
)  # fmt: skip
XACRO = Rule(
    "xacro", "`$(find xacro)/xacro.py`",
    marked("Debian's ROS has no package xacro, and later ROS has no xacro.py."),
    marked('Write `command="rosrun maya_controller describe.py FILE"`; the dimensions are those of the configuration.'),
)  # fmt: skip
USE_GUI = Rule(
    "use-gui", "joint_state_publisher with `use_gui`",
    marked("joint_state_publisher has no window any more; it ignores `use_gui`."),
    marked("Include controller.launch with `gui` true: it opens a window with sliders."),
)  # fmt: skip
ROSBRIDGE = Rule(
    "rosbridge", "rosbridge_server beside Maya",
    marked("process.launch serves rosbridge on port 9090. Debian's ROS has no rosbridge_server, and the port "
    "is in use."),
    marked("Leave it out; the node rosbridge of process.launch serves the same protocol."),
)  # fmt: skip
OLD_PACKAGE = Rule(
    "old-package", "the packages of the original in your workspace",
    marked("This is the package {name} of the original. catkin refuses two packages of one name."),
    marked("Take this folder out of the workspace; the package of this project has its place. Keep your own scripts in "
    "a package of another name."),
    example={"name": "maya_robot"},
)  # fmt: skip
ROSBUILD = Rule(
    "rosbuild", "`stack.xml`, `manifest.xml`",
    marked("catkin reads only package.xml; rosbuild is gone."),
    marked("Write a package.xml (format 2) for each package, and delete this file. Maya's metapackage is maya_ros_un."),
)  # fmt: skip
BROKEN_XML = Rule(
    "xml", "XML that is not well-formed",
    marked("This file is not well-formed XML: {reason}."),
    marked("Correct it; roslaunch and catkin refuse it too."),
    example={"reason": "mismatched tag, line 12"},
)  # fmt: skip
APT = Rule(
    "apt", "`apt install ros-kinetic-…`",
    marked("ROS Kinetic exists for Ubuntu 16.04 only."),
    marked("Run `scripts/ros`: it installs the ROS 1 of Debian 12 or Ubuntu 24.04."),
)  # fmt: skip
SETUP = Rule(
    "setup", "`source /opt/ros/kinetic/setup.bash`",
    marked("The ROS of Debian and Ubuntu is installed in /usr and needs no such file."),
    marked("Delete the line; `source ~/catkin_ws/devel/setup.bash` is enough."),
)  # fmt: skip
CLONE = Rule(
    "clone", "`git clone --recurse-submodules …/Maya-ROS-UN.git`",
    marked("That repository holds the original. This project has no submodules."),
    marked("Clone this project, then run `scripts/ros ~/catkin_ws`."),
)  # fmt: skip
COMS = Rule(
    "ros-coms", "`roscd maya_process/src/ros-coms`, `yarn start`, `npm run start`, `tsc`",
    marked("ros-coms is no program of Node.js any more."),
    marked("Run `maya coms`, with the same variables PORT, IP and NAME. process.launch starts it unless skip_firebase "
    "is true. It needs no Node.js."),
)  # fmt: skip
GALILSUITE = Rule(
    "galilsuite", "`galilsuite`, installing gclib",
    marked("Neither GalilSuite nor gclib is needed."),
    marked("Type commands in `maya dmc terminal HOST`. For scripts with gclib, run `maya dmc gclib install`."),
)  # fmt: skip
PYTHON_COMMAND = Rule(
    "python-command", "`python script.py`",
    marked("Debian and Ubuntu have no command {name}, except in a virtual environment."),
    marked("Write `python3`."),
    Severity.CHECK, example={"name": "python"},
)  # fmt: skip
MESSAGE = Rule(
    "message", '`rostopic pub /maya_move …`, `rosservice call /gripper "…"`',
    marked("{name} does not accept this message: {reason}"),
    marked("Its fields are: {known}."),
    example={
        "name": "/maya_move", "known": "command, target, open",
        "reason": "position of maya_robot/MayaPrimitive is not valid: it is no field.",
    },
)  # fmt: skip
GCLIB = Rule(
    "gclib", "`import gclib`",
    marked("The calls work unchanged: Maya has a module gclib with the same names."),
    marked("Run `maya dmc gclib run SCRIPT`, or once `maya dmc gclib install`. While Maya runs, only read: "
    "motion and changed registers are faults (2312, 2313)."),
    Severity.SAME,
)  # fmt: skip
GCLIB_MISSING = Rule(
    "gclib-missing", "`GAssign`, `GIpRequests`, `GFirmwareDownload`, `GSetupDownloadFile`",
    marked("Maya's module gclib does not offer {name}."),
    marked("Use Galil's own tools for this, while Maya does not run."),
    example={"name": "GAssign"},
)  # fmt: skip
SWITCH = Rule(
    "limit-operand", "`lim=_LFA;lim=`, `MG _LRB`",
    marked("{name} is 0 while the switch is active and 1 while it is free; the manual says the opposite."),
    marked("Compare with 0. Over ROS, read `forward_limit` and `reverse_limit` of /hardware_sensor: true is active."),
    Severity.CHECK, example={"name": "_LFA"},
)  # fmt: skip
WIRING = Rule(
    "limit-polarity", "`CN 1`, `CN -1`",
    marked("Maya sets CN from the configuration when it connects. A change by another program is a fault (2312). "
    "Homing finds switches that contradict the configuration."),
    marked("Delete the command; set `wiring.limit_active_level` in the configuration to {level}."),
    example={"level": "1 (`CN 1`) or -1 (`CN -1`)"},
)  # fmt: skip
DYNAMICS = Rule(
    "dynamics", "`SP`, `AC`, `DC`",
    marked("Maya sets {name} from the configuration when it connects. A change by another program is a fault (2312)."),
    marked("Set `axes.a.{key}` (b, c alike) in the configuration; for one motion, give the step of a job "
    "`speed: 50 %`."),
    Severity.CHECK, example={"name": "SP", "key": "speed_counts"},
)  # fmt: skip
GRIPPER = Rule(
    "gripper-output", "`CB1`, `SB1`",
    marked("The output of the gripper and its direction are configuration (`gripper.output`, `gripper.closed_by`). CB1 "
    "closes and SB1 opens with the default values."),
    marked("Call the service /gripper (true opens), or run `maya gripper open`. Then events and state are right too."),
    Severity.CHECK,
)  # fmt: skip
MOTORS_OFF = Rule(
    "motors-off", "`MO`",
    marked("With the motors off, drums that are not self-locking let the load sink."),
    marked("To stop, run `maya stop` or call /controller/stop. A message on /stop_queue also cancels all jobs."),
    Severity.CHECK,
)  # fmt: skip
ABORT = Rule(
    "abort", "`AB`",
    marked("AB stops without deceleration and ends every program in the controller, the guard of Maya included."),
    marked("Run `maya stop`; `maya abort` if there is no other way."),
    Severity.CHECK,
)  # fmt: skip
MOTION = Rule(
    "raw-motion", "`PA`, `PR`, `JG`",
    marked("Nobody checks this motion against the workspace, the lines or the tension. While Maya runs, it is a "
    "fault (2313): Maya stops it, and the robot must be homed again."),
    marked("Use the action /move or the command `maya move A B C`; to move along one axis, `maya jog AXIS DISTANCE`."),
    Severity.CHECK,
)  # fmt: skip
DMC = Rule(
    "dmc", "commands that a DMC-41x3 does not have",
    marked("{text} is not a command of a DMC-41x3: {reason}."),
    marked("Look it up: `help TP` in `maya dmc terminal` explains a command, here TP."),
    example={"text": "`XX 1`", "reason": "Unrecognized command"},
)  # fmt: skip

RULES: tuple[Rule, ...] = tuple(value for value in list(globals().values()) if isinstance(value, Rule))
"""Every rule, in the order of the table in the documentation."""

REMAINS = "remains"
"""Key of findings of the kind `same` that name something which works as before."""
