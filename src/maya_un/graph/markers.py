"""/maya_markers: what rviz shows beside the model, as visualization_msgs/MarkerArray.

The lines coloured by their tension, the parts where they are known, the path under way, the workspace, the zones, and a
word where the robot is not simply ready. Nothing of this is told while it moves: a part in the gripper is tied to the
gripper's frame, the lines to those of their pieces, and markers carry no time, so that whoever draws them takes the
newest frames.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from maya_un.config import Config
from maya_un.graph.drawn import LineDivision
from maya_un.graph.protocol import Message
from maya_un.graph.shapes import Colour, MarkerShape, blended, facing, marker, removed
from maya_un.graph.surroundings import part_markers, way_markers, workspace_markers, zone_markers
from maya_un.kinematics.statics import tension
from maya_un.kinematics.workspace import Workspace
from maya_un.kinematics.zones import Zone
from maya_un.values import Joints, Mode, Point, State

LIGHT = Colour(0.30, 0.90, 0.45)
"""A line that carries next to nothing."""

HEAVY = Colour(1.00, 0.15, 0.10)
"""A line that carries as much as it may."""

_WORD = Colour(0.85, 0.25, 0.10)
_THICK = 0.014
_ALONG = facing((1.0, 0.0, 0.0))
_TINTS = 20
_QUIET = (Mode.IDLE, Mode.MOVING, Mode.STOPPING)


@dataclass(frozen=True, slots=True)
class MarkerScene:
    """What is to be drawn: the state, and where its robot can go.

    `parts` are known by their grasp points [m], the one between the jaws is named by `carried`; `way` are places along
    the path under way [m].
    """

    state: State
    workspace: Workspace
    zones: Sequence[Zone] = ()
    parts: Mapping[str, Point] = field(default_factory=dict[str, Point])
    carried: str | None = None
    way: Sequence[Point] = ()


class MarkerCache:
    """Remembers what is drawn, so that only what is new has to be told."""

    def __init__(self, config: Config) -> None:
        self._config = config
        self._drawn: dict[tuple[str, int], Message] = {}
        self._around: tuple[Workspace, tuple[Zone, ...], list[Message]] | None = None
        self._carried: str | None = None
        self._lift = 0.0

    def update(self, view: MarkerScene, *, whole: bool = False) -> Message | None:
        """Return a MarkerArray of what has changed since the last one, or None where nothing has.

        `whole` returns everything, for whoever has come late.
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
        """Return workspace and zones, made anew only where one of them is another."""
        zones = tuple(view.zones)
        if self._around is None or self._around[:2] != (view.workspace, zones):
            made = [*workspace_markers(view.workspace), *zone_markers(zones, view.workspace.mechanism.length)]
            self._around = view.workspace, zones, made
        return self._around[2]

    def _lifted(self, view: MarkerScene) -> float:
        """Return how far above the gripper point the part hangs [m]: as it was when the jaws took it."""
        if view.carried != self._carried:
            self._carried, self._lift = view.carried, 0.0
            place = view.parts.get(view.carried or "")
            if place is not None and view.state.point is not None:
                self._lift = round(place.z - view.state.point.z, 4)
        return self._lift


def state_markers(state: State, workspace: Workspace, config: Config) -> Iterator[Message]:
    """Yield the lines, once homed, and a word above the mast where the robot is not simply ready or on its way."""
    if state.joints is not None:
        yield from line_markers(state.joints, workspace, config)
    if state.mode not in _QUIET:
        code = "" if state.fault is None else f" {state.fault.code}"
        place = Point(0.0, 0.0, workspace.mechanism.height + 0.45)
        words = f"{state.mode.replace('_', ' ')}{code}"
        yield marker("word", MarkerShape.TEXT, _WORD, (0.0, 0.0, 0.14), place=place, text=words)


def line_markers(joints: Joints, workspace: Workspace, config: Config) -> Iterator[Message]:
    """Yield the pieces of both lines, coloured in steps by what share of the tension limit their line carries."""
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
