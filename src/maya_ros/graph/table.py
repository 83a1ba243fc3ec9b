"""Every topic, service and action of Maya: names, types, publishers and subscribers. This is the only list.

The manual's chapter Communications fixes names and types; `Row.manual` is False for additions to it. Units are SI.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from maya_un.service.access.operations import Operation
from maya_un.steps.text import COMMAND_TOPIC, RESULT_TOPIC, ROBOT_TOPIC, STATUS_TOPIC, TEXT_TYPE


class Kind(StrEnum):
    """Kind of a row of the table."""

    TOPIC = "topic"
    SERVICE = "service"
    ACTION = "action"


class Layer(StrEnum):
    """The layer that publishes, receives or serves a row."""

    CONTROLLER = "controller"
    SENSORS = "sensors"
    ROBOT = "robot"
    PROCESS = "process"
    BRIDGE = "bridge"
    ROS2 = "ROS 2"


@dataclass(frozen=True, slots=True)
class Row:
    """One name of the graph.

    `heard` is true if the layer subscribes to the topic instead of publishing it. `sources` and `sinks` are the nodes
    on either side by the manual. `latch` stores the last message for later subscribers. `rate` is the rate of
    publishing a topic [Hz], 0 for publishing at every change. `manual` is False for additions to the manual. `asks` is
    the operation that the row requests, of several the one for the lowest role; None if the row only informs.
    """

    name: str
    form: Kind
    type: str
    layer: Layer
    summary: str
    sources: tuple[str, ...] = ()
    sinks: tuple[str, ...] = ()
    heard: bool = False
    latch: bool = False
    queue_size: int = 100
    rate: float = 0.0
    manual: bool = True
    asks: Operation | None = None

    @property
    def nodes(self) -> tuple[str, ...]:
        """The nodes that offer the row, by the manual."""
        return self.sinks if self.heard else self.sources


HARDWARE = ("hw_simulator", "hardware_interface")
SENSOR = ("hw_simulator", "sensor_converter")

EVENT = Row(
    "/maya_event", Kind.TOPIC, "std_msgs/String", Layer.CONTROLLER, "events, each with the current state of the robot",
    HARDWARE, ("robot_controller", "maya_dashboard"), latch=True,
)  # fmt: skip
POSITION = Row(
    "/maya_position", Kind.TOPIC, "geometry_msgs/Point", Layer.SENSORS, "the gripper point [m], after homing",
    SENSOR, ("robot_controller", "maya_dashboard"), latch=True, queue_size=1, rate=50.0,
)  # fmt: skip
SENSORS = Row(
    "/hardware_sensor", Kind.TOPIC, "maya_controller/RawSensorData", Layer.SENSORS, "measurements of the controller",
    ("sensor_converter",), ("sensor_converter",), queue_size=1, rate=50.0,
)  # fmt: skip
JOINTS = Row(
    "/joint_states", Kind.TOPIC, "sensor_msgs/JointState", Layer.SENSORS, "a, b, c and the joints of the shown model",
    SENSOR, ("robot_state_publisher",), queue_size=1, rate=50.0, manual=False,
)  # fmt: skip
DIAGNOSTICS = Row(
    "/diagnostics", Kind.TOPIC, "diagnostic_msgs/DiagnosticArray", Layer.CONTROLLER, "status of each layer",
    ("hw_simulator", "hardware_interface", "robot_controller", "process_controller"), queue_size=10, rate=1.0,
    manual=False,
)  # fmt: skip
MARKERS = Row(
    "/maya_markers", Kind.TOPIC, "visualization_msgs/MarkerArray", Layer.SENSORS, "lines, part, path, workspace",
    SENSOR, ("rviz",), latch=True, queue_size=10, manual=False,
)  # fmt: skip
GRIPPER = Row(
    "/gripper", Kind.SERVICE, "std_srvs/SetBool", Layer.CONTROLLER, "open the gripper if true, else close it",
    HARDWARE, ("robot_controller",),
    asks=Operation.COMMAND,
)  # fmt: skip
OUTPUT = Row(
    "/controller/output", Kind.SERVICE, "maya_controller/SetOutput", Layer.CONTROLLER,
    "switch a digital output that `controller.outputs` lists", HARDWARE, ("robot_controller",), manual=False,
    asks=Operation.COMMAND,
)  # fmt: skip
HOME = Row(
    "/home", Kind.ACTION, "maya_controller/Home", Layer.CONTROLLER, "home the axes",
    HARDWARE, ("robot_controller",),
    asks=Operation.COMMAND,
)  # fmt: skip
MOVE = Row(
    "/move", Kind.ACTION, "maya_controller/Move", Layer.CONTROLLER, "move to joints a, b, c [rad, m, m]",
    HARDWARE, ("robot_controller",),
    asks=Operation.COMMAND,
)  # fmt: skip
FOLLOW = Row(
    "/controller/follow", Kind.ACTION, "maya_controller/Follow", Layer.CONTROLLER, "follow a path",
    HARDWARE, ("robot_controller",),
    asks=Operation.COMMAND,
)  # fmt: skip
COMMAND = Row(
    "/controller/command", Kind.TOPIC, "trajectory_msgs/JointTrajectory", Layer.CONTROLLER,
    "follow a path; /maya_event reports refusals", (), HARDWARE, heard=True, queue_size=1, manual=False,
    asks=Operation.COMMAND,
)  # fmt: skip
STOP = Row(
    "/controller/stop", Kind.SERVICE, "std_srvs/Trigger", Layer.CONTROLLER, "brake on the path at once",
    HARDWARE, ("robot_controller",),
    asks=Operation.STOP,
)  # fmt: skip
RECOVER = Row(
    "/controller/recover", Kind.SERVICE, "std_srvs/Trigger", Layer.CONTROLLER, "clear a fault; moves nothing",
    HARDWARE, ("robot_controller",),
    asks=Operation.RECOVER,
)  # fmt: skip
PAUSE = Row(
    "/controller/pause", Kind.SERVICE, "std_srvs/Trigger", Layer.CONTROLLER, "brake on the path and hold all motion",
    HARDWARE, ("robot_controller",), manual=False,
    asks=Operation.PAUSE,
)  # fmt: skip
RESUME = Row(
    "/controller/resume", Kind.SERVICE, "std_srvs/Trigger", Layer.CONTROLLER, "resume motion after a pause",
    HARDWARE, ("robot_controller",), manual=False,
    asks=Operation.RESUME,
)  # fmt: skip
ABORT = Row(
    "/controller/abort", Kind.SERVICE, "std_srvs/Trigger", Layer.CONTROLLER, "stop without deceleration",
    HARDWARE, ("robot_controller",), manual=False,
    asks=Operation.ABORT,
)  # fmt: skip
SPEED = Row(
    "/controller/speed", Kind.TOPIC, "std_msgs/Float64", Layer.CONTROLLER, "scale the speed of all motion, 0.01 to 1",
    ("robot_controller",), HARDWARE, heard=True, queue_size=1, manual=False,
    asks=Operation.SPEED,
)  # fmt: skip
PRIMITIVE = Row(
    "/maya_move", Kind.TOPIC, "maya_robot/MayaPrimitive", Layer.ROBOT, "execute a primitive; the topic form of /task",
    (), ("robot_controller",), heard=True, queue_size=10,
    asks=Operation.COMMAND,
)  # fmt: skip
MAYA_COMMAND = Row(
    "/maya_command", Kind.SERVICE, "maya_robot/MayaCommand", Layer.ROBOT,
    "execute a primitive, then answer; can_teleop answers at once", ("robot_controller",), ("process_controller",),
    asks=Operation.COMMAND,
)  # fmt: skip
TASK = Row(
    "/task", Kind.ACTION, "maya_robot/Task", Layer.ROBOT, "execute a primitive", ("primitive_server",),
    ("process_controller",),
    asks=Operation.COMMAND,
)  # fmt: skip
SEND_TASK = Row(
    "/send_task", Kind.TOPIC, "maya_robot/MayaPrimitive", Layer.PROCESS, "append one primitive to the queue",
    ("maya_dashboard",), ("process_controller",), heard=True,
    asks=Operation.PROPOSE,
)  # fmt: skip
START_QUEUE = Row(
    "/start_queue", Kind.TOPIC, "maya_process/ProcessQueue", Layer.PROCESS, "append primitives as one job",
    ("maya_dashboard",), ("process_controller",), heard=True,
    asks=Operation.PROPOSE,
)  # fmt: skip
STOP_QUEUE = Row(
    "/stop_queue", Kind.TOPIC, "std_msgs/Empty", Layer.PROCESS,
    "stop all motion, homing included, and cancel all jobs; for a role without `clear`: stop, and pause the queue",
    ("maya_dashboard",), ("process_controller",), heard=True,
    asks=Operation.STOP,
)  # fmt: skip
QUEUE_STATUS = Row(
    "/queue_status", Kind.TOPIC, "std_msgs/String", Layer.PROCESS, "the state of the queue, as JSON",
    ("process_controller",), ("maya_dashboard",), latch=True, queue_size=10, manual=False,
)  # fmt: skip
RESUME_QUEUE = Row(
    "/resume_queue", Kind.SERVICE, "std_srvs/Trigger", Layer.PROCESS, "continue a paused queue",
    ("process_controller",), ("maya_dashboard",), manual=False,
    asks=Operation.RESUME,
)  # fmt: skip
RECOVER_QUEUE = Row(
    "/recover_queue", Kind.SERVICE, "maya_process/RecoverQueue", Layer.PROCESS, "decide about an interrupted job",
    ("process_controller",), ("maya_dashboard",), manual=False,
    asks=Operation.RESTART,
)  # fmt: skip
CALL_OPERATION = Row(
    "/call_operation", Kind.SERVICE, "maya_process/CallOperation", Layer.PROCESS,
    "call any operation of the service by its name; it needs the right to that operation", ("process_controller",),
    manual=False,
    asks=Operation.READ,
)  # fmt: skip
STEP_COMMAND = Row(
    COMMAND_TOPIC, Kind.TOPIC, TEXT_TYPE, Layer.BRIDGE, "a step of a process, as JSON",
    ("ros_coms",), ("firebase_bridge",), heard=True,
    asks=Operation.COMMAND,
)  # fmt: skip
STEP_RESULT = Row(
    RESULT_TOPIC, Kind.TOPIC, TEXT_TYPE, Layer.BRIDGE, "the result of a step, as JSON",
    ("firebase_bridge",), ("ros_coms",),
)  # fmt: skip
STEP_STATUS = Row(
    STATUS_TOPIC, Kind.TOPIC, TEXT_TYPE, Layer.BRIDGE, "the acceptance or start of a step, as JSON",
    ("firebase_bridge",), ("ros_coms",), manual=False,
)  # fmt: skip
STEP_ROBOT = Row(
    ROBOT_TOPIC, Kind.TOPIC, TEXT_TYPE, Layer.BRIDGE, "the robot that carries out steps, as JSON",
    ("firebase_bridge",), ("ros_coms",), latch=True, queue_size=1, manual=False,
)  # fmt: skip

TABLE = (
    EVENT, POSITION, SENSORS, PRIMITIVE, SEND_TASK, START_QUEUE, STOP_QUEUE, STEP_COMMAND, STEP_RESULT,
    STEP_STATUS, STEP_ROBOT,
    GRIPPER, MAYA_COMMAND, STOP, RECOVER, HOME, MOVE, FOLLOW, TASK,
    JOINTS, DIAGNOSTICS, MARKERS, COMMAND, SPEED, PAUSE, RESUME, ABORT, QUEUE_STATUS, RESUME_QUEUE, RECOVER_QUEUE,
    OUTPUT, CALL_OPERATION,
)  # fmt: skip
"""The whole graph: first the names of the manual, then the additions."""

NODES = tuple(dict.fromkeys(name for row in TABLE for name in row.nodes))
"""All nodes that offer something of the graph."""

MODEL = "robot_state_publisher"
"""The node of ROS 2 that shows the robot's model, under the name of the program that does so elsewhere."""

PROGRAM = "maya"
"""The node of ROS 2 that stands for the program itself."""

DESCRIPTION = Row(
    "/robot_description", Kind.TOPIC, "std_msgs/String", Layer.ROS2, "the description of the robot (URDF)",
    (MODEL,), ("rviz2",), latch=True, queue_size=1, manual=False,
)  # fmt: skip
TF = Row(
    "/tf", Kind.TOPIC, "tf2_msgs/TFMessage", Layer.ROS2, "the frames that move, from /joint_states",
    (MODEL,), ("rviz2",), queue_size=100, rate=JOINTS.rate, manual=False,
)  # fmt: skip
TF_STATIC = Row(
    "/tf_static", Kind.TOPIC, "tf2_msgs/TFMessage", Layer.ROS2, "the frames that do not move",
    (MODEL,), ("rviz2",), latch=True, queue_size=1, manual=False,
)  # fmt: skip
CLOCK = Row(
    "/clock", Kind.TOPIC, "rosgraph_msgs/Clock", Layer.ROS2,
    "the time of all stamps, while the clock of the twin is scaled", (PROGRAM,), queue_size=1, rate=100.0, manual=False,
)  # fmt: skip
ROSOUT = Row(
    "/rosout", Kind.TOPIC, "rcl_interfaces/Log", Layer.ROS2, "the log of the program",
    (PROGRAM,), latch=True, queue_size=1000, manual=False,
)  # fmt: skip
FOLLOW_JOINTS = Row(
    "/controller/follow_joint_trajectory", Kind.ACTION, "control_msgs/FollowJointTrajectory", Layer.ROS2,
    "follow a trajectory of a, b, c with times and tolerances", HARDWARE, manual=False,
    asks=Operation.COMMAND,
)  # fmt: skip

ROS2_TABLE = (DESCRIPTION, TF, TF_STATIC, CLOCK, ROSOUT, FOLLOW_JOINTS)
"""Names that only ROS 2 has of Maya: ROS 1 has them of its own programs, or has no package for their types."""


def rows(*layers: Layer) -> tuple[Row, ...]:
    """Return the rows of some layers."""
    return tuple(row for row in TABLE if row.layer in layers)


def asked_by_topic(topic: str) -> Operation:
    """Return the operation that publishing on a topic, or sending an action's goal, needs.

    A cancel is a stop. Publishing on a topic that Maya itself publishes, or that Maya does not receive, needs `GRAPH`.
    """
    row = _BY_NAME.get(topic)
    if row is not None and row.form is Kind.TOPIC:
        return Operation.GRAPH if row.asks is None else row.asks
    name, _, part = topic.rpartition("/")
    if part not in ("goal", "cancel"):
        return Operation.GRAPH
    action = asked_by_call(name, Kind.ACTION)
    return Operation.STOP if part == "cancel" and action is not Operation.GRAPH else action


def type_of_topic(topic: str) -> str | None:
    """Return the type of a topic of the table, or of one of the five topics of its actions; None for any other."""
    row = _BY_NAME.get(topic)
    if row is not None:
        return row.type if row.form is Kind.TOPIC else None
    name, _, part = topic.rpartition("/")
    action = _BY_NAME.get(name)
    if action is None or action.form is not Kind.ACTION:
        return None
    return {
        "goal": f"{action.type}ActionGoal",
        "cancel": "actionlib_msgs/GoalID",
        "status": "actionlib_msgs/GoalStatusArray",
        "feedback": f"{action.type}ActionFeedback",
        "result": f"{action.type}ActionResult",
    }.get(part)


def asked_by_call(name: str, form: Kind) -> Operation:
    """Return the operation that calling a service or an action needs."""
    row = _BY_NAME.get(name)
    return Operation.GRAPH if row is None or row.form is not form else row.asks or Operation.GRAPH


_BY_NAME = {row.name: row for row in TABLE}
