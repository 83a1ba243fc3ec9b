"""The path under way, as whoever wishes for it says on the graph: what goals hold until their results come."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial

from maya_ros.graph.markers import way_of
from maya_ros.graph.paths import from_message
from maya_ros.graph.protocol import Graph, GraphHandle, Message
from maya_ros.graph.table import FOLLOW, MOVE
from maya_un.errors import MayaError
from maya_un.kinematics.mechanism import Mechanism
from maya_un.motion.path import Path, Route
from maya_un.values import Joints, Point


class PathMarkers:
    """Hears the goals of /controller/follow and /move; `here` tells where the joints are, None where nobody knows.

    A goal that is refused has its result at once. Of several the one that came first is under way.
    """

    def __init__(self, graph: Graph, mechanism: Mechanism, here: Callable[[], Joints | None]) -> None:
        self._mechanism = mechanism
        self._here = here
        self._ways: dict[str, Sequence[Point]] = {}
        self._held: list[GraphHandle] = []
        for row, read in ((FOLLOW, _followed), (MOVE, self._moved)):
            goal, result = f"{row.type}ActionGoal", f"{row.type}ActionResult"
            self._held += [
                graph.subscribe(f"{row.name}/goal", goal, partial(self._begun, read), queue_size=10),
                graph.subscribe(f"{row.name}/result", result, self._over, queue_size=10),
            ]

    @property
    def way(self) -> Sequence[Point]:
        """Places of the gripper along the path under way [m], none where there is none."""
        return next(iter(self._ways.values()), ())

    def close(self) -> None:
        """Hear no more."""
        for held in self._held:
            held.close()
        self._ways.clear()

    def _begun(self, read: Callable[[Message], Route | None], message: Message) -> None:
        """Take a goal; what is no path is refused by whoever serves it."""
        with suppress(MayaError):
            route = read(message["goal"])
            if route is not None:
                self._ways[message["goal_id"]["id"]] = way_of(route, self._mechanism)

    def _over(self, message: Message) -> None:
        self._ways.pop(message["status"]["goal_id"]["id"], None)

    def _moved(self, goal: Message) -> Route | None:
        here = self._here()
        return None if here is None else (here, Joints(goal["a"], goal["b"], goal["c"]))


def _followed(goal: Message) -> Path:
    return from_message(goal["trajectory"])[0]
