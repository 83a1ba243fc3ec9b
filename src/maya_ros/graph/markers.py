"""Markers for rviz (/maya_markers): lines, part, path under way, workspace and zones.

Lines are coloured by their tension, and a word is drawn while the robot is not ready. Nothing is published because of
motion alone: a part in the gripper is fixed to the gripper's frame, the lines to the frames of their pieces, and
markers carry no time, so that rviz uses the newest frames.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from enum import IntEnum
from functools import partial
from itertools import pairwise
from math import hypot, sqrt
from typing import NamedTuple

import numpy as np

from maya_ros.graph.conversions import path_from_message
from maya_ros.graph.protocol import Graph, GraphHandle, Message, header, stamp
from maya_ros.graph.table import FOLLOW, MOVE
from maya_ros.graph.urdf import BASE, GRIPPER, PART_RADIUS, LineDivision
from maya_un.config import Config
from maya_un.controller.planner import MOST_SEGMENTS
from maya_un.errors import MayaError
from maya_un.kinematics.closed import tension
from maya_un.kinematics.mechanism import Floats, Mechanism
from maya_un.kinematics.outline import outline
from maya_un.kinematics.workspace import Workspace
from maya_un.kinematics.zones import Box, Cylinder, HalfSpace, Zone
from maya_un.motion.path import Path, Route, to_joints
from maya_un.values import Joints, Mode, Point, State


class MarkerShape(IntEnum):
    """Kind of a marker (visualization_msgs/Marker)."""

    CUBE = 1
    SPHERE = 2
    CYLINDER = 3
    LINE_STRIP = 4
    LINE_LIST = 5
    TEXT = 9
    TRIANGLES = 11


class Colour(NamedTuple):
    """Red, green, blue and opacity, each 0 to 1."""

    r: float
    g: float
    b: float
    a: float = 1.0


class Quaternion(NamedTuple):
    """A rotation."""

    x: float
    y: float
    z: float
    w: float


UPRIGHT = Quaternion(0.0, 0.0, 0.0, 1.0)
ORIGIN = Point(0.0, 0.0, 0.0)

_ADD, _DELETE = 0, 2


def marker(  # noqa: PLR0913 - a marker has that many properties
    name: str,
    shape: MarkerShape,
    colour: Colour,
    size: tuple[float, float, float],
    *,
    number: int = 0,
    place: Point = ORIGIN,
    turned: Quaternion = UPRIGHT,
    frame: str = BASE,
    follows: bool = False,
    points: Iterable[Iterable[float]] = (),
    colours: Iterable[Colour] = (),
    text: str = "",
) -> Message:
    """Return marker `number` of the namespace `name`; for lines, only the first of `size` counts, their width [m].

    A marker outside the frame `BASE` moves with its frame. A marker that changes its frame later must have `follows`
    from the beginning: rviz crashes if `frame_locked` of a drawn marker becomes false.
    """
    return {
        "header": header(frame=frame),
        "ns": name,
        "id": number,
        "type": int(shape),
        "action": _ADD,
        "pose": {"position": place._asdict(), "orientation": turned._asdict()},
        "scale": dict(zip("xyz", size, strict=True)),
        "color": colour._asdict(),
        "lifetime": stamp(0.0),
        "frame_locked": follows or frame != BASE,
        "points": [{"x": float(x), "y": float(y), "z": float(z)} for x, y, z in points],
        "colors": [one._asdict() for one in colours],
        "text": text,
        "mesh_resource": "",
        "mesh_use_embedded_materials": False,
    }


def removed(drawn: Message) -> Message:
    """Return the message that removes a marker."""
    gone = marker(
        drawn["ns"], MarkerShape(drawn["type"]), Colour(0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), number=drawn["id"]
    )
    return {**gone, "action": _DELETE}


def blended(low: Colour, high: Colour, share: float) -> Colour:
    """Return the colour between `low` and `high` at `share`, 0 to 1."""
    within = min(max(share, 0.0), 1.0)
    return Colour(*(one + (other - one) * within for one, other in zip(low, high, strict=True)))


def facing(normal: Sequence[float]) -> Quaternion:
    """Return the shortest rotation that turns z to the direction of `normal`."""
    length = hypot(*normal)
    x, y, z = (value / length for value in normal)
    # Near z = -1 the sum 1 + z would lose its digits: it is (x² + y²)/(1 - z).
    w = sqrt(0.5 * (1.0 + z)) if z > 0.0 else hypot(x, y) / sqrt(2.0 * (1.0 - z))
    if w == 0.0:
        return Quaternion(1.0, 0.0, 0.0, 0.0)
    return Quaternion(-y / (2.0 * w), x / (2.0 * w), 0.0, w)


PART = Colour(0.95, 0.47, 0.13)
STAND = Colour(0.55, 0.58, 0.62)
WAY = Colour(0.05, 0.35, 0.85)
SKIN = Colour(0.80, 0.90, 1.00, 0.10)
EDGE = Colour(0.88, 0.95, 1.00, 0.60)
ZONE = Colour(0.52, 0.20, 0.66, 0.35)

PART_HEIGHT = 0.12
_BEND = 0.2
_STRIDE = 0.4
_TURNS = 13
_PIECE = 12
_PLATE = 0.005


def workspace_markers(workspace: Workspace) -> Iterator[Message]:
    """Yield the boundary of the workspace without zones: a translucent skin, and the edges at both ends of the boom."""
    edge = np.column_stack(outline(workspace, bend=_BEND, stride=_STRIDE))
    turns = [_turned(edge, angle) for angle in np.linspace(*workspace.boom, _TURNS)]
    skin = [corner for one, other in pairwise(turns) for corner in _band(one, other)]
    yield marker("workspace", MarkerShape.TRIANGLES, SKIN, (1.0, 1.0, 1.0), points=skin)
    ends = [point for turn in (turns[0], turns[-1]) for pair in pairwise(turn) for point in pair]
    arcs = [turn[row] for row in _ridges(edge) for pair in pairwise(turns) for turn in pair]
    yield marker("workspace", MarkerShape.LINE_LIST, EDGE, (0.008, 0.0, 0.0), number=1, points=[*ends, *arcs])


def zone_markers(zones: Sequence[Zone], reach: float) -> Iterator[Message]:
    """Yield the zones; a half-space as a plate of twice `reach` [m] that lies on its plane."""
    for number, zone in enumerate(zones):
        match zone:
            case Box(low=low, high=high):
                size = (high.x - low.x, high.y - low.y, high.z - low.z)
                yield marker("zones", MarkerShape.CUBE, ZONE, size, number=number, place=_middle(low, high))
            case Cylinder():
                size = (2.0 * zone.radius, 2.0 * zone.radius, zone.high - zone.low)
                place = Point(zone.x, zone.y, 0.5 * (zone.low + zone.high))
                yield marker("zones", MarkerShape.CYLINDER, ZONE, size, number=number, place=place)
            case HalfSpace(point=point, normal=normal):
                size = (2.0 * reach, 2.0 * reach, _PLATE)
                yield marker("zones", MarkerShape.CUBE, ZONE, size, number=number, place=point, turned=facing(normal))
            case _:
                continue


def part_markers(parts: Mapping[str, Point], carried: str | None, lift: float) -> Iterator[Message]:
    """Yield parts (by their grasp points [m]) on their stands; the one `carried` hangs `lift` above the gripper."""
    for number, (name, place) in enumerate(sorted(parts.items())):
        if name == carried:
            yield _part(number, Point(0.0, 0.0, lift), GRIPPER)
            continue
        yield _part(number, place)
        height = place.z - 0.5 * PART_HEIGHT
        if height > 0.0:
            size, middle = (0.08, 0.08, height), Point(place.x, place.y, 0.5 * height)
            yield marker("stands", MarkerShape.CYLINDER, STAND, size, number=number, place=middle)


def way_markers(way: Sequence[Point]) -> Iterator[Message]:
    """Yield the path of the gripper point through `way` [m] and its end; nothing for fewer than two points."""
    if len(way) > 1:
        yield marker("path", MarkerShape.LINE_STRIP, WAY, (0.012, 0.0, 0.0), points=way)
        yield marker("path", MarkerShape.SPHERE, WAY, (0.04, 0.04, 0.04), number=1, place=way[-1])


def way_of(route: Route, mechanism: Mechanism) -> tuple[Point, ...]:
    """Return positions of the gripper point along a route [m], close enough together to draw it."""
    path = route if isinstance(route, Path) else Path.joints(*route)
    pieces = path.pieces
    joints = to_joints(path.space, mechanism, pieces.at(np.linspace(0.0, len(pieces), _PIECE * len(pieces) + 1)))
    places = mechanism.fk_many(joints)
    return tuple(Point(float(x), float(y), float(z)) for x, y, z in places[np.isfinite(places).all(axis=1)])


def _part(number: int, place: Point, frame: str = "base") -> Message:
    size = (2.0 * PART_RADIUS, 2.0 * PART_RADIUS, PART_HEIGHT)
    return marker("parts", MarkerShape.CYLINDER, PART, size, number=number, place=place, frame=frame, follows=True)


def _turned(edge: Floats, angle: float) -> Floats:
    """Return the polygon of (d, z) with the boom at `angle` [rad], as x, y, z [m], shape (n, 3)."""
    d, z = edge.T
    return np.column_stack((d * np.sin(angle), d * np.cos(angle), z)).round(4)


def _band(one: Floats, other: Floats) -> Iterator[Floats]:
    """Yield the corners of the triangles between two polygons with as many points."""
    for row in range(len(one) - 1):
        yield from (one[row], one[row + 1], other[row], other[row], one[row + 1], other[row + 1])


def _ridges(edge: Floats) -> set[int]:
    """Return the rows of an outline where it is lowest, highest, nearest to and farthest from the axis."""
    d, z = edge.T
    return {int(d.argmin()), int(d.argmax()), int(z.argmin()), int(z.argmax())}


def _middle(low: Point, high: Point) -> Point:
    return Point(0.5 * (low.x + high.x), 0.5 * (low.y + high.y), 0.5 * (low.z + high.z))


LIGHT = Colour(0.30, 0.90, 0.45)
"""Colour of a line with almost no load."""

HEAVY = Colour(1.00, 0.15, 0.10)
"""Colour of a line at its tension limit."""

_WORD = Colour(0.85, 0.25, 0.10)
_THICK = 0.014
_ALONG = facing((1.0, 0.0, 0.0))
_TINTS = 20
_QUIET = (Mode.IDLE, Mode.MOVING, Mode.STOPPING)


@dataclass(frozen=True, slots=True)
class MarkerScene:
    """The scene to draw: the state and the workspace.

    `parts` are grasp points by part name [m], `carried` names the part between the jaws, and `way` are positions of the
    gripper point along the path under way [m].
    """

    state: State
    workspace: Workspace
    zones: Sequence[Zone] = ()
    parts: Mapping[str, Point] = field(default_factory=dict[str, Point])
    carried: str | None = None
    way: Sequence[Point] = ()


class MarkerCache:
    """Stores what is drawn, so that only changes are published."""

    def __init__(self, config: Config) -> None:
        self._config = config
        self._drawn: dict[tuple[str, int], Message] = {}
        self._around: tuple[Workspace, tuple[Zone, ...], list[Message]] | None = None
        self._carried: str | None = None
        self._lift = 0.0

    def update(self, view: MarkerScene, *, whole: bool = False) -> Message | None:
        """Return a MarkerArray of the changes since the last call, None without changes.

        With `whole`, return all markers, for a new subscriber.
        """
        wanted = {(one["ns"], one["id"]): one for one in self._all(view)}
        gone = [removed(one) for key, one in self._drawn.items() if key not in wanted]
        news = [one for key, one in wanted.items() if whole or self._drawn.get(key) != one]
        self._drawn = wanted
        return {"markers": [*gone, *news]} if gone or news else None

    def _all(self, view: MarkerScene) -> Iterator[Message]:
        yield from self._surroundings(view)
        yield from part_markers(view.parts, view.carried, self._lifted(view))
        yield from way_markers(view.way)
        yield from state_markers(view.state, view.workspace, self._config)

    def _surroundings(self, view: MarkerScene) -> list[Message]:
        """Return the markers of workspace and zones, which are computed again only after a change."""
        zones = tuple(view.zones)
        if self._around is None or self._around[:2] != (view.workspace, zones):
            made = [*workspace_markers(view.workspace), *zone_markers(zones, view.workspace.mechanism.length)]
            self._around = view.workspace, zones, made
        return self._around[2]

    def _lifted(self, view: MarkerScene) -> float:
        """Return the height of the part's grasp point above the gripper point [m], from when the jaws took the part."""
        if view.carried != self._carried:
            self._carried, self._lift = view.carried, 0.0
            place = view.parts.get(view.carried or "")
            if place is not None and view.state.point is not None:
                self._lift = round(place.z - view.state.point.z, 4)
        return self._lift


def state_markers(state: State, workspace: Workspace, config: Config) -> Iterator[Message]:
    """Yield the lines, once homed, and a word above the mast unless the robot is idle, moving or stopping."""
    if state.joints is not None:
        yield from line_markers(state.joints, workspace, config)
    if state.mode not in _QUIET:
        code = "" if state.fault is None else f" {state.fault.code}"
        place = Point(0.0, 0.0, workspace.mechanism.height + 0.45)
        words = f"{state.mode.replace('_', ' ')}{code}"
        yield marker("word", MarkerShape.TEXT, _WORD, (0.0, 0.0, 0.14), place=place, text=words)


def line_markers(joints: Joints, workspace: Workspace, config: Config) -> Iterator[Message]:
    """Yield the pieces of both lines, coloured in steps by the line's share of the tension limit."""
    u, square = workspace.mechanism.section(joints)
    pulls = tension(u, max(square, 0.0) ** 0.5, workspace.mechanism.width)
    number = 0
    for name, axis, pull in zip("bc", (config.axes.b, config.axes.c), pulls, strict=True):
        share = min(max(pull / workspace.tension_limit, 0.0), 1.0)
        colour = blended(LIGHT, HEAVY, round(_TINTS * share) / _TINTS)
        pieces = LineDivision.of(axis)
        size = (_THICK, _THICK, pieces.length)
        for frame, middle in pieces.frames(name):
            place = Point(middle, 0.0, 0.0)
            yield marker(
                "lines", MarkerShape.CYLINDER, colour, size, number=number, place=place, turned=_ALONG, frame=frame
            )
            number += 1


PATIENCE = 5.0
"""Longest time from a goal to its motion [s]."""

MOST_GOALS = 100
"""Most goals that are kept; only one is under way, and the others are refused soon."""

_UNDER_WAY = (Mode.MOVING, Mode.PAUSED, Mode.STOPPING)


class _Way:
    """The route of a goal that came at a time [s]; it is computed when it is first drawn."""

    def __init__(self, route: Route, came: float) -> None:
        self.came = came
        self._route = route
        self._points: Sequence[Point] | None = None

    def points(self, mechanism: Mechanism) -> Sequence[Point]:
        """Return positions of the gripper point along it [m], none for an invalid route, which the server refuses."""
        if self._points is None:
            self._points = ()
            with suppress(MayaError):
                self._points = way_of(self._route, mechanism)
        return self._points


class PathMarkers:
    """Subscribes to the goals of /controller/follow and /move; `here` returns the joints, None if unknown.

    A refused goal gets its result at once. Of several goals, the first one is under way. `patience` is the time within
    which a goal begins, by the loop's clock [s].
    """

    def __init__(
        self, graph: Graph, mechanism: Mechanism, here: Callable[[], Joints | None], patience: float = PATIENCE
    ) -> None:
        self._mechanism = mechanism
        self._here = here
        self._patience = patience
        self._now = asyncio.get_running_loop().time
        self._ways: dict[str, _Way] = {}
        self._held: list[GraphHandle] = []
        for row, read in ((FOLLOW, _followed), (MOVE, self._moved)):
            goal, result = f"{row.type}ActionGoal", f"{row.type}ActionResult"
            self._held += [
                graph.subscribe(f"{row.name}/goal", goal, partial(self._begun, read), queue_size=10),
                graph.subscribe(f"{row.name}/result", result, self._over, queue_size=10),
            ]

    @property
    def way(self) -> Sequence[Point]:
        """Positions of the gripper point along the path under way [m], empty without one."""
        way = next(iter(self._ways.values()), None)
        return () if way is None else way.points(self._mechanism)

    def update(self, state: State) -> None:
        """Forget the goals that have no result although the robot is at rest: their servers may have ended."""
        if state.mode in _UNDER_WAY:
            return
        latest = self._now() - self._patience
        self._ways = {name: way for name, way in self._ways.items() if way.came > latest}

    def close(self) -> None:
        """Unsubscribe, and forget all paths."""
        for held in self._held:
            held.close()
        self._ways.clear()

    def _begun(self, read: Callable[[Message], Route | None], message: Message) -> None:
        """Take a goal; ignore one that its server refuses, and one without an id, whose result would not tell it."""
        name = message["goal_id"]["id"]
        if not name or len(self._ways) >= MOST_GOALS:
            return
        with suppress(MayaError):
            route = read(message["goal"])
            if route is not None:
                self._ways[name] = _Way(route, self._now())

    def _over(self, message: Message) -> None:
        self._ways.pop(message["status"]["goal_id"]["id"], None)

    def _moved(self, goal: Message) -> Route | None:
        here = self._here()
        return None if here is None else (here, Joints(goal["a"], goal["b"], goal["c"]))


def _followed(goal: Message) -> Path | None:
    """Return the path of a goal, None if it has more points than the robot takes: to read it would take long."""
    trajectory = goal["trajectory"]
    return None if len(trajectory["points"]) > MOST_SEGMENTS else path_from_message(trajectory)[0]
