"""Forward and inverse kinematics of Maya's three axes: its closed form beside chains of joints that others solve.

Two lines that meet are no chain. A user of the others models one line: the boom turns, line b turns at its anchor by an
angle β below the boom, and is b long. The length of line c is then the distance from its anchor. The other way round,
β comes from the three lengths by the law of cosines. The gripper hangs straight down from where the lines meet, so
its height is a difference and no joint.
"""

from __future__ import annotations

from collections.abc import Callable
from math import acos, cos, pi, sin
from typing import Any

import numpy as np

from benchmarks.peers.contest import Contest, Floats, Side, peer, sides_of, spent
from maya_un.config import Config
from maya_un.kinematics import Mechanism, Workspace
from maya_un.values import Joints, Point
from scripts.performance_results import OURS

POINTS = 20
"""Number of places that one sample computes, each on its own."""

CLOSE = 1e-9
"""A numeric solution ends when it is so near [m]."""

TURNS = 100
"""Most steps of a numeric solution."""

TOLERANCE = 1e-5
"""Answers may differ by so much [m or rad]."""

Chain = tuple[float, float, float]
"""Angle of the boom, angle of line b below the boom, length of line b [rad, rad, m]."""

GUESS = (1.0, 0.8, 1.6)
"""Every numeric solution begins here."""

Forward = Callable[[Chain], Floats]
"""From a chain's joints to where the lines meet, (3,) [m]."""

Inverse = Callable[[Floats], Chain]


class Places:
    """Places all over the workspace, as joints and as points, and the way between Maya's joints and a chain's."""

    def __init__(self, mechanism: Mechanism, count: int = POINTS) -> None:
        self.mechanism = mechanism
        drawn = np.random.default_rng(1).uniform((0.1, 1.2, 1.2), (2.0, 2.1, 2.1), (count, 3))
        self.joints = [Joints(*row) for row in drawn.tolist()]
        self.points = [mechanism.fk(joints) for joints in self.joints]

    def chain(self, joints: Joints) -> Chain:
        """Return the joints of a chain for Maya's."""
        a, b, c = joints
        W = self.mechanism.width
        return a, acos((W * W + b * b - c * c) / (2.0 * W * b)), b

    def met(self, point: Point) -> Floats:
        """Return where the lines meet [m] while the gripper is at `point`."""
        return np.array((point.x, point.y, point.z + self.mechanism.drop))

    def hung(self, met: Floats) -> Floats:
        """Return where the gripper is [m] while the lines meet at `met`."""
        return np.array((met[0], met[1], met[2] - self.mechanism.drop))

    def maya(self, chain: Chain, met: Floats) -> Floats:
        """Return Maya's joints for a chain's: line c is as long as its anchor is far away."""
        a, _, b = chain
        m = self.mechanism
        anchor = np.array((m.length * sin(a), m.length * cos(a), m.height))
        return np.array((a, b, np.linalg.norm(met - anchor)))


def contests(left_out: dict[str, str], count: int = POINTS) -> list[Contest]:
    """Return the work of both directions."""
    places = Places(Workspace.of(Config()).mechanism, count)
    makers = {"ikpy": ikpy, "pinocchio": pinocchio, "roboticstoolbox": toolbox}
    forward, inverse = list[Side](), list[Side]()

    def made(program: str) -> Side:
        fk, ik = makers[program](places.mechanism)
        inverse.append(_inverse(program, places, ik))
        return _forward(program, places, fk)

    forward = sides_of({program: lambda program=program: made(program) for program in makers}, left_out)
    fk, ik = places.mechanism.fk, places.mechanism.ik
    ours = (
        Side(
            OURS, lambda: np.array([fk(j) for j in places.joints]), _each(lambda: [fk(j) for j in places.joints], count)
        ),
        Side(
            OURS, lambda: np.array([ik(p) for p in places.points]), _each(lambda: [ik(p) for p in places.points], count)
        ),
    )
    return [
        Contest("kinematics", "forward kinematics of a place", "µs", "m", TOLERANCE, [ours[0], *forward]),
        Contest("kinematics", "inverse kinematics of a place", "µs", "m or rad", TOLERANCE, [ours[1], *inverse]),
    ]


def _each(work: Callable[[], object], count: int) -> Callable[[], float]:
    sample = spent(work, 5)
    return lambda: sample() / count


def _forward(program: str, places: Places, fk: Forward) -> Side:
    def work() -> list[Floats]:
        return [places.hung(fk(places.chain(joints))) for joints in places.joints]

    return Side(program, lambda: np.array(work()), _each(work, len(places.joints)))


def _inverse(program: str, places: Places, ik: Inverse) -> Side:
    def work() -> list[Floats]:
        found: list[Floats] = []
        for point in places.points:
            met = places.met(point)
            found.append(places.maya(ik(met), met))
        return found

    return Side(program, lambda: np.array(work()), _each(work, len(places.points)))


def ikpy(mechanism: Mechanism) -> tuple[Forward, Inverse]:
    """Return both directions by ikpy: a chain in Python, solved by scipy's least squares."""
    chain, link = peer("ikpy.chain", "ikpy"), peer("ikpy.link", "ikpy")
    arm: Any = chain.Chain(
        [
            link.OriginLink(),
            link.URDFLink("boom", [0, 0, 0], [0, 0, 0], rotation=[0, 0, -1], bounds=(-pi, pi)),
            link.URDFLink(
                "anchor b", [0, mechanism.delta, mechanism.height], [0, 0, 0], rotation=[-1, 0, 0], bounds=(0.0, pi)
            ),
            link.URDFLink(
                "line b", [0, 0, 0], [0, 0, 0], translation=[0, 1, 0], bounds=(0.0, 4.0), joint_type="prismatic"
            ),
        ],
        active_links_mask=[False, True, True, True],
    )

    def forward(joints: Chain) -> Floats:
        return arm.forward_kinematics([0.0, *joints])[:3, 3]

    def inverse(met: Floats) -> Chain:
        _, a, beta, b = arm.inverse_kinematics(met, initial_position=[0.0, *GUESS])
        return float(a), float(beta), float(b)

    return forward, inverse


def pinocchio(mechanism: Mechanism) -> tuple[Forward, Inverse]:
    """Return both directions by pinocchio, compiled; inverse is the loop of Newton steps that its manual shows."""
    pin = peer("pinocchio", "pin")
    model = pin.Model()
    unmoved = pin.SE3.Identity()
    anchor = pin.SE3(np.eye(3), np.array((0.0, mechanism.delta, mechanism.height)))
    boom = model.addJoint(0, pin.JointModelRevoluteUnaligned(np.array((0.0, 0.0, -1.0))), unmoved, "boom")
    turn = model.addJoint(boom, pin.JointModelRevoluteUnaligned(np.array((-1.0, 0.0, 0.0))), anchor, "anchor b")
    line = model.addJoint(turn, pin.JointModelPY(), unmoved, "line b")
    data = model.createData()

    def forward(joints: Chain) -> Floats:
        pin.forwardKinematics(model, data, np.array(joints))
        return data.oMi[line].translation.copy()

    def inverse(met: Floats) -> Chain:
        q = np.array(GUESS)
        for _ in range(TURNS):
            pin.computeJointJacobians(model, data, q)
            off = met - data.oMi[line].translation
            if off @ off < CLOSE * CLOSE:
                break
            jacobian = pin.getJointJacobian(model, data, line, pin.LOCAL_WORLD_ALIGNED)[:3]
            q += np.linalg.solve(jacobian, off)
        a, beta, b = q.tolist()
        return a, beta, b

    return forward, inverse


def toolbox(mechanism: Mechanism) -> tuple[Forward, Inverse]:
    """Return both directions by Corke's Robotics Toolbox: compiled, inverse by Levenberg-Marquardt."""
    rtb = peer("roboticstoolbox", "roboticstoolbox-python")
    elements = rtb.ET
    arm: Any = (
        elements.Rz(flip=True)
        * elements.ty(mechanism.delta)
        * elements.tz(mechanism.height)
        * elements.Rx(flip=True, qlim=[0.0, pi])
        * elements.ty(qlim=[0.0, 4.0])
    )
    mask, guess = np.array((1.0, 1.0, 1.0, 0.0, 0.0, 0.0)), np.array(GUESS)

    def forward(joints: Chain) -> Floats:
        return arm.eval(np.array(joints))[:3, 3]

    def inverse(met: Floats) -> Chain:
        target = np.eye(4)
        target[:3, 3] = met
        found = arm.ik_LM(target, q0=guess, mask=mask, tol=CLOSE * CLOSE, joint_limits=False)
        assert found.success, "it found no solution"
        a, beta, b = found.q.tolist()
        return a, beta, b

    return forward, inverse
