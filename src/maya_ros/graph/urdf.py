"""The robot's description (URDF): its joints, the lengths of one configuration, and sliders that set joints.

Boom and lines are a closed chain, and a URDF is a tree. So the tree follows the inner line: the boom turns (a), the
line swings about its anchor (b_swing) with its length (b), and the gripper hangs at its end. The outer line swings
about its own anchor (c_swing) with its length (c). Both lines end at the same place, because both swings are those of
the triangle of lines and boom:

    b_swing = atan2(h, u)     c_swing = atan2(h, u − W)     both 0 outward along the boom, positive downward

with u and h of `kinematics.mechanism`. All other moving joints mimic one of these: the pieces of which a line is drawn,
the hook that keeps the gripper upright, the second jaw.

The sliders publish on a separate topic, so that only the robot publishes /joint_states. After the robot's first
message, sliders count only when a person moves one: a silent robot stays drawn at its last pose.

The macros in the folder `description` read all lengths from dimensions.xacro beside them, which `dimensions` writes.
That file describes the manual's machine. For another machine, `describe` uses a temporary file.
"""

from __future__ import annotations

import importlib
import shutil
from collections.abc import Callable, Iterator
from math import atan2, ceil, cos, pi, sin, sqrt
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from maya_ros.graph.protocol import Graph, GraphHandle, Message, header
from maya_un.axes import AXES
from maya_un.config import AxisConfig, Config, Units
from maya_un.kinematics.mechanism import Mechanism
from maya_un.values import Joints, State

BASE = "base"
"""The frame on the table top below axis a, which is the frame of all points."""

GRIPPER = "gripper"
"""The frame at the gripper point; x is outward along the boom, z upward."""

NAMES = (*AXES, "b_swing", "c_swing", "jaw")
"""The published joints, in this order."""

JAW_OPEN = 0.045
"""Distance of each jaw from the middle when the gripper is open [m]."""

JAW_CLOSED = 0.004
"""Distance of each jaw from the middle when the gripper is closed without a part [m]."""

PART_RADIUS = 0.02
"""Half the width of a part between the jaws [m]; parts are drawn with this radius."""

_SPARE = 1.05
_MOST_PIECES = 12


class LineDivision(NamedTuple):
    """Number of pieces that draw a line, and the length of each [m].

    The pieces slide into each other, evenly, so that together they are always as long as the line.
    """

    number: int
    length: float

    @classmethod
    def of(cls, line: AxisConfig) -> LineDivision:
        """Return pieces that are shorter than the shortest line, and together longer than the longest."""
        longest = _SPARE * line.maximum
        length = max(line.minimum / _SPARE, longest / _MOST_PIECES)
        return cls(ceil(longest / length), length)

    def frames(self, name: str) -> Iterator[tuple[str, float]]:
        """Yield the frame of each piece of line `name`, and the x of the piece's middle in that frame [m]."""
        yield f"line_{name}", 0.5 * self.length
        yield from ((f"{name}_piece_{index}", 0.5 * self.length) for index in range(1, self.number - 1))
        yield f"{name}_end", -0.5 * self.length


def positions(mechanism: Mechanism, joints: Joints, jaw: float = JAW_OPEN) -> tuple[float, ...]:
    """Return the positions (rad, m) of `NAMES` where the axes are at `joints`.

    Lines too short to meet are drawn toward each other along the boom.
    """
    u, square = mechanism.section(joints)
    h = sqrt(square) if square > 0.0 else 0.0
    return (*joints, atan2(h, u), atan2(h, u - mechanism.width), jaw)


def velocities(mechanism: Mechanism, joints: Joints, rates: tuple[float, float, float]) -> tuple[float, ...]:
    """Return the velocities (rad/s, m/s) of `NAMES` at the axis velocities `rates`; straight lines have swings of 0.

    From the derivatives of u and h: u' = (b b' − c c')/W, h h' = b b' − u u'. The angular velocity of a line is the
    cross product of the position and velocity of its end over the square of its length.
    """
    _, b, c = joints
    _, pay_b, pay_c = rates
    W = mechanism.width
    u, square = mechanism.section(joints)
    if not square > 0.0:
        return (*rates, 0.0, 0.0, 0.0)
    h = sqrt(square)
    outward = (b * pay_b - c * pay_c) / W
    downward = (b * pay_b - u * outward) / h
    return (
        *rates,
        (u * downward - h * outward) / (b * b),
        ((u - W) * downward - h * outward) / (c * c),
        0.0,
    )


def jaw(*, closed: bool, holding: bool = False) -> float:
    """Return the distance of each jaw from the middle [m]."""
    if not closed:
        return JAW_OPEN
    return PART_RADIUS if holding else JAW_CLOSED


def joint_state(state: State, mechanism: Mechanism, seconds: float, *, holding: bool = False) -> Message | None:
    """Return /joint_states (sensor_msgs/JointState) of `state` at the time `seconds` since the epoch.

    Returns None before homing, when the counts do not give lengths. `holding` is whether a part is between closed jaws.
    """
    if state.joints is None:
        return None
    opening = jaw(closed=state.gripper_closed, holding=holding)
    return {
        "header": header(seconds),
        "name": list(NAMES),
        "position": list(positions(mechanism, state.joints, opening)),
        "velocity": list(velocities(mechanism, state.joints, state.velocity)),
        "effort": [],
    }


SILENCE = 1.0
"""Time after its last message when the robot counts as silent [s]."""

ROBOT = "/joint_states"
SLIDERS = "/joint_sliders"
DRAWN = "/drawn_joint_states"

_TYPE = "sensor_msgs/JointState"
_SET = (*AXES, "jaw")


class Sliders:
    """Chooses what is drawn: `clock` returns the time [s], normally the running loop's."""

    def __init__(self, mechanism: Mechanism, clock: Callable[[], float]) -> None:
        self._mechanism = mechanism
        self._clock = clock
        self._heard: float | None = None
        self._left: tuple[float, ...] | None = None

    def robot(self, message: Message) -> Message:
        """Return what is drawn for a message of the robot: that message."""
        self._heard = self._clock()
        return message

    def slid(self, message: Message) -> Message | None:
        """Return what is drawn for a message of the sliders, None if the robot is drawn.

        The sliders give a, b, c and the jaw; the joints that follow from these are computed here.
        """
        told = dict(zip(message["name"], message["position"], strict=False))
        if not all(axis in told for axis in AXES):
            return None
        wanted = tuple(float(told.get(name, JAW_OPEN)) for name in _SET)
        if self._heard is not None:
            silent = self._clock() - self._heard >= SILENCE
            # The first message only tells where the sliders are: while this process hung, it measured a silence.
            if not silent or self._left is None or wanted == self._left:
                self._left = wanted
                return None
        self._heard = self._left = None
        a, b, c, jaw = wanted
        drawn = list(positions(self._mechanism, Joints(a, b, c), jaw))
        return {"header": message["header"], "name": list(NAMES), "position": drawn, "velocity": [], "effort": []}


class Relay:
    """Publishes what is drawn of robot and sliders on a graph, until it is closed."""

    def __init__(self, graph: Graph, sliders: Sliders) -> None:
        self._drawn = graph.advertise(DRAWN, _TYPE, queue_size=1)
        self._held: tuple[GraphHandle, ...] = (
            self._drawn,
            graph.subscribe(ROBOT, _TYPE, lambda message: self._drawn.publish(sliders.robot(message)), queue_size=1),
            graph.subscribe(SLIDERS, _TYPE, lambda message: self._show(sliders.slid(message)), queue_size=1),
        )

    def close(self) -> None:
        """Unsubscribe, and draw nothing more."""
        for held in reversed(self._held):
            held.close()

    def _show(self, message: Message | None) -> None:
        if message is not None:
            self._drawn.publish(message)


INCLUDE = "dimensions.xacro"
"""The name of the file with the lengths, in the folder of the macros."""

MACROS = Path(__file__).parent / "description" / "maya_robot.xacro"
"""The description's own macros; the packages for ROS hold copies."""

_NOTE = "Generated by scripts/docs from the default configuration; change that instead."
_ROOM = 0.25


def dimensions(config: Config) -> str:
    """Return dimensions.xacro for a configuration: lengths [m], angles [rad], speeds [rad/s, m/s]."""
    lines = [f'  <xacro:property name="{name}" value="{value:.12g}"/>' for name, value in _properties(config).items()]
    body = "\n".join(lines)
    head = f'<?xml version="1.0"?>\n<!-- {_NOTE} -->\n<robot xmlns:xacro="http://www.ros.org/wiki/xacro">'
    return f"{head}\n{body}\n</robot>\n"


def describe(config: Config, macros: Path = MACROS) -> str:
    """Return the description from the file `macros` and the other macros of its folder, with the lengths of `config`.

    Needs the library xacro, either ROS' or the one of the package index.
    """
    xacro = importlib.import_module("xacro")
    with TemporaryDirectory(prefix="maya-description-") as made:
        copy = Path(made)
        for macro in macros.parent.glob("*.xacro"):
            shutil.copyfile(macro, copy / macro.name)
        (copy / INCLUDE).write_text(dimensions(config), encoding="utf-8")
        document = xacro.process_file(str(copy / macros.name))
    return '<?xml version="1.0"?>\n' + document.documentElement.toprettyxml(indent="  ")


def _properties(config: Config) -> dict[str, float]:
    geometry = config.geometry
    return {
        "height": geometry.height,
        "length": geometry.length,
        "delta": geometry.delta,
        "drop": geometry.gripper_height,
        **_axis("a", config.axes.a, Units.of(config).per_unit[0]),
        **_line("b", config.axes.b, Units.of(config).per_unit[1]),
        **_line("c", config.axes.c, Units.of(config).per_unit[2]),
        **_table(config),
    }


def _axis(name: str, axis: AxisConfig, per_unit: float) -> dict[str, float]:
    return {
        f"{name}_low": axis.minimum,
        f"{name}_high": axis.maximum,
        f"{name}_speed": axis.speed_counts / per_unit,
    }


def _line(name: str, axis: AxisConfig, per_unit: float) -> dict[str, float]:
    """Return the limits of a line, and the number and length of the pieces that draw it."""
    pieces = LineDivision.of(axis)
    return {**_axis(name, axis, per_unit), f"{name}_piece": pieces.length, f"{name}_pieces": pieces.number}


def _table(config: Config) -> dict[str, float]:
    """Return the rectangle around the mast and below all positions of the boom's end, with a margin [m]."""
    boom = config.axes.a
    quarters = [quarter * pi / 2.0 for quarter in range(-2, 5)]
    turns = [boom.minimum, boom.maximum, *(turn for turn in quarters if boom.minimum < turn < boom.maximum)]
    x = [0.0, *(config.geometry.length * sin(turn) for turn in turns)]
    y = [0.0, *(config.geometry.length * cos(turn) for turn in turns)]
    return {
        "table_west": min(x) - _ROOM,
        "table_east": max(x) + _ROOM,
        "table_south": min(y) - _ROOM,
        "table_north": max(y) + _ROOM,
    }
