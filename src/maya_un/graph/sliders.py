"""The sliders of `gui:=true`: they set the joints that are drawn, while the robot says nothing; never both.

What is drawn goes out on a topic of its own, so that /joint_states is the robot's alone. Once the robot has spoken,
sliders count only when a person moves one: a robot that fell silent stays drawn where it was.
"""

from __future__ import annotations

from collections.abc import Callable

from maya_un.graph.drawn import JAW_OPEN, NAMES, positions
from maya_un.graph.protocol import Graph, GraphHandle, Message
from maya_un.kinematics.mechanism import Mechanism
from maya_un.values import AXES, Joints

SILENCE = 1.0
"""So long after its last message the robot counts as silent [s]."""

ROBOT = "/joint_states"
SLIDERS = "/joint_sliders"
DRAWN = "/drawn_joint_states"

_TYPE = "sensor_msgs/JointState"
_SET = (*AXES, "jaw")


class Sliders:
    """Chooses what is drawn: `clock` tells the time [s], normally the running loop's."""

    def __init__(self, mechanism: Mechanism, clock: Callable[[], float]) -> None:
        self._mechanism = mechanism
        self._clock = clock
        self._heard: float | None = None
        self._left: tuple[float, ...] | None = None

    def robot(self, message: Message) -> Message:
        """Return what is drawn when the robot says where its joints are: just that."""
        self._heard = self._clock()
        return message

    def slid(self, message: Message) -> Message | None:
        """Return what is drawn when the sliders say where they are, None where the robot is to be drawn.

        The sliders tell a, b, c and the jaw; the joints that follow from them are worked out here.
        """
        told = dict(zip(message["name"], message["position"], strict=False))
        if not all(axis in told for axis in AXES):
            return None
        wanted = tuple(float(told.get(name, JAW_OPEN)) for name in _SET)
        if self._heard is not None and (self._clock() - self._heard < SILENCE or wanted == self._left):
            self._left = wanted
            return None
        self._heard = self._left = None
        a, b, c, jaw = wanted
        drawn = list(positions(self._mechanism, Joints(a, b, c), jaw))
        return {"header": message["header"], "name": list(NAMES), "position": drawn, "velocity": [], "effort": []}


class Relay:
    """Robot and sliders on a graph, and what is drawn of them. Closing it ends it."""

    def __init__(self, graph: Graph, sliders: Sliders) -> None:
        self._drawn = graph.advertise(DRAWN, _TYPE, queue_size=1)
        self._held: tuple[GraphHandle, ...] = (
            self._drawn,
            graph.subscribe(ROBOT, _TYPE, lambda message: self._drawn.publish(sliders.robot(message)), queue_size=1),
            graph.subscribe(SLIDERS, _TYPE, lambda message: self._show(sliders.slid(message)), queue_size=1),
        )

    def close(self) -> None:
        """Hear and draw no more."""
        for held in reversed(self._held):
            held.close()

    def _show(self, message: Message | None) -> None:
        if message is not None:
            self._drawn.publish(message)
