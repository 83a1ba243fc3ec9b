"""The numbers on the page about the mechanism, recomputed: from the formulas where they are short, else by the package.

A pattern has a group for every number; each must be right to half a unit of its last digit.
"""

from __future__ import annotations

import re
import runpy
from dataclasses import replace
from math import atan2, degrees, hypot, inf, pi, sqrt

import numpy as np
import pytest

from maya_un.config import Config
from maya_un.kinematics import Workspace
from maya_un.values import Joints, Point
from tests.conventions.source import ROOT
from tests.jerk_limits import gentle_of

PAGE = re.sub(r"\s+", " ", (ROOT / "docs" / "explanation" / "the-mechanism.md").read_text(encoding="utf-8"))
NUMBER = r"(\d+(?:\.\d+)?)"

WORKSPACE = Workspace.of(Config())
W, HIGH = 2.0, 2.15
B, C = (0.575, 2.26), (0.565, 2.3)
SPEED, ACCELERATION, STOP = 0.045, 0.00512, 0.0512


def holds(pattern: str, *expected: float) -> None:
    """Assert that the page contains `pattern`, where each # stands for the next of the `expected` numbers."""
    found = re.findall(re.escape(pattern).replace(r"\#", NUMBER).replace(r"\ ", " "), PAGE)
    assert len(found) == 1, f"said {len(found)} times: {pattern}"
    written = [found[0]] if isinstance(found[0], str) else list(found[0])
    assert len(written) == len(expected)
    for text, value in zip(written, expected, strict=True):
        digits = len(text.partition(".")[2])
        assert float(text) == pytest.approx(value, abs=0.5001 * 10.0**-digits), f"{pattern}: {text}, not {value}"


def lines(u: float, h: float) -> tuple[float, float]:
    return hypot(u, h), hypot(W - u, h)


def pull(h: float) -> float:
    """Return the tension in the middle of the boom [loads]."""
    return sqrt(1.0 + h * h) / (2.0 * h)


def greatest(u: float, h: float) -> float:
    b, c = lines(u, h)
    return max((W - u) / W * b / h, u / W * c / h)


def test_the_example_of_the_two_kinematics() -> None:
    b, c = lines(1.0, 1.75)
    holds("b = c = √(1 + 3.0625) = #. The boom stands at α = #°", b, degrees(atan2(0.5, 1.2)))
    assert WORKSPACE.mechanism.ik(Point(0.5, 1.2, 0.4)) == pytest.approx((atan2(0.5, 1.2), b, c))


def test_mistakes_of_the_manual_fail_as_described() -> None:
    b, _ = lines(1.0, 1.75)
    holds("its cosine is #", (W * W + b * b * b * b) / (2.0 * W * b))
    wrong, _ = lines(1.0, 2.35 - 0.4 + 0.2)
    assert wrong > max(B[1], C[1])
    held = WORKSPACE.mechanism.fk(Joints(0.0, wrong, wrong))
    holds("b = c = #, longer than either line is; lines of that length would hold the gripper at z = #,", wrong, held.z)


def test_the_example_of_speeds() -> None:
    b, _ = lines(1.0, 1.75)
    holds(
        "both lines carry T = 0.5 · # / 1.75 = #. Lengthen both by 1 mm and the gripper sinks by # mm",
        b,
        pull(1.75),
        2 * pull(1.75),
    )
    holds("it goes # mm outwards at the same height", 2.0 * b / W)
    moved = WORKSPACE.mechanism.jacobian(Joints(0.0, b, b)) @ np.array([0.0, 1.0, -1.0])
    assert moved == pytest.approx([0.0, b, 0.0])


def test_tensions_in_the_middle() -> None:
    holds(
        "At h = 1 that is #, at h = 0.25 it is #, at h = 0.1005 it is #, at h = 0.01 already #",
        *map(pull, (1.0, 0.25, 0.1005, 0.01)),
    )
    surplus = [1e3 * (2.0 * hypot(1.0, h) - W) for h in (1.0 / sqrt(99.0), 0.01)]
    holds("b + c − W is # mm where the tension is 5, and # mm where it is 50", *surplus)


def test_the_edges_of_the_section() -> None:
    def corner(radius: float, width_first: bool) -> tuple[float, float]:
        """Return (d, z) on the circle of a short end where the tension is 5, by bisection over the angle."""
        low, high = 0.01, 0.5 * pi
        for _ in range(80):
            angle = 0.5 * (low + high)
            u, h = radius * np.cos(angle), radius * np.sin(angle)
            low, high = (angle, high) if greatest(u if width_first else W - u, h) > 5.0 else (low, angle)
        u, h = radius * np.cos(low), radius * np.sin(low)
        return 0.3 + (u if width_first else W - u), HIGH - h

    inner, outer = corner(B[0], True), corner(C[0], False)
    left = [HIGH - B[0], HIGH - sqrt(C[1] ** 2 - W * W)]
    right = [HIGH - sqrt(B[1] ** 2 - W * W), HIGH - C[0]]
    u = (W * W + B[1] ** 2 - C[1] ** 2) / (2.0 * W)
    bottom = (0.3 + u, HIGH - sqrt(B[1] ** 2 - u * u))
    holds("T = 5 | (#, #) to (#, #); lowest in the middle, # |", *inner, *outer, HIGH - 1.0 / sqrt(99.0))
    holds("circle of # about (0.30, 2.15) | (#, #) to (0.300, #) |", B[0], *inner, left[0])
    holds("u = 0 | (0.300, #) to (0.300, #) |", *left)
    holds("circle of # about (2.30, 2.15) | (0.300, #) to (#, #) |", C[1], left[1], *bottom)
    holds("circle of # about (0.30, 2.15) | (#, #) to (2.300, #) |", B[1], *bottom, right[0])
    holds("u = W | (2.300, #) to (2.300, #) |", *right)
    holds("circle of # about (2.30, 2.15) | (2.300, #) to (#, #) |", C[0], right[1], *outer)
    holds("from z = #, both lines fully out, up to z = # at five times the load", bottom[1], outer[1])


def test_how_high_two_times_the_load_lets_it_go() -> None:
    u = np.linspace(1e-3, W - 1e-3, 20001)
    h = u * (W - u) / np.sqrt(16.0 - np.maximum(u, W - u) ** 2)
    allowed = (np.hypot(u, h) >= B[0]) & (np.hypot(W - u, h) >= C[0])
    holds("at two times the load only up to #", HIGH - float(h[allowed].min()))


def test_rings() -> None:
    def ring(z: float) -> tuple[float, float]:
        h = HIGH - z
        return 0.3 + W - sqrt(C[1] ** 2 - h * h), 0.3 + sqrt(B[1] ** 2 - h * h)

    inner, outer = ring(0.15)
    holds("at z = 0.15 there is a strip # wide", outer - inner)
    inner, outer = ring(0.40)
    holds("it is # wide, from d = # to d = #", outer - inner, inner, outer)


def test_areas_and_volume() -> None:
    step = 0.0005
    u, z = np.meshgrid(np.arange(0.5 * step, W, step), np.arange(0.5 * step, 2.35, step))
    h = HIGH - z
    b, c = np.hypot(u, h), np.hypot(W - u, h)
    accepted = (b >= B[0]) & (b <= B[1]) & (c >= C[0]) & (c <= C[1])
    tension = np.maximum((W - u) * b, u * c) / (W * np.maximum(h, 1e-9))
    good, above = accepted & (tension <= 5.0), accepted & (h < 0.0)
    size = step * step
    holds("The section has an area of # m²", good.sum() * size)
    holds(
        "With the sign of Φ corrected it accepts # m². In # m² of the difference z is greater than H − Φ",
        accepted.sum() * size,
        above.sum() * size,
    )
    holds(
        "In the other # m² a line would carry more than five times the load", (accepted & ~good & ~above).sum() * size
    )
    holds(
        "Swept over the boom's 120° the section is a volume of # m³",
        float((0.3 + u)[good].sum()) * size * 2.0 * pi / 3.0,
    )


def test_short_ends() -> None:
    holds("the short ends are # and #, together #, and W is #", B[0], C[0], B[0] + C[0], W)


def test_axes_at_their_own_speeds() -> None:
    (b, c), (b_end, c_end) = lines(0.05, 0.6), lines(0.3, 1.5)
    holds("Line b goes from # to #, line c from # to #", b, b_end, c, c_end)
    soon, late = (c_end - c) / SPEED, (b_end - b) / SPEED
    holds("Line c arrives after # s; line b needs # s. When c has arrived, b is #,", soon, late, b + SPEED * soon)
    taut = hypot(W, b + SPEED * soon)
    holds("√(W² + b²) = #: it hangs loose by # mm", taut, 1e3 * (c_end - taut))
    time = np.linspace(0.0, late, 200001)
    loose = np.minimum(c + SPEED * time, c_end) > np.hypot(W, np.minimum(b + SPEED * time, b_end))
    holds("It is slack from # s to # s", float(time[loose].min()), float(time[loose].max()))
    share = np.linspace(0.0, 1.0, 1001)
    together = 0.5 * W + ((b + share * (b_end - b)) ** 2 - (c + share * (c_end - c)) ** 2) / (2.0 * W)
    holds("the way from A to B keeps u ≥ #", float(together.min()))


def test_straight_in_the_joints_under_the_limit() -> None:
    u = 0.6
    h = u * (W - u) / sqrt(100.0 - (W - u) ** 2)
    total = sum(lines(u, h))
    middle = sqrt(0.25 * total * total - 1.0)
    holds("at the same height #, right under the limit: T = # at both ends", HIGH - h, greatest(u, h))
    holds(
        "b + c = # is kept, so the gripper follows an ellipse and even sinks, to #. And yet the tension rises to #",
        total,
        HIGH - middle,
        pull(middle),
    )


def test_stops() -> None:
    slow, fast = SPEED / ACCELERATION, SPEED / STOP
    boom, boom_fast = 1000.0 / 1024.0, 1000.0 / 10240.0
    degree = 371.06
    holds("a line takes # s and # mm, the boom from its # °/s", slow, 5e2 * SPEED * slow, 1000.0 / degree)
    holds("a line needs # s to come to its full speed", slow)
    holds("at 1024 counts/s² # s and #°.", boom, 500.0 * boom / degree)
    holds(
        "ten times as large by default: # s and # mm, for the boom # s and #°",
        fast,
        5e2 * SPEED * fast,
        boom_fast,
        500.0 * boom_fast / degree,
    )
    ratio = np.linspace(0.0, 1.0, 100001)
    beside = (ratio - ratio**2) / np.sqrt(1.0 + ratio**2)
    worst = float(beside.max())
    holds("it is worst at #, where it is # mm", float(ratio[beside.argmax()]), worst * 5e2 * SPEED * slow)
    holds("at 5120 counts/s² and # mm at 51 200", worst * 5e2 * SPEED * fast)


def test_straight_line_and_its_slowest_axis() -> None:
    start, end = np.array([0.0, 1.0, 0.7]), np.array([2.0, 0.6, 1.3])
    assert all(WORKSPACE.why_not(Point(*place.tolist())) is None for place in (start, end))
    length = float(np.linalg.norm(end - start))
    holds("from (0, 1.0, 0.7) to (2.0, 0.6, 1.3), # m", length)
    share = np.linspace(0.0, 1.0, 20001)[:, np.newaxis]
    x, y, z = (start + share * (end - start)).T
    u, h = np.hypot(x, y) - 0.3, HIGH - z
    joints = np.column_stack((np.degrees(np.arctan2(x, y)) * 371.06, 1e6 * np.hypot(u, h), 1e6 * np.hypot(W - u, h)))
    times = np.abs(np.diff(joints, axis=0)) / (1000.0, 45000.0, 45000.0)
    slowest = times.argmax(axis=1)
    turns = np.flatnonzero(np.diff(slowest))
    assert slowest[[0, *(turns + 1)]].tolist() == [0, 2, 1]
    holds("from s = # on line c, and from # on line b", *(share[turns + 1, 0] * length).tolist())
    holds("Going along the dashed curves alone would take # s", float(times.max(axis=1).sum()))
    chord = np.array(WORKSPACE.mechanism.ik(Point(*start.tolist())))
    chord = chord + share * (np.array(WORKSPACE.mechanism.ik(Point(*end.tolist()))) - chord)
    away = WORKSPACE.mechanism.fk_many(chord) - start
    along = (end - start) / length
    holds(
        "the gripper would be up to # mm beside the line",
        1e3 * float(np.linalg.norm(away - np.outer(away @ along, along), axis=1).max()),
    )


def test_the_line_takes_as_long_as_the_page_says() -> None:
    from maya_un.config import Units
    from maya_un.motion.move import lay
    from maya_un.motion.path import Path
    from maya_un.motion.profile import Limits
    from maya_un.motion.timing import plan

    limits, units = Limits.of(Config()), Units.of(Config())
    path = Path.line(Point(0.0, 1.0, 0.7), Point(2.0, 0.6, 1.3))
    move = plan(lay(path, WORKSPACE.mechanism, units, limits), limits, units)
    (said,) = re.findall(r"in segments of whole counts, it takes about (\d+) s", PAGE)
    assert move.duration == pytest.approx(float(said), abs=1.0)


def test_the_example_of_a_limit_of_jerk() -> None:
    from maya_un.config import Units
    from maya_un.motion.move import straight
    from maya_un.motion.profile import Limits
    from maya_un.motion.timing import plan

    limits, units = Limits.of(Config()), Units.of(Config())
    knots = straight(units, (Joints(0.0, 1.0, 2.0), Joints(0.0, 1.5, 2.0)))
    (gentle,) = gentle_of(knots, replace(limits, jerk=(inf, 5120.0, inf)))
    holds("500 mm of line b take 11.1 + 8.8 = # s", plan(knots, limits, units).duration)
    holds("counts/s³ τ is 1 s, and they take # s", gentle.duration)


def test_the_examples_of_clearance() -> None:
    holds(
        "With 120 mm and 90 mm of clearance at the ends and a travel of 150 mm, at least # mm are left",
        (120 + 90 - 150) / 2,
    )
    holds(
        "With a travel of 250 mm nothing is proved; between them there may be a corner # mm deep", (250 - 120 - 90) / 2
    )


def test_raising_the_anchors_and_lengthening_the_gripper_changes_no_point() -> None:
    changed = Config.model_validate({"geometry": {"height": 2.36, "gripper_height": 0.21}})
    other = Workspace.of(changed).mechanism
    for joints in (Joints(0.3, 1.2, 1.3), Joints(1.9, 2.0, 1.1)):
        assert other.fk(joints) == pytest.approx(WORKSPACE.mechanism.fk(joints), abs=1e-12)


def test_the_example_of_a_calibration() -> None:
    figures = runpy.run_path(str(ROOT / "scripts" / "calibration_figures.py"))
    result = figures["example"]()
    assert len(result.observations) == 24
    assert result.outliers == (figures["MISREAD"] + 1,)
    holds("points are # mm (root mean square) from where the constants have them", 1e3 * result.rms_before)
    holds("after it # mm, which is the noise", 1e3 * result.rms_after)
    assert result.rms_after == pytest.approx(3e-4 * sqrt(3.0), rel=0.15)
