"""The proof that every point of a path is in the workspace.

A path is not safe because its ends are: between them the lines can become too straight, hang slack, or let the
gripper down to the table. Between two knots the controller drives straight in (a, b, c); what holds along such a
chord is proved, not sampled: the limits of the machine in `maya_un.motion.conditions`, zones in
`maya_un.motion.keepout`.

Coordinated motion keeps the axes on this path at every speed, and a coordinated stop decelerates along it. A stop at
any instant therefore stays on the same chords: the proof for the path holds for every stop on it. `emergency` bounds
the effects of a fault beside the path.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence

import numpy as np

from maya_un.errors import PathRefused
from maya_un.kinematics.mechanism import Floats
from maya_un.kinematics.workspace import TOLERANCE, Workspace
from maya_un.kinematics.zones import Zone
from maya_un.motion.conditions import along, falling, values
from maya_un.motion.keepout import ChordPlace, ZoneEntry, first_entry
from maya_un.values import Joints

_SAMPLES = 64
_SURE = 1e-12
"""Conditions kept to this much need no second look: it is far below `TOLERANCE`, far above rounding."""


def between(start: Joints, end: Joints, t: float) -> Joints:
    """Return the joints at share `t` (0 to 1) of the straight line from `start` to `end`."""
    a, b, c = start
    return Joints(a + (end.a - a) * t, b + (end.b - b) * t, c + (end.c - c) * t)


def prove(workspace: Workspace, joints: Floats, vias: Sequence[int] = ()) -> None:
    """Prove that every point of the chords between knots is in the workspace, or refuse the path.

    `joints` are the knots, shape (n, 3) [rad, m, m]; `vias` are the numbers of those, but for the first and the
    last, that somebody asked for. Knots may lie outside by the size of an encoder count, because places on the edge
    are rounded to counts; between two of them no limit is broken further than at these two. Raises `Unreachable` for
    an end or a via outside, `PathRefused` for a way between good ones that leaves the workspace, or for a start that
    is outside already, or inside a zone. The details contain `at`, the joints at
    the place where the path leaves the workspace, and `share`, the part of the path to `target` before it, in counts.
    """
    if len(joints) == 1:
        joints = np.concatenate((joints, joints))
    waypoints = [0, *vias, len(joints) - 1]
    _prove_limits(workspace, joints, waypoints)
    if workspace.zones:
        entry = first_entry(workspace, joints)
        if entry is not None:
            raise _kept_out(workspace, joints, waypoints, entry)


def _prove_limits(workspace: Workspace, joints: Floats, waypoints: list[int]) -> None:
    coefficients = along(workspace, joints)
    if _surely_inside(workspace, joints, coefficients):
        return
    _prove_knots(workspace, joints, coefficients, waypoints)
    broken = falling(coefficients)
    if broken:
        first, last = _leg(waypoints, broken[0])
        knots = joints[first : last + 1]
        raise _refusal(workspace, knots, _worst(workspace, knots), "it comes too close to a limit for a proof")


def _surely_inside(workspace: Workspace, joints: Floats, coefficients: Floats) -> bool:
    """Whether all limits are kept beyond doubt: what most paths need is a look at the least of everything."""
    if not coefficients.min() >= -_SURE:
        return False
    least, most = joints.min(axis=0).tolist(), joints.max(axis=0).tolist()
    strokes = (workspace.boom, workspace.line_b, workspace.line_c)
    return all(
        stroke[0] - TOLERANCE <= low and high <= stroke[1] + TOLERANCE
        for low, high, stroke in zip(least, most, strokes, strict=True)
    )


def _prove_knots(workspace: Workspace, joints: Floats, coefficients: Floats, waypoints: list[int]) -> None:
    outside = _outside(workspace, joints, coefficients)
    for waypoint in waypoints[1:]:
        if waypoint in outside:
            workspace.require(_at(joints, waypoint))
    if 0 in outside:
        reason = f"it starts outside the workspace: {workspace.why_not(_at(joints, 0))}"
        raise PathRefused(target=_words(workspace, _at(joints, -1)), reason=reason)
    if outside:
        first, last = _leg(waypoints, min(outside) - 1)
        knots = joints[first : last + 1]
        raise _refusal(workspace, knots, _worst(workspace, knots), "it leaves the workspace")


def _outside(workspace: Workspace, joints: Floats, coefficients: Floats) -> set[int]:
    """Return the numbers of the knots that break a limit by more than an encoder count, zones aside."""
    low, high = np.array((workspace.boom, workspace.line_b, workspace.line_c)).T
    sure = ((joints >= low - TOLERANCE) & (joints <= high + TOLERANCE)).all(axis=1)
    sure[:-1] &= (coefficients[0] >= -_SURE).all(axis=0)
    sure[-1] &= bool((coefficients[-1, :, -1] >= -_SURE).all())
    doubtful = np.flatnonzero(~sure).tolist()
    bare = workspace.with_zones(())  # a path that is far outside has thousands of knots; zones are proved apart
    return {knot for knot in doubtful if not bare.holds_grain(_at(joints, knot))}


def _kept_out(workspace: Workspace, joints: Floats, waypoints: list[int], entry: ZoneEntry) -> PathRefused:
    """Return the refusal of a path that comes too near to a zone; raises `Unreachable` for a waypoint that does."""
    zone, place = entry
    inside = {at for at in waypoints if zone.clearance(workspace.mechanism, _at(joints, at)) < -workspace.zone_grain}
    if 0 in inside:
        reason = f"it starts too near to the zone {zone.name}; remove the zone to leave it"
        return PathRefused(target=_words(workspace, _at(joints, -1)), reason=reason)
    for waypoint in sorted(inside):
        workspace.require(_at(joints, waypoint))
    first, last = _leg(waypoints, place.chord)
    knots = joints[first : last + 1]
    deepest = _deepest(workspace, zone, knots)
    return _refusal(workspace, knots, deepest, f"it comes too near to the zone {zone.name}")


def _leg(waypoints: list[int], chord: int) -> tuple[int, int]:
    """Return the numbers of the waypoints before and behind a chord."""
    behind = bisect_right(waypoints, chord)
    return waypoints[behind - 1], waypoints[behind]


def _refusal(workspace: Workspace, knots: Floats, place: ChordPlace, otherwise: str) -> PathRefused:
    """Return the refusal of the way along `knots`, whose ends are good; `otherwise` says why if nothing else does."""
    at = between(_at(knots, place.chord), _at(knots, place.chord + 1), place.share)
    reason = workspace.why_not(at) or otherwise
    share = _gone(workspace, knots, place)
    return PathRefused(
        target=_words(workspace, _at(knots, -1)),
        reason=f"{share:.0%} of the way there {reason}",
        at=tuple(at),
        share=share,
    )


def _deepest(workspace: Workspace, zone: Zone, knots: Floats) -> ChordPlace:
    """Return where the chords between knots come nearest to a zone, or deepest into it."""
    places = _sampled(knots)
    clear = zone.clearances(workspace.mechanism, places.reshape(-1, 3))
    return _place(clear.reshape(places.shape[:2]))


def _worst(workspace: Workspace, knots: Floats) -> ChordPlace:
    """Return where the chords between knots break a limit furthest beyond what it is at the first and the last."""
    places = _sampled(knots)
    strokes = np.array((workspace.boom, workspace.line_b, workspace.line_c))
    inside = np.minimum(places - strokes[:, 0], strokes[:, 1] - places) / (strokes[:, 1] - strokes[:, 0])
    kept = np.concatenate((values(workspace, places[..., 1], places[..., 2]), np.moveaxis(inside, -1, 0)))
    ends = np.minimum(kept[:, 0, 0], kept[:, -1, -1])
    return _place((kept - np.minimum(0.0, ends)[:, np.newaxis, np.newaxis]).min(axis=0))


def _sampled(knots: Floats) -> Floats:
    """Return evenly spaced joints of every chord with its ends, shape (n − 1, samples, 3)."""
    shares = np.linspace(0.0, 1.0, _SAMPLES + 1)[:, np.newaxis]
    return knots[:-1, np.newaxis] + (knots[1:] - knots[:-1])[:, np.newaxis] * shares


def _place(sampled: Floats) -> ChordPlace:
    """Return where samples (chords, samples) are least."""
    chord, sample = np.unravel_index(int(np.argmin(sampled)), sampled.shape)
    return ChordPlace(int(chord), float(sample) / _SAMPLES)


def _gone(workspace: Workspace, knots: Floats, place: ChordPlace) -> float:
    """Return the share of the way along all chords that has been gone at a place, in counts."""
    lengths = np.sqrt((((knots[1:] - knots[:-1]) / workspace.grain) ** 2).sum(axis=1))
    return float((lengths[: place.chord].sum() + place.share * lengths[place.chord]) / lengths.sum())


def _at(joints: Floats, knot: int) -> Joints:
    return Joints(*joints[knot].tolist())


def _words(workspace: Workspace, joints: Joints) -> str:
    x, y, z = workspace.mechanism.fk(joints)
    return f"({x:.4f}, {y:.4f}, {z:.4f}) m"
