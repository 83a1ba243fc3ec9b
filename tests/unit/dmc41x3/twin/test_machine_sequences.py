from __future__ import annotations

from math import hypot

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.language.codes import ErrorCode
from tests.unit.dmc41x3.twin.bench import Bench


def sequence(*segments: str, speed: int = 10_240, closed: bool = True, axes: str = "AB") -> Bench:
    bench = Bench()
    bench.do(f"CS S;LM {axes}", f"VS {speed};VA 10240;VD 10240", *(f"LI {segment}" for segment in segments))
    bench.do(*["LE"] * closed, "BGS")
    return bench


def test_a_straight_line_is_a_trapezoid_of_the_vector_speed() -> None:
    bench = sequence("30720,40960")  # 51 200 along the path: 1 s up, 4 s on, 1 s down
    assert bench.at(3.0).value("_VMS") == 10_240.0
    assert (bench.value("_TVA"), bench.value("_TVB")) == (6144.0, 8192.0)
    assert bench.say("SC") == " 100, 100, 1\r\n:"
    assert bench.record().s.moving
    assert bench.record().axes[1].coordinated
    assert not bench.record().axes[2].moving
    assert bench.at(5.99).value("_BGS") == 1.0
    assert bench.at(6.01).value("_BGS") == 0.0
    assert bench.say("SC") == " 101, 101, 1\r\n:"
    assert bench.positions() == [30_720, 40_960, 0]


def test_an_axis_listed_takes_part_even_if_it_does_not_move() -> None:
    bench = sequence("20480", axes="AC").at(1.0)
    assert bench.record().axes[2].moving
    assert bench.code("BGC") == ErrorCode.BEGIN_WHILE_RUNNING


@given(
    st.lists(
        st.tuples(st.integers(-9000, 9000), st.integers(-9000, 9000), st.integers(1, 9000)), min_size=1, max_size=20
    ),
    st.integers(1, 20_000),
    st.floats(0, 3),
)
def test_sequences_end_on_the_count(segments: list[tuple[int, int, int]], speed: int, more_at: float) -> None:
    bench = Bench()
    bench.do("LM ABC", f"VS {2 * speed}")
    bench.do(*(f"LI {a},{b},{c}" for a, b, c in segments), "BGS")
    bench.at(more_at)
    bench.do("LI 10,-10,10", "LE")
    running = bench.value("_BGS") == 1.0
    if not running:
        bench.do("BGS")
    bench.at(1e6)
    columns = zip(*segments, (10, -10, 10), strict=True)
    assert bench.positions() == [sum(column) for column in columns]


def test_the_speed_is_the_norm_of_the_axes_along_the_whole_path() -> None:
    bench = sequence("4000,3000", "0,5000", "-4000,3000")
    last = (0, 0)
    for step in range(1, 400):
        here = bench.at(step * 0.01).positions()
        assert hypot(here[0] - last[0], here[1] - last[1]) <= 102.4 + 1.5
        last = (here[0], here[1])


@given(st.floats(0.01, 5.9), st.booleans())
def test_a_stop_stays_on_the_path(when: float, by_axis: bool) -> None:
    bench = sequence("30720,40960").at(when)
    before = bench.value("_AVS")
    speed = bench.value("_VMS")
    bench.do("STA" if by_axis else "ST S")
    assert bench.say("SC") == " 4, 4, 1\r\n:"
    rest = bench.at(when + 2.0).positions()
    assert abs(rest[0] * 40_960 - rest[1] * 30_720) / 51_200 <= 1.0
    assert bench.value("_BGS") == 0.0
    assert bench.value("_AVS") - before == pytest.approx(speed**2 / (2 * 10_240), abs=2.0)
    assert bench.code("BGS") == ErrorCode.NO_SEQUENCE


def test_a_stop_runs_through_the_segments_ahead() -> None:
    bench = sequence("10240", "0,1024", "1024", "0,10240").at(1.5)
    bench.do("ST S")
    assert bench.at(4.0).positions() == [10_240 + 1_024, 1_024 + 3_072, 0]


def test_without_le_the_sequence_stops_dead_at_its_end() -> None:
    bench = sequence("10240", closed=False)
    assert bench.at(1.49).value("_VMS") == 10_240.0
    bench.at(1.51)
    assert (bench.value("_BGS"), bench.value("_SCA")) == (0.0, 1.0)
    assert bench.positions()[0] == 10_240


def test_segments_may_follow_while_the_sequence_runs() -> None:
    bench = sequence("10240", closed=False).at(1.2)
    bench.do("LI 10240", "LE")
    assert bench.value("_LMS") == 509.0
    assert bench.code("LI 5") == ErrorCode.NOT_WHILE_RUNNING
    assert bench.at(9.0).say("SCA") == " 101\r\n:"
    assert bench.positions()[0] == 20_480


def test_segment_speeds() -> None:
    bench = sequence("20480<4096>2048", "20480<8192", "20480<-1")
    bench.do("VV 1024")
    assert bench.at(3.0).value("_VMS") == 4096.0
    boundary = 0.4 + (20_480 - 819.2 - 614.4) / 4096 + 0.2
    assert bench.at(boundary).value("_VMS") == pytest.approx(2048.0, abs=1.0)
    assert bench.value("_CSS") in (0.0, 1.0)
    assert bench.at(boundary + 2.0).value("_VMS") == 8192.0
    assert bench.at(boundary + 6.0).value("_VMS") == 1024.0
    assert bench.value("_CSS") == 2.0


def test_vs_and_vr_act_at_once_and_vd_waits() -> None:
    bench = sequence("102400").at(2.0)
    bench.do("VS 5120")
    assert bench.at(2.5).value("_VMS") == 5120.0
    bench.do("VR 0.5")
    assert bench.at(3.0).value("_VMS") == 2560.0
    bench.do("VR 0")
    assert bench.at(100.0).value("_VMS") == 0.0
    assert bench.value("_BGS") == 1.0
    bench.do("VR 1;VA 20480")
    assert bench.at(100.25).value("_VMS") == 5120.0
    assert bench.code("VD 20480") == ErrorCode.NOT_WHILE_RUNNING
    assert bench.at(200.0).positions()[0] == 102_400


@pytest.mark.parametrize(
    ("command", "code"),
    [
        ("BGS", ErrorCode.BEGIN_WHILE_RUNNING),
        ("BGA", ErrorCode.BEGIN_WHILE_RUNNING),
        ("CS S", ErrorCode.NOT_WHILE_RUNNING),
        ("LM ABC", ErrorCode.NOT_WHILE_RUNNING),
        ("PAA=1", ErrorCode.NOT_WHILE_RUNNING),
        ("MOA", ErrorCode.NOT_WHILE_RUNNING),
        ("DPB=0", ErrorCode.NOT_WHILE_RUNNING),
        ("IPA=5", ErrorCode.NOT_WHILE_RUNNING),
        ("JGA=5", ErrorCode.NOT_WHILE_RUNNING),
        ("LI 0,0", ErrorCode.SEGMENT_TOO_SHORT),
        ("LI 1,2,3", ErrorCode.OPERAND_ERROR),
        ("LI 8388608", ErrorCode.OUT_OF_RANGE),
        ("LI 5<1", ErrorCode.OUT_OF_RANGE),
        ("LI ?", ErrorCode.QUESTION_MARK_INVALID),
    ],
)
def test_running_sequence_refuses_commands(command: str, code: ErrorCode) -> None:
    assert sequence("51200", closed=False).at(1.0).code(command) == code


@pytest.mark.parametrize("command", ["LM AB", "VS 3000", "VA 2048", "DCA=2048", "ACA=2048", "PRC=1;BGC", "CA T"])
def test_running_sequence_accepts_commands(command: str) -> None:
    sequence("51200").at(1.0).do(command)


def test_the_buffer_holds_511_segments() -> None:
    bench = Bench()
    bench.do("LM A", *["LI 100"] * 511)
    assert bench.value("_LMS") == 0.0
    assert bench.code("LI 100") == ErrorCode.SEGMENT_BUFFER_FULL
    assert bench.value("_LES") == 51_100.0
    bench.do("BGS")
    bench.at(1.0).do("LI 100", "LE")
    assert bench.at(1000.0).positions()[0] == 51_200


def test_begin_needs_every_member_ready() -> None:
    bench = Bench()
    bench.do("MOB", "LM AB", "LI 100,100", "LE")
    assert bench.code("BGS") == ErrorCode.BEGIN_MOTOR_OFF
    bench.do("SHB")
    bench.switch(1, forward=False)
    assert bench.code("BGS") == ErrorCode.BEGIN_AT_LIMIT
    bench.switch(1)
    bench.do("BGS")


def test_a_limit_of_a_member_stops_the_plane_on_its_path() -> None:
    bench = sequence("30720,40960").at(2.0)
    bench.switch(1, forward=False)
    assert bench.say("SC") == " 4, 2, 1\r\n:"
    rest = bench.at(5.0).positions()
    assert abs(rest[0] * 4 - rest[1] * 3) <= 7
    assert bench.say("SC") == " 4, 2, 1\r\n:"


def test_a_member_that_turns_towards_an_active_limit_stops_the_plane() -> None:
    bench = Bench()
    bench.do("LM AB", "VA 10240;VD 102400;VS 10240")
    bench.switch(1, reverse=False)
    bench.do("LI 20480,100", "LI 20480,-100", "LE", "BGS")
    bench.at(4.0)
    assert bench.say("SC") == " 4, 3, 1\r\n:"


def test_an_error_of_a_member_stops_its_partners() -> None:
    bench = sequence("51200,51200")
    bench.do("ERA=500;OEA=1")
    bench.at(2.0)
    bench.plant.hold(0)
    bench.at(2.2)
    assert bench.say("SC") == " 8, 4, 1\r\n:"
    assert (bench.value("_MOA"), bench.value("_MOB")) == (1.0, 0.0)
    assert bench.at(5.0).value("_BGS") == 0.0


def test_abort_ends_a_sequence_at_once() -> None:
    bench = sequence("51200,0").at(2.0)
    bench.do("AB")
    assert bench.positions()[0] == 15_360
    assert bench.value("_BGS") == 0.0
    assert bench.say("SC") == " 7, 7, 7\r\n:"


def test_planes_s_and_t_run_side_by_side() -> None:
    bench = Bench()
    bench.do("CA T;LM C;LI ,,5000;LE", "CA S;LM AB;LI 5000,5000;LE", "BGST")
    assert bench.value("_BGT") == bench.value("_BGS") == 1.0
    assert bench.at(9.0).positions() == [5000, 5000, 5000]


def test_count_and_distance_along_the_way() -> None:
    bench = sequence("10240", "10240", "10240").at(2.0)
    assert bench.value("_CSS") == 1.0
    assert bench.value("_AVS") == 15_360.0
    assert bench.record().s.distance == 15_360
    bench.at(9.0)
    assert (bench.value("_CSS"), bench.value("_AVS")) == (3.0, 30_720.0)


def test_segments_in_one_direction_cause_no_reversal() -> None:
    bench = sequence("10240", "10240", closed=False).at(1.2)
    for _ in range(5):
        bench.do("LI 5000")
        bench.at(bench.now + 0.01)
    assert bench.axis(0).turns == []
    bench.do("LI -5000", "LI 5000")
    bench.at(bench.now + 0.01)
    assert len(bench.axis(0).turns) == 2
