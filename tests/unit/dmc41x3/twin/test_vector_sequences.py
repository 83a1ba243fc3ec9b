"""Vector sequences (VM, VP, CR) on the machine, against paths and times worked out by themselves."""

from __future__ import annotations

from math import cos, hypot, pi, radians, sin, sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.language.codes import ErrorCode
from tests.unit.dmc41x3.twin.bench import Bench
from tests.unit.dmc41x3.twin.exact_path import Curve, ExactPath, Line, Trapezoid


def begun(path: ExactPath, rates: str = "VS 20000;VA 102400;VD 51200", setup: str = "VM AB") -> Bench:
    bench = Bench()
    bench.do(setup, rates, *path.commands, "VE", "BGS")
    return bench


def place(bench: Bench, t: float, axes: tuple[int, int] = (0, 1)) -> tuple[float, float]:
    """Return the references of two axes at a time, not rounded [counts]."""
    bench.at(t)
    return bench.axis(axes[0]).timeline.at(t)[0], bench.axis(axes[1]).timeline.at(t)[0]


def distance(a: tuple[float, float], b: tuple[float, float]) -> float:
    return hypot(a[0] - b[0], a[1] - b[1])


def test_racetrack_ends_at_its_start() -> None:
    bench = begun(ExactPath().line_to(10_000, 0).arc(5000, -90, 180).line_to(0, 10_000).arc(5000, 90, 180))
    assert bench.value("_VES") == pytest.approx(20_000 + 10_000 * pi, abs=1e-3)
    assert bench.say("SC") == " 100, 100, 1\r\n:"
    assert bench.record().axes[0].coordinated
    # 0.195 s and 0.391 s of ramps cover 1953 and 3906 counts.
    duration = 20_000 / 102_400 + 20_000 / 51_200 + (20_000 + 10_000 * pi - 1953.125 - 3906.25) / 20_000
    assert bench.at(duration - 0.001).value("_BGS") == 1.0
    assert bench.at(duration + 0.001).value("_BGS") == 0.0
    assert bench.say("SC") == " 101, 101, 1\r\n:"
    assert bench.positions() == [0, 0, 0]


def test_a_quarter_circle_halfway_is_at_45_degrees() -> None:
    bench = begun(ExactPath().arc(20_000, 0, 90), "VS 1000000;VA 10240;VD 10240")
    half = sqrt(10_000 * pi / 10_240)
    x, y = place(bench, half)
    assert x == pytest.approx(20_000 * (cos(pi / 4) - 1), abs=0.2)
    assert y == pytest.approx(20_000 * sin(pi / 4), abs=0.2)
    assert bench.value("_VMS") == pytest.approx(10_240 * half, abs=1e-3)
    assert bench.at(3 * half).positions() == [-20_000, 20_000, 0]


def test_a_negative_angle_runs_clockwise() -> None:
    bench = begun(ExactPath().arc(1000, 0, -90))
    assert bench.at(9.0).positions() == [-1000, -1000, 0]


def test_the_first_letter_of_vm_is_x() -> None:
    bench = begun(ExactPath().line_to(3000, -400), setup="VM CA")
    assert bench.at(9.0).positions() == [-400, 0, 3000]


def test_positions_count_from_the_start_of_the_sequence() -> None:
    bench = Bench()
    bench.do("DP 777,-555", "VM AB", "VP 1000,0", "VP 1000,1000", "VE", "BGS")
    assert bench.at(9.0).positions() == [1777, 445, 0]
    bench.do("VP 1000,0", "VP 0,0", "VE", "BGS")
    assert bench.value("_VES") == 2000.0
    assert bench.at(20.0).positions() == [1777, 445, 0]


TURNS = st.integers(-32_000, 32_000).filter(bool)
PARTS = st.lists(
    st.tuples(st.just("VP"), st.integers(-50_000, 50_000), st.integers(-50_000, 50_000), st.just(0))
    | st.tuples(st.just("CR"), st.integers(10, 30_000), st.integers(-720, 720), st.integers(-720, 720).filter(bool)),
    min_size=1,
    max_size=6,
)
RATES = st.tuples(st.integers(1, 50_000), st.integers(1, 200), st.integers(1, 200))


def built(parts: list[tuple[str, int, int, int]]) -> ExactPath:
    path = ExactPath()
    for kind, a, b, c in parts:
        if kind == "CR":
            path.arc(a, b, c)
        elif distance(path.tip, (a, b)) >= 1.0:
            path.line_to(a, b)
    return path


@given(PARTS, RATES, st.lists(st.floats(0.0, 1.0), min_size=1, max_size=20))
def test_the_axes_are_on_the_path_at_the_right_time(
    parts: list[tuple[str, int, int, int]], rates: tuple[int, int, int], shares: list[float]
) -> None:
    path = built(parts)
    if not path.parts:
        return
    way = Trapezoid(path.length, 2.0 * rates[0], 1024.0 * rates[1], 1024.0 * rates[2])
    bench = begun(path, f"VS {2 * rates[0]};VA {1024 * rates[1]};VD {1024 * rates[2]}")
    for t in sorted(share * way.duration for share in shares):
        s, speed = way.at(t)
        resting = t >= way.duration * (1.0 - 1e-6)
        assert distance(place(bench, t), path.at(s)) <= (
            sqrt(0.5) + 1e-3 if resting else 0.5
        )  # it rests on whole counts
        if not resting:
            assert bench.value("_VMS") == pytest.approx(speed, rel=1e-4, abs=1e-3)
            assert bench.value("_AVS") == pytest.approx(s, abs=1e-3)
    x, y, _ = bench.at(way.duration + 0.001).positions()
    assert bench.value("_BGS") == 0.0
    assert distance((x, y), path.tip) <= sqrt(0.5) + 1e-3


@given(PARTS, st.floats(0.0, 1.0), st.integers(1, 200))
def test_a_stop_at_any_instant_rests_on_the_path(
    parts: list[tuple[str, int, int, int]], share: float, down: int
) -> None:
    path = built(parts)
    if not path.parts:
        return
    way = Trapezoid(path.length, 20_000.0, 102_400.0, 1024.0 * down)
    bench = begun(path, f"VS 20000;VA 102400;VD {1024 * down}").at(share * way.duration)
    bench.do("ST S")
    s, speed = way.at(bench.now)
    rest = min(path.length, s + speed * speed / (2048.0 * down))
    x, y, _ = bench.at(1e4).positions()
    assert distance((x, y), path.at(rest)) <= sqrt(0.5) + 0.01
    assert bench.value("_AVS") == pytest.approx(rest, abs=0.01)
    if share < 1.0 - 1e-9:  # at the very end it is over or not by rounding
        assert bench.value("_SCA") == 4.0


@pytest.mark.parametrize(("radius", "turn"), [(10, 32_000), (14_060, 31_999), (6_000_000, 74)])
def test_the_largest_arcs_stay_on_their_circle(radius: int, turn: int) -> None:
    path = ExactPath().arc(radius, 30, turn)
    bench = begun(path, "VS 15000000;VA 1073740800;VD 1073740800")
    way = Trapezoid(path.length, 15e6, 1_073_740_800.0, 1_073_740_800.0)
    centre = (-radius * cos(radians(30)), -radius * sin(radians(30)))
    for step in range(1, 400):
        here = place(bench, way.duration * step / 400)
        assert abs(distance(here, centre) - radius) <= 0.25
    x, y, _ = bench.at(way.duration + 0.01).positions()
    assert distance((x, y), path.tip) <= 1.0


def test_a_soft_limit_far_behind_a_long_arc_is_seen_in_time() -> None:
    bench = Bench()
    bench.do("FLA=100000", "VM AB", "VS 10000000;VA 1073740800;VD 1073740800")
    bench.do("CR 14060,0,31999", "VP 200000,0", "VE", "BGS")
    assert bench.at(0.0001).value("_SCA") == 100.0
    assert len(bench.axis(0).timeline.pieces) < 6000
    assert bench.at(2.0).say("SC") == " 2, 4, 1\r\n:"
    # Braking at VD from 10 million counts/s takes 46 566 counts of a path that is nearly along A.
    assert bench.positions()[0] == pytest.approx(100_001 + 46_566, abs=150)


def test_speed_is_continuous_at_the_end_of_a_timeline_piece() -> None:
    bench = begun(ExactPath().arc(14_060, 0, 31_999), "VS 15000000;VA 1073740800;VD 1073740800")
    slowest = min(
        hypot(*(bench.at(t).axis(i).timeline.at(t)[1] for i in (0, 1)))
        for t in (0.02 + 0.0005 * step for step in range(900))
    )
    assert slowest == pytest.approx(15e6, rel=0.002)


def test_an_appended_arc_behind_a_long_one_waits_for_its_turn() -> None:
    bench = Bench()
    bench.do("VM AB", "VS 15000000;VA 1073740800;VD 1073740800", "CR 14060,0,31999", "BGS")
    bench.at(0.05).do("CR 14060,319,90", "VE")
    path = ExactPath().arc(14_060, 0, 31_999).arc(14_060, 319, 90)
    x, y, _ = bench.at(2.0).positions()
    assert distance((x, y), path.tip) <= 1.0


def test_segments_may_follow_while_the_sequence_runs() -> None:
    path = ExactPath().line_to(20_000, 0).arc(10_000, -90, 90).line_to(30_000, 30_000)
    bench = Bench()
    bench.do("VM AB", "VS 20000;VA 102400;VD 51200", path.commands[0], "BGS")
    bench.at(0.5).do(path.commands[1])
    bench.at(1.0).do(path.commands[2], "VE")
    assert bench.code("VP 0,0") == ErrorCode.NOT_WHILE_RUNNING
    way = Trapezoid(path.length, 20_000.0, 102_400.0, 51_200.0)
    for step in range(10, 41):
        t = way.duration * step / 40
        assert distance(place(bench, t), path.at(way.at(t)[0])) <= 0.5
    assert bench.at(9.0).positions() == [30_000, 30_000, 0]


def test_an_arc_has_a_start_and_an_end_speed() -> None:
    bench = Bench()
    bench.do("VM AB", "VS 20000;VA 102400;VD 102400", "CR 10000,-90,180<8000>4000", "VP -9000,20000", "VE", "BGS")
    assert bench.at(2.0).value("_VMS") == 8000.0
    corner = 8000 / 102_400 + 4000 / 102_400 + (10_000 * pi - 312.5 - (8000**2 - 4000**2) / 204_800) / 8000
    assert bench.at(corner).value("_VMS") == pytest.approx(4000.0, abs=0.5)
    x, y = place(bench, corner)
    assert distance((x, y), (0.0, 20_000.0)) <= 0.5


def test_the_count_and_the_last_corner() -> None:
    bench = Bench()
    bench.do("DP 500", "VM AB", "VS 10000", "VP 5000,0", "CR 5000,-90,90", "VP 10000,20000", "VE", "BGS")
    assert (bench.value("_CSS"), bench.value("_VPA"), bench.value("_LMS")) == (0.0, 500.0, 508.0)
    bench.at(0.9)
    assert (bench.value("_CSS"), bench.value("_VPA"), bench.value("_VPB")) == (1.0, 5500.0, 0.0)
    bench.at(1.6)
    assert (bench.value("_CSS"), bench.value("_VPA"), bench.value("_VPB")) == (2.0, 10_500.0, 5000.0)
    assert bench.value("_LMS") == 510.0
    bench.at(9.0)
    assert (bench.value("_CSS"), bench.value("_VPA"), bench.value("_VPB")) == (3.0, 10_500.0, 20_000.0)


def test_an_arc_turns_its_members_round_at_a_limit() -> None:
    bench = Bench()
    bench.do("VM AB", "VS 20000", "CR 20000,0,180", "VE")
    bench.switch(1, reverse=False)
    bench.do("BGS")
    assert bench.at(1.0).value("_SCB") == 100.0
    # A quarter of the circle on, at about pi/2 s, B turns back towards its switch.
    assert bench.at(2.2).say("SC") == " 4, 3, 1\r\n:"


def test_a_soft_limit_within_an_arc_stops_on_the_arc() -> None:
    bench = Bench()
    bench.do("FLB=15000", "VM AB", "VS 20000;VD 102400", "CR 20000,0,180", "VE", "BGS")
    x, y, _ = bench.at(9.0).positions()
    assert bench.say("SC") == " 4, 2, 1\r\n:"
    assert 15_001 < y < 17_000
    assert distance((x, y), (-20_000.0, 0.0)) == pytest.approx(20_000, abs=1.0)


def test_vr_slows_an_arc_at_once() -> None:
    bench = begun(ExactPath().arc(20_000, 0, 360)).at(1.0)
    bench.do("VR 0.5")
    bench.at(1.2)
    assert bench.value("_VMS") == 10_000.0
    bench.do("VR 0")
    here = place(bench, 3.0)
    assert distance(here, (-20_000.0, 0.0)) == pytest.approx(20_000, abs=0.3)
    assert place(bench, 50.0) == here
    bench.do("VR 1")
    assert bench.at(99.0).positions() == [0, 0, 0]


def test_without_ve_the_sequence_stops_dead() -> None:
    bench = Bench()
    bench.do("VM AB", "VS 10000", "CR 1000,0,90", "BGS")
    assert bench.at(9.0).say("SC") == " 1, 1, 1\r\n:"
    assert bench.positions() == [-1000, 1000, 0]


class TestTangent:
    def test_the_tangent_axis_turns_with_the_path(self) -> None:
        bench = Bench()
        bench.do("VM ABC", "TN 10,-500", "VS 10000;VA 1024000;VD 1024000", "CR 5000,0,180", "VE")
        assert bench.value("_TNS") == 400.0
        bench.do("PAC=_TN;BGC")
        bench.at(5.0).do("BGS")
        # Half of the arc done after pi/4 s, and half an acceleration.
        bench.at(5.0 + 2500 * pi / 10_000 + 0.5 * 10_000 / 1_024_000)
        assert bench.value("_RPC") == pytest.approx(10 * 180 - 500, abs=1.0)
        assert bench.value("_SCC") == 100.0
        bench.at(9.0)
        assert bench.positions()[2] == 10 * 270 - 500

    def test_a_corner_turns_it_the_shorter_way_at_once(self) -> None:
        bench = Bench()
        bench.do("VM ABC", "TN 1", "VS 10000", "VP -10000,1", "VP -20000,0", "VE", "BGS")
        assert bench.at(0.9).positions()[2] == 180
        assert bench.at(1.5).positions()[2] == 180
        bench.at(9.0)
        bench.do("VM ABC", "VP 0,10000", "VP 0,0", "VE", "BGS")
        assert bench.at(9.5).positions()[2] == 90
        bench.at(20.0)
        assert abs(bench.positions()[2]) in (90, 270)

    def test_it_has_an_absolute_place(self) -> None:
        bench = Bench()
        bench.do("DPC=123", "VM ABC", "TN 2,50", "VP 1000,1000", "VE", "BGS")
        assert bench.at(5.0).positions() == [1000, 1000, 140]

    def test_it_does_not_count_in_the_speed(self) -> None:
        bench = Bench()
        bench.do("VM ABC", "TN 127", "VS 10000", "CR 10000,0,90", "VE")
        assert bench.value("_VES") == pytest.approx(5000 * pi, abs=1e-3)


@pytest.mark.parametrize(("scale", "end"), [("3,4", (-3000, 4000)), ("4,2", (-6000, 3000)), ("5,5", (-3000, 3000))])
def test_the_ellipse_scale_stretches_the_axis_of_the_higher_resolution(scale: str, end: tuple[int, int]) -> None:
    bench = Bench()
    bench.do("VM AB", f"ES {scale}", "CR 3000,0,90", "VE", "BGS")
    assert bench.at(9.0).positions()[:2] == list(end)


def test_virtual_axis_may_replace_y() -> None:
    bench = Bench()
    bench.do("VM AN", "VS 10000", "CR 10000,0,360", "VE", "BGS")
    assert bench.say("SC") == " 100, 1, 1\r\n:"
    t = 10_000 / 256_000 / 2 + pi
    assert bench.at(t).positions()[0] == pytest.approx(-20_000, abs=1)
    assert bench.value("_RPN") == pytest.approx(0.0, abs=1)
    bench.at(20.0)
    assert bench.positions() == [0, 0, 0]


def test_exact_paths_agree_with_themselves() -> None:
    path = ExactPath().arc(1000, 0, 90).line_to(-1000, 3000)
    assert isinstance(path.parts[0], Curve)
    assert isinstance(path.parts[1], Line)
    assert path.at(path.parts[0].length) == pytest.approx((-1000, 1000))
    assert path.length == pytest.approx(500 * pi + 2000)
