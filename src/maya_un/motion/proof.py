"""The proof that every point of a path is in the workspace.

A path is not safe because its ends are: between them the lines can become too straight, hang slack, or let the
gripper down to the table. Between two knots the controller drives straight in (a, b, c): along such a chord b and c
are linear in t, u = (W² + b² − c²)/2W is quadratic, and every limit of the workspace is a polynomial condition on
0 ≤ t ≤ 1:

    strokes, boom, b + c ≥ W      degree 1: kept between the ends if kept at the ends
    u ≥ 0,  W − u ≥ 0             degree 2
    z ≥ 0                         (H − Φ)² − b² + u² ≥ 0, degree 4
    T_b ≤ k                       k²W²(b² − u²) − (W − u)²b² ≥ 0, degree 6
    T_c ≤ k                       k²W²(b² − u²) − u²c² ≥ 0, degree 6

Each is proved, not sampled (`maya_un.motion.bernstein`). Coordinated motion keeps the axes on this path at every
speed, and a coordinated stop decelerates along it. Where a stop at any instant ends, and all of its way there, are
therefore points of the same chords: the proof for the path holds for every stop on it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

from maya_un.errors import PathRefused
from maya_un.kinematics.workspace import Workspace
from maya_un.motion.bernstein import Polynomial, falls_below, product, raised, value
from maya_un.values import Joints

_SAMPLES = 64
_ROUNDING = 1e-11
"""Rounding of the coefficients, relative to the size of the terms they are made of."""

_ONE = (1.0, 2.0, 1.0)


def between(start: Joints, end: Joints, t: float) -> Joints:
    """Return the joints at share `t` (0 to 1) of the straight line from `start` to `end`."""
    a, b, c = start
    return Joints(a + (end.a - a) * t, b + (end.b - b) * t, c + (end.c - c) * t)


def prove_legs(workspace: Workspace, waypoints: Sequence[Joints]) -> None:
    """Prove that every point of the straight legs between waypoints is in the workspace, or refuse them.

    Waypoints may lie outside by the size of an encoder count, because places on the edge are rounded to
    counts; between two of them no limit is broken further than at these two. Raises `Unreachable` for a
    waypoint outside, `PathRefused` for a way between two good waypoints that leaves the workspace, or for a
    start that is outside already.
    """
    for waypoint in waypoints[1:]:
        if not workspace.holds_grain(waypoint):
            workspace.require(waypoint)
    if not workspace.holds_grain(waypoints[0]):
        reason = f"it starts outside the workspace: {workspace.why_not(waypoints[0])}"
        raise PathRefused(target=_words(workspace, waypoints[-1]), reason=reason)
    for start, end in pairwise(waypoints):
        t = first_breach(workspace, start, end)
        if t is not None:
            raise _refusal(workspace, start, end, t)


def first_breach(workspace: Workspace, start: Joints, end: Joints) -> float | None:
    """Return a share t of the line between two good waypoints where a limit is broken worst, None if proved."""
    if start.b == end.b and start.c == end.c:
        return None
    breaches: list[tuple[float, float]] = []
    for condition, scale in _conditions(workspace, start, end):
        allowed = min(0.0, condition[0], condition[-1]) - _ROUNDING * scale
        if falls_below(condition, allowed) is not None:
            t = min((step / _SAMPLES for step in range(_SAMPLES + 1)), key=lambda at: value(condition, at))
            breaches.append((value(condition, t) / scale, t))
    return min(breaches)[1] if breaches else None


def _sections(W: float, start: Joints, end: Joints) -> tuple[list[float], list[float], list[float], list[float]]:
    """Return b², c², u and h² along the line, in scaled Bernstein form of degree 2, 2, 2 and 4."""
    _, b0, c0 = start
    _, b1, c1 = end
    bb = [b0 * b0, 2.0 * b0 * b1, b1 * b1]
    cc = [c0 * c0, 2.0 * c0 * c1, c1 * c1]
    u = [0.5 * W * one + (b - c) / (2.0 * W) for one, b, c in zip(_ONE, bb, cc, strict=True)]
    return bb, cc, u, [one - two for one, two in zip(raised(bb), product(u, u), strict=True)]


def _conditions(workspace: Workspace, start: Joints, end: Joints) -> Iterator[tuple[Polynomial, float]]:
    """Yield every condition that the ends do not settle, with the size of its terms."""
    W, deepest = workspace.mechanism.width, workspace.mechanism.reach_down
    bb, cc, u, hh = _sections(W, start, end)
    rest = [W * one - at for one, at in zip(_ONE, u, strict=True)]
    yield u, W
    yield rest, W
    yield [deepest**2 * one - h for one, h in zip(raised(_ONE), hh, strict=True)], deepest**2
    strength = (workspace.tension_limit * W) ** 2
    carried = [strength * h for h in raised(hh)]
    for across, length in ((rest, bb), (u, cc)):
        pulled = product(product(across, across), length)
        yield [one - two for one, two in zip(carried, pulled, strict=True)], strength * max(bb[0], bb[2])


def _refusal(workspace: Workspace, start: Joints, end: Joints, t: float) -> PathRefused:
    worst = between(start, end, t)
    reason = workspace.why_not(worst) or "it comes too close to a limit for a proof"
    return PathRefused(
        target=_words(workspace, end),
        reason=f"{t:.0%} of the way there {reason}",
        at=tuple(worst),
        share=t,
    )


def _words(workspace: Workspace, joints: Joints) -> str:
    x, y, z = workspace.mechanism.fk(joints)
    return f"({x:.4f}, {y:.4f}, {z:.4f}) m"
