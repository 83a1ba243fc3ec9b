"""Markers of what is around the robot: workspace, zones, parts, and the path under way."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

import numpy as np

from maya_un.graph.drawn import GRIPPER, PART_RADIUS
from maya_un.graph.protocol import Message
from maya_un.graph.shapes import Colour, MarkerShape, facing, marker
from maya_un.kinematics.mechanism import Floats, Mechanism
from maya_un.kinematics.workspace import Workspace
from maya_un.kinematics.zones import Box, Cylinder, HalfSpace, Zone
from maya_un.motion.path import Path, Route, to_joints
from maya_un.values import Joints, Point

PART = Colour(0.95, 0.47, 0.13)
STAND = Colour(0.55, 0.58, 0.62)
WAY = Colour(0.05, 0.35, 0.85)
SKIN = Colour(0.80, 0.90, 1.00, 0.10)
EDGE = Colour(0.88, 0.95, 1.00, 0.60)
ZONE = Colour(0.52, 0.20, 0.66, 0.35)

PART_HEIGHT = 0.12
_COLUMNS = 18
_SCAN = 801
_TURNS = 13
_PIECE = 12
_PLATE = 0.005


def outline(workspace: Workspace) -> Floats:
    """Return the edge of the reachable section, zones aside, as a closed polygon of (d, z) [m], shape (n, 2).

    Columns stand closer together at the ends, where the edge turns; where two strokes meet there is a column.
    """
    section, mechanism = workspace.section, workspace.mechanism
    scan = np.linspace(0.0, mechanism.width, _SCAN)
    reached = [u for u in scan if section.depths(float(u)) is not None]
    middle, half = 0.5 * (reached[0] + reached[-1]), 0.5 * (reached[-1] - reached[0])
    meetings = [mechanism.section(Joints(0.0, b, c))[0] for b in workspace.line_b for c in workspace.line_c]
    corners = [u for u in meetings if reached[0] < u < reached[-1]]
    columns = np.sort([*(middle - half * np.cos(np.linspace(0.0, np.pi, _COLUMNS))), *corners])
    found = [(u, *depths) for u, depths in ((u, section.depths(float(u))) for u in columns) if depths is not None]
    u, low, high = np.array(found).T
    d = mechanism.delta + np.concatenate((u, u[::-1], u[:1]))
    z = mechanism.reach_down - np.concatenate((low, high[::-1], low[:1]))
    return np.column_stack((d, z))


def workspace_markers(workspace: Workspace) -> Iterator[Message]:
    """Yield the boundary of the workspace, zones aside: a translucent skin, and the edges at both ends of the boom."""
    edge = outline(workspace)
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
    """Yield the path of the gripper point through `way` [m] and its end; nothing without one."""
    if len(way) > 1:
        yield marker("path", MarkerShape.LINE_STRIP, WAY, (0.012, 0.0, 0.0), points=way)
        yield marker("path", MarkerShape.SPHERE, WAY, (0.04, 0.04, 0.04), number=1, place=way[-1])


def way_of(route: Route, mechanism: Mechanism) -> tuple[Point, ...]:
    """Return places of the gripper point along a route [m], close enough together to draw it."""
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
