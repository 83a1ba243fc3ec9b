"""Moving the robot while a direction is held: which short paths are requested, and when motion ends.

Nothing here knows how the robot moves. A held direction requests a straight path of the chosen reach from the gripper's
position, and at its end the next one. When the direction is released, the path under way is ended. The robot refuses a
path that leaves the workspace. Then half of the path is tried, so that the robot comes close to the edge.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, radians
from typing import Callable, NamedTuple

from maya_ui.robot import Ended, Joints, Path, Position
from maya_ui.seen import Seen


class Reach(NamedTuple):
    """Longest path: `length` [m], of the boom `angle` [rad]."""

    length: float
    angle: float


REACHES = (
    Reach(0.001, radians(0.1)),
    Reach(0.010, radians(1.0)),
    Reach(0.050, radians(5.0)),
    Reach(0.200, radians(20.0)),
)
"""The reaches that can be chosen."""

SHORTEST = 5e-4
"""No shorter path is tried at the edge of the workspace (m, rad)."""

OUTSIDE = frozenset({"2101", "2102"})
"""The refusals that a shorter path may not meet: unreachable, and a path that leaves the workspace."""

ELSEWHERE = "2107"
"""The refusal of a path that does not begin at the robot's position: the robot was still coming to rest."""

PATIENCE = 3
"""Largest number of new tries from a newer position."""


class Direction(NamedTuple):
    """An axis (x, y, z of the gripper, r outward along the boom, a of the boom) and its sense."""

    axis: str
    sign: int

    def path(self, reach: Reach, seen: Seen) -> Path | None:
        """Return the straight path from the robot's position, None if the position is unknown."""
        if self.axis == "a":
            return self._turn(self.sign * reach.angle, seen.joints)
        return self._line(self.sign * reach.length, seen.position)

    @staticmethod
    def _turn(angle: float, here: Joints | None) -> Path | None:
        if here is None:
            return None
        return Path(("a", "b", "c"), ((here.a, here.b, here.c), (here.a + angle, here.b, here.c)))

    def _line(self, way: float, here: Position | None) -> Path | None:
        if here is None:
            return None
        radius = hypot(here.x, here.y) or 1.0
        x, y, z = {
            "x": (1.0, 0.0, 0.0),
            "y": (0.0, 1.0, 0.0),
            "z": (0.0, 0.0, 1.0),
            "r": (here.x / radius, here.y / radius, 0.0),
        }[self.axis]
        there = (here.x + way * x, here.y + way * y, here.z + way * z)
        return Path(("x", "y", "z"), ((here.x, here.y, here.z), there))


KEYS: dict[str, Direction] = {
    "Right": Direction("x", 1),
    "Left": Direction("x", -1),
    "Up": Direction("y", 1),
    "Down": Direction("y", -1),
    "PageUp": Direction("z", 1),
    "PageDown": Direction("z", -1),
    "D": Direction("a", 1),
    "A": Direction("a", -1),
    "W": Direction("r", 1),
    "S": Direction("r", -1),
}
"""The direction of each key."""


@dataclass
class _Held:
    """A direction that is held, and the scale and tries of its paths."""

    direction: Direction
    scale: float = 1.0
    tries: int = 0


class Teleop:
    """Moves the robot while at most one direction is held; `jog` requests a path, `end` ends it.

    A direction that was refused is not tried again before it is released.
    """

    def __init__(self, seen: Seen, jog: Callable[[Path], None], end: Callable[[], None]) -> None:
        self._seen = seen
        self._jog = jog
        self._end = end
        self._held: _Held | None = None
        self._under_way: _Held | None = None
        self._wants_position = False
        self.reach = REACHES[2]

    @property
    def held(self) -> Direction | None:
        """The direction that is held."""
        return None if self._held is None else self._held.direction

    @property
    def under_way(self) -> bool:
        """Whether a path that was requested here has not ended."""
        return self._under_way is not None

    def press(self, direction: Direction) -> None:
        """Hold a direction, unless another is held; its path begins once the path under way has ended."""
        if self._held is None:
            self._held = _Held(direction)
            if self._under_way is None:
                self._go(self._held)

    def release(self) -> None:
        """Release the held direction."""
        held, self._held = self._held, None
        self._wants_position = False
        if held is not None and self._under_way is not None:
            self._end()

    def positioned(self) -> None:
        """Begin the path that waited for a newer position."""
        if self._wants_position and self._under_way is None and self._held is not None:
            self._go(self._held)

    def ended(self, end: Ended) -> None:
        """Handle the end of a path: continue, try a shorter path, or stop."""
        before, self._under_way = self._under_way, None
        if before is not None and self._held is not None:
            self._wants_position = self._held is not before or self._again(self._held, end)

    def _again(self, held: _Held, end: Ended) -> bool:
        """Return whether another path must follow the one that has ended."""
        if end.done and held.scale == 1.0:
            held.tries = 0
            return True
        if not end.done and end.code == ELSEWHERE:
            held.tries += 1
            return held.tries <= PATIENCE
        if end.done or end.code in OUTSIDE:
            held.scale /= 2.0
            reach = self.reach.angle if held.direction.axis == "a" else self.reach.length
            return held.scale * reach >= SHORTEST
        return False

    def _go(self, held: _Held) -> None:
        self._wants_position = False
        reach = Reach(self.reach.length * held.scale, self.reach.angle * held.scale)
        path = held.direction.path(reach, self._seen)
        if path is not None:
            self._under_way = held
            self._jog(path)
