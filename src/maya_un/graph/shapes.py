"""Single markers (visualization_msgs/Marker) as plain data."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from enum import IntEnum
from math import hypot, sqrt
from typing import NamedTuple

from maya_un.graph.drawn import BASE
from maya_un.graph.protocol import Message
from maya_un.graph.stamps import header, stamp
from maya_un.values import Point


class MarkerShape(IntEnum):
    """What a marker is (visualization_msgs/Marker)."""

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


def marker(  # noqa: PLR0913 - a marker has that many sides
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
    """Return marker `number` of the namespace `name`; of lines only the first of `size` counts, their width [m].

    One that is not in the frame `BASE` moves with its frame. One that is there now, and in another frame later,
    `follows` from the beginning: rviz crashes if `frame_locked` of a drawn marker becomes false.
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
    """Return what takes a marker away again."""
    gone = marker(
        drawn["ns"], MarkerShape(drawn["type"]), Colour(0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), number=drawn["id"]
    )
    return {**gone, "action": _DELETE}


def blended(low: Colour, high: Colour, share: float) -> Colour:
    """Return the colour that lies between two at `share`, 0 to 1."""
    within = min(max(share, 0.0), 1.0)
    return Colour(*(one + (other - one) * within for one, other in zip(low, high, strict=True)))


def facing(normal: Sequence[float]) -> Quaternion:
    """Return the shortest rotation that turns z to the direction of `normal`."""
    length = hypot(*normal)
    x, y, z = (value / length for value in normal)
    if z < -1.0 + 1e-12:
        return Quaternion(1.0, 0.0, 0.0, 0.0)
    w = sqrt(0.5 * (1.0 + z))
    return Quaternion(-y / (2.0 * w), x / (2.0 * w), 0.0, w)
