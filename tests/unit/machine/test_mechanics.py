"""Maya's body: following, switches, stops, the coupling, torque, motors off, the gripper, the record."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import cos, inf, pi, sin
from random import Random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.twin.plant import BenchPlant, Plant
from dmc41x3.twin.timeline import TimelinePiece
from maya_un.machine.mechanics import MayaMechanics
from maya_un.machine.truth import StartPose, Statics, TrueConstants

A, B, C = range(3)
COUNT = 1e-6
SYMMETRIC = StartPose(1.0, 1.25, 1.25)


def powered(
    start: StartPose = SYMMETRIC,
    truth: TrueConstants | None = None,
    *,
    trace: bool = False,
    **parts: tuple[float, float, float],
) -> MayaMechanics:
    maya = MayaMechanics(truth or TrueConstants(), start, parts, trace=trace)
    for axis in (A, B, C):
        maya.power(axis, True)
    return maya


def go(maya: MayaMechanics, axis: int, distance: float, speed: float = 10_000.0) -> float:
    """Plan a constant-speed motion from now; return when the reference is there."""
    t = maya.now
    line = maya.timelines[axis]
    p, _ = line.at(t)
    end = t + abs(distance) / speed
    line.plan(
        t, (TimelinePiece(t, p, speed if distance > 0 else -speed, 0.0), TimelinePiece(end, p + distance, 0.0, 0.0))
    )
    return end


def run(maya: MayaMechanics, until: float) -> list[float]:
    """Advance as a machine does, from event to event; return the events."""
    events: list[float] = []
    while (event := maya.next_event(until)) is not None:
        assert maya.now < event <= until
        maya.advance(event)
        events.append(event)
    maya.advance(until)
    return events


def settle(maya: MayaMechanics, axis: int, distance: float, speed: float = 10_000.0) -> list[float]:
    return run(maya, go(maya, axis, distance, speed) + 0.1)


def is_plant(plant: Plant) -> bool:
    return len(plant.timelines) == 3


def test_mechanics_and_bench_are_plants() -> None:
    assert is_plant(powered())
    assert is_plant(BenchPlant())


def test_an_axis_follows_its_reference_late() -> None:
    maya = powered(truth=TrueConstants(lag=(0.02, 0.02, 0.04)))
    go(maya, B, 45_000.0, 45_000.0)
    go(maya, C, 45_000.0, 45_000.0)
    maya.advance(0.5)
    assert maya.position(B) == pytest.approx(45_000 * 0.48)
    assert maya.position(C) == pytest.approx(45_000 * 0.46)
    assert maya.velocity(B) == 45_000.0
    maya.advance(2.0)
    assert maya.position(B) == maya.position(C) == 45_000.0
    assert maya.velocity(B) == 0.0
    assert maya.true_joints() == pytest.approx((1.0, 1.295, 1.295))


def test_gripper_position_follows_the_lines() -> None:
    maya = powered(StartPose(pi / 6, 1.20, 1.60))
    assert maya.gripper_point() == pytest.approx((1.02 * sin(pi / 6), 1.02 * cos(pi / 6), 1.19))
    assert maya.tension() == pytest.approx((0.8, 0.6))


def test_time_does_not_go_back() -> None:
    maya = powered()
    maya.advance(3.0)
    maya.advance(1.0)
    assert maya.now == 3.0
    assert maya.next_event(3.0) is None


def test_rest_has_no_events_however_long() -> None:
    assert run(powered(), 1e6) == []


@pytest.mark.parametrize(
    ("axis", "start", "distance", "input_"),
    [
        (A, StartPose(0.02, 1.25, 1.25), -500.0, 1),
        (A, StartPose(2 * pi / 3 - 0.02, 1.25, 1.25), 500.0, 0),
        (B, StartPose(1.0, 0.58, 1.9), -10_000.0, 1),
        (B, StartPose(1.0, 2.25, 1.3), 15_000.0, 0),
        (C, StartPose(1.0, 1.9, 0.57), -10_000.0, 1),
        (C, StartPose(1.0, 1.3, 2.29), 15_000.0, 0),
    ],
)
def test_a_switch_trips_on_the_way_and_stays_active_beyond(
    axis: int, start: StartPose, distance: float, input_: int
) -> None:
    maya = powered(start)
    assert maya.inputs(axis) == (True, True, True)
    events = settle(maya, axis, distance)
    assert len(events) == 1
    assert maya.inputs(axis)[input_] is False
    assert maya.inputs(axis)[1 - input_] is True
    switch = TrueConstants().switches[axis][1 - input_]
    travelled = (switch - start[axis]) * TrueConstants().scale[axis]
    assert events[0] == pytest.approx(abs(travelled) / 10_000.0 + 0.02, abs=1e-5)
    assert len(settle(maya, axis, -distance)) == 1
    assert maya.inputs(axis) == (True, True, True)


def test_a_start_on_a_switch_reads_active_at_once() -> None:
    assert MayaMechanics(TrueConstants(), StartPose(1.0, 0.575, 1.9)).inputs(B) == (True, False, True)


def test_coming_to_rest_exactly_on_a_switch_trips_it() -> None:
    maya = powered(StartPose(1.0, 0.585, 1.9))
    assert len(settle(maya, B, -10_000.0)) == 1
    assert maya.inputs(B)[1] is False


def test_wiring_decides_the_level_not_the_switch() -> None:
    maya = MayaMechanics(TrueConstants().with_wiring(True, B), StartPose(1.0, 0.575, 1.9))
    assert maya.inputs(B) == (False, True, True)
    assert maya.inputs(C) == (True, True, True)


def test_letters_decide_which_axis_of_the_controller_drives_what() -> None:
    """a is on B, b on C and c on A."""
    maya = powered(truth=replace(TrueConstants(), letters="BCA"))
    maya.advance(go(maya, A, -10_000.0) + 1.0)
    assert maya.true_joints() == pytest.approx((1.0, 1.25, 1.24))
    assert [round(maya.position(axis)) for axis in (A, B, C)] == [-10_000, 0, 0]
    maya.fail_encoder(A, True)
    maya.power(A, False)
    assert (maya.torque(A), maya.velocity(A)) == (0.0, 0.0)
    beyond = MayaMechanics(replace(TrueConstants(), letters="BCA"), StartPose(1.0, 1.25, 2.31))
    assert [beyond.inputs(axis)[0] for axis in (A, B, C)] == [False, True, True]


def test_a_hard_stop_blocks_and_the_motor_pushes_harder_and_harder() -> None:
    maya = powered(StartPose(1.0, 1.4, 2.30))
    t = go(maya, C, 30_000.0)
    run(maya, 2.02 + 0.1)
    assert maya.position(C) == pytest.approx(20_000.0, abs=1.1)
    assert maya.velocity(C) == 0.0
    assert maya.torque(C) == pytest.approx(0.1 + 1000.0 * 9.9982 / 4000.0, rel=0.01)
    run(maya, t + 0.1)
    assert maya.torque(C) == 9.9982
    assert maya.record.stalled[C] == pytest.approx(t + 0.1 - 2.02, abs=0.005)
    assert maya.record.stalled[:2] == (0.0, 0.0)


def test_leaving_a_hard_stop_ends_the_stall() -> None:
    maya = powered(StartPose(1.0, 1.4, 2.30))
    settle(maya, C, 25_000.0)
    mark = maya.record.mark()
    settle(maya, C, -25_000.0)
    assert maya.position(C) == pytest.approx(0.0, abs=1e-6)
    assert 0.4 < maya.record.since(mark).stalled[C] < 0.6
    assert run(maya, maya.now + 10.0) == []


def test_contact_makes_the_machine_look_every_two_milliseconds() -> None:
    maya = powered(StartPose(1.0, 1.4, 2.30))
    events = settle(maya, C, 25_000.0)
    assert np.diff(events[1:]).max() <= 0.002 + 1e-12
    assert len(events) > 200


def test_two_short_lines_cannot_be_pulled_straight() -> None:
    maya = powered(StartPose(1.0, 1.01, 1.01))
    settle(maya, B, -30_000.0)
    _, b, c = maya.true_joints()
    assert (b, c) == pytest.approx((0.99, 1.01), abs=2 * COUNT)
    assert maya.torque(B) == -9.9982
    assert maya.record.stalled[B] > 0.9
    assert maya.record.stalled[C] == 0.0
    assert maya.record.peak_tension == pytest.approx((9.9982 - 0.1) / 0.5)


def test_two_shortening_lines_are_both_blocked_and_share_the_rest() -> None:
    maya = powered(StartPose(1.0, 1.01, 1.01))
    go(maya, B, -30_000.0)
    settle(maya, C, -30_000.0)
    assert maya.true_joints()[1:] == pytest.approx((1.0, 1.0), abs=2 * COUNT)
    assert min(maya.record.stalled[1:]) > 1.9


def test_lengthening_line_slackens_the_other() -> None:
    maya = powered(StartPose(1.0, 1.01, 1.01))
    settle(maya, B, -30_000.0)
    settle(maya, C, 5_000.0)
    assert maya.true_joints()[1:] == pytest.approx((0.985, 1.015), abs=2 * COUNT)
    settle(maya, C, 20_000.0)
    assert maya.true_joints()[1:] == pytest.approx((0.98, 1.035), abs=2 * COUNT)
    assert run(maya, maya.now + 5.0) == []


def test_switching_the_pushing_motor_off_ends_the_stall() -> None:
    maya = powered(StartPose(1.0, 1.01, 1.01))
    settle(maya, B, -30_000.0)
    maya.power(B, False)
    mark, b = maya.record.mark(), maya.position(B)
    run(maya, maya.now + 1.0)
    assert maya.record.since(mark).stall_time <= 0.002
    assert maya.position(B) == b
    assert maya.torque(B) == 0.0


def test_switched_on_at_the_contact_it_rests_there() -> None:
    maya = powered(StartPose(1.0, 1.01, 1.01))
    settle(maya, B, -30_000.0)
    maya.power(B, False)
    run(maya, maya.now + 1.0)
    maya.timelines[B].plan(maya.now, (TimelinePiece(maya.now, round(maya.position(B)), 0.0, 0.0),))
    maya.power(B, True)
    assert run(maya, maya.now + 5.0) == []


@given(st.integers(0, 10_000))
def test_lengths_never_break_the_coupling_nor_pass_a_stop(seed: int) -> None:
    rng = Random(seed)
    truth = TrueConstants.drawn(rng)
    maya = powered(StartPose(1.0, rng.uniform(0.9, 1.2), rng.uniform(1.11, 1.3)), truth, trace=True)
    for _ in range(5):
        t = maya.now
        for axis in (B, C):
            p, speed = maya.timelines[axis].at(t)[0], rng.uniform(-3e5, 3e5)
            far = t + rng.uniform(0.1, 0.4)
            pieces = (TimelinePiece(t, p, speed, 0.0), TimelinePiece(far, p + speed * (far - t), 0.0, 0.0))
            maya.timelines[axis].plan(t, pieces)
        run(maya, t + rng.uniform(0.1, 0.6))
    trace = maya.record.trace
    assert (trace.b + trace.c).min() >= truth.width - 1.1 * COUNT
    for lengths, (short, long), gap in zip((trace.b, trace.c), truth.switches[1:], truth.gaps[1:], strict=True):
        assert short - gap - 1.1 * COUNT <= lengths.min()
        assert lengths.max() <= long + gap + 1.1 * COUNT
    assert np.diff(trace.t).min() >= 0.0


def test_contact_is_found_between_two_events_and_within_a_curved_motion() -> None:
    maya = powered(StartPose(1.0, 1.01, 1.01))
    # b dips by 30 mm and comes back to where it began: only its middle would break the coupling
    maya.timelines[B].plan(0.0, (TimelinePiece(0.0, 0.0, -40_000.0, 26_666.7), TimelinePiece(3.0, 0.0, 0.0, 0.0)))
    events = run(maya, 4.0)
    assert 0.5 < events[0] < 1.5
    assert maya.record.stalled[B] > 0.5
    assert maya.position(B) == 0.0


@pytest.mark.parametrize(
    ("axis", "distance", "locking", "expected"),
    [
        (B, -5_000.0, True, -(0.5 * 0.833333 + 0.1)),
        (B, 5_000.0, True, 0.1),
        (B, 5_000.0, False, 0.1 - 0.5 * 0.833333),
        (C, -5_000.0, False, -(0.5 * 0.833333 + 0.1)),
        (A, 500.0, True, 0.1),
        (A, -500.0, False, -0.1),
    ],
)
def test_torque_lifts_the_load_against_friction(axis: int, distance: float, locking: bool, expected: float) -> None:
    maya = powered(truth=TrueConstants(self_locking=locking))
    go(maya, axis, distance)
    maya.advance(0.03)
    assert maya.torque(axis) == pytest.approx(expected, abs=1e-3)


def test_torque_at_rest_is_the_load_or_nothing() -> None:
    assert powered().torque(B) == 0.0
    assert powered(truth=TrueConstants(self_locking=False)).torque(B) == pytest.approx(-0.5 * 0.833333, abs=1e-6)
    assert powered(truth=TrueConstants(self_locking=False)).torque(A) == 0.0


def test_a_slack_line_moves_against_friction_only() -> None:
    maya = powered(StartPose(1.0, 0.58, 2.295))
    go(maya, C, -5_000.0)
    maya.advance(0.1)
    assert maya.torque(C) == -0.1


def test_a_locking_drum_holds_with_its_motor_off() -> None:
    maya = powered()
    go(maya, B, 50_000.0)
    maya.advance(1.0)
    maya.power(B, False)
    there = maya.position(B)
    maya.advance(20.0)
    assert maya.position(B) == there > 0.0
    assert maya.velocity(B) == 0.0


def test_without_power_unlocked_drums_let_the_gripper_down_to_the_stops() -> None:
    maya = powered(truth=TrueConstants(self_locking=False))
    maya.power(B, False)
    maya.power(C, False)
    run(maya, 1.0)
    assert maya.true_joints()[1:] == pytest.approx((1.30, 1.30), abs=1e-3)
    run(maya, 30.0)
    assert maya.true_joints()[1:] == pytest.approx((2.28, 2.32), abs=COUNT)
    assert maya.inputs(B)[0] is maya.inputs(C)[0] is False
    assert run(maya, 40.0) == []


def test_an_unlocked_line_stops_paying_out_when_it_is_slack() -> None:
    maya = powered(StartPose(1.0, 2.0, 0.65), TrueConstants(self_locking=False))
    maya.power(B, False)
    run(maya, 20.0)
    assert maya.true_joints()[1] == pytest.approx((2.0**2 + 0.65**2) ** 0.5, abs=2e-4)
    assert maya.record.peak_slack < 2e-4


def test_switching_on_again_does_not_jump_into_the_past_of_the_reference() -> None:
    maya = powered()
    go(maya, B, 50_000.0)
    maya.advance(1.0)
    maya.power(B, False)
    there = maya.position(B)
    maya.timelines[B].plan(1.0, (TimelinePiece(1.0, there, 0.0, 0.0),))
    maya.power(B, True)
    for t in np.linspace(1.0, 1.1, 20):
        maya.advance(float(t))
        assert maya.position(B) == there


def take(maya: MayaMechanics) -> None:
    maya.output(1, True)
    maya.output(1, False)


def test_gripper_is_closed_at_power_up_and_output_1_opens_it() -> None:
    maya = powered()
    assert maya.record.gripper_closed
    maya.output(2, True)
    assert maya.record.gripper_closed
    maya.output(1, True)
    assert not maya.record.gripper_closed


def test_a_part_is_carried_and_put_down() -> None:
    maya = powered(part=(1.3 * sin(1.0), 1.3 * cos(1.0), 1.4))
    take(maya)
    assert maya.record.carried == "part"
    settle(maya, A, -2_000.0)
    assert maya.parts["part"] == pytest.approx(maya.gripper_point())
    maya.output(1, True)
    assert maya.record.drops == ()
    settle(maya, A, 2_000.0)
    angle = 1.0 - 2_000.0 / TrueConstants().scale[A]
    assert maya.parts["part"] == pytest.approx((1.3 * sin(angle), 1.3 * cos(angle), 1.4))


def test_letting_go_high_up_is_a_recorded_drop() -> None:
    maya = powered(part=(1.3 * sin(1.0), 1.3 * cos(1.0), 1.4))
    take(maya)
    settle(maya, B, -50_000.0)
    mark = maya.record.mark()
    maya.output(1, True)
    [drop] = maya.record.since(mark).drops
    assert drop.name == "part"
    assert drop.height == pytest.approx(maya.gripper_point()[2] - 1.4)
    assert maya.parts["part"][2] == 1.4


def test_record_has_the_extremes_of_an_unobserved_motion() -> None:
    maya = powered(StartPose(1.0, 1.05, 1.05))
    maya.timelines[B].plan(0.0, (TimelinePiece(0.0, 0.0, -20_000.0, 20_000.0), TimelinePiece(2.0, 0.0, 0.0, 0.0)))
    maya.advance(1000.0)
    # halfway b is 10 mm shorter: 1.04 and 1.05
    hang = Statics().hang(1.04, 1.05)
    assert maya.record.peak_tension == pytest.approx(hang.tension, rel=1e-6)
    assert maya.record.whole.highest == pytest.approx(hang.z, abs=1e-9)
    assert maya.record.whole.low == pytest.approx((1.0, 1.04, 1.05), abs=1e-9)
    assert maya.record.lowest == maya.record.start_height == pytest.approx(Statics().hang(1.05, 1.05).z)
    assert maya.record.sunk == 0.0


def test_frequency_of_reading_does_not_change_the_record() -> None:
    once, often = (powered(StartPose(1.0, 1.5, 1.2), trace=True) for _ in range(2))
    for maya in (once, often):
        go(maya, B, -150_000.0, 30_000.0)
        go(maya, C, 450_000.0, 45_000.0)
    once.advance(12.0)
    for t in np.arange(0.0, 12.0, 0.037):
        often.advance(float(t))
        assert often.record.peak_tension > 0.0
    often.advance(12.0)
    for name in ("tension", "slack", "lowest", "highest", "outside"):
        assert getattr(often.record.whole, name) == pytest.approx(getattr(once.record.whole, name), abs=1e-5)
    assert np.diff(once.record.trace.t[:200]).max() <= 0.05 + 1e-9


def test_a_mark_begins_a_fresh_window() -> None:
    maya = powered()
    settle(maya, B, -100_000.0)
    settle(maya, B, 100_000.0)
    mark = maya.record.mark()
    settle(maya, B, 1_000.0)
    window = maya.record.since(mark)
    assert window.tension < maya.record.peak_tension
    assert window.start_height == pytest.approx(1.40, abs=1e-6)
    assert window.sunk == pytest.approx(1.40 - maya.gripper_point()[2], abs=1e-9)
    assert maya.record.since(0) == maya.record.whole


def test_travel_with_a_slack_line_is_counted() -> None:
    maya = powered(StartPose(1.0, 0.60, 2.08))
    settle(maya, C, 50_000.0)
    assert maya.record.peak_slack == pytest.approx(2.13 - (4 + 0.36) ** 0.5, abs=1e-9)
    assert maya.record.outside == pytest.approx(2.13 - (4 + 0.36) ** 0.5, abs=1e-3)


def test_record_cannot_be_written() -> None:
    record = powered().record
    for name in ("peak_tension", "parts", "lowest", "stalled"):
        with pytest.raises(AttributeError):
            setattr(record, name, 0)
    record.parts["new"] = (0.0, 0.0, 0.0)
    assert record.parts == {}
    with pytest.raises(AttributeError):
        record.whole.__setattr__("tension", 0.0)


def test_a_jog_without_end_is_followed_to_the_switch_and_the_stop() -> None:
    maya = powered(StartPose(1.0, 1.25, 2.0))
    maya.timelines[C].plan(0.0, (TimelinePiece(0.0, 0.0, 10_000.0, 0.0),))
    assert maya.next_event(20.0) is None
    maya.advance(20.0)
    assert maya.next_event(inf) == pytest.approx(30.02)
    maya.advance(30.5)
    assert maya.inputs(C)[0] is False


def test_two_machines_with_the_same_truth_behave_the_same() -> None:
    def play(make: Callable[[], MayaMechanics]) -> tuple[float, ...]:
        maya = make()
        settle(maya, B, -300_000.0)
        settle(maya, C, 70_000.0)
        return (*maya.true_joints(), maya.record.stall_time, maya.record.peak_tension)

    truth = replace(TrueConstants.drawn(Random(5)), self_locking=True)
    assert play(lambda: powered(truth=truth)) == play(lambda: powered(truth=truth))


def test_a_line_with_its_motor_off_holds_against_the_other() -> None:
    maya = powered(StartPose(1.0, 1.01, 1.01))
    maya.power(C, False)
    events = settle(maya, B, -30_000.0)
    assert events[0] == pytest.approx(2.02, abs=1e-3)
    assert maya.true_joints()[1:] == pytest.approx((0.99, 1.01), abs=2 * COUNT)
    assert maya.record.stalled[C] == 0.0


def test_a_motor_switched_on_into_a_running_reference_begins_late_and_meets_the_coupling() -> None:
    maya = powered(StartPose(1.0, 1.01, 1.01))
    maya.power(C, False)
    maya.advance(5.0)
    maya.power(C, True)
    go(maya, B, -15_000.0)
    go(maya, C, -15_000.0)
    assert maya.next_event(9.0) == pytest.approx(6.02, abs=1e-3)
    maya.advance(5.5)
    assert maya.position(C) == pytest.approx(-4_800.0)


def test_a_part_can_be_stood_on_the_table_later() -> None:
    maya = powered()
    maya.add_part("late", (0.1, 1.0, 0.4))
    assert maya.parts == {"late": (0.1, 1.0, 0.4)}
    with pytest.raises(ValueError, match="late"):
        maya.add_part("late", (0.1, 1.0, 0.4))


def test_a_weak_motor_does_not_move() -> None:
    maya = powered()
    maya.limit_torque(B, 0.05)
    maya.limit_torque(A, 0.05)
    go(maya, A, 1_000.0)
    settle(maya, B, -50_000.0)
    assert abs(maya.position(B)) <= 1.0
    assert abs(maya.position(A)) <= 1.0
    assert maya.record.stalled == (0.0, 0.0, 0.0)
    assert maya.record.limited[B] == pytest.approx(5.08, abs=0.01)
    assert maya.record.limited[A] > 4.9


def test_weak_motor_lengthens_if_friction_allows() -> None:
    maya = powered()
    maya.limit_torque(B, 0.125)
    settle(maya, B, 20_000.0)
    assert maya.position(B) == 20_000.0
    settle(maya, B, -1_000.0)
    assert maya.position(B) == pytest.approx(20_000.0, abs=1.5)


def test_a_motor_pulls_as_hard_as_its_torque_limit_allows() -> None:
    maya = powered()
    maya.limit_torque(B, 1.1)
    settle(maya, B, -490_000.0, 45_000.0)
    assert maya.record.peak_tension == pytest.approx(2.0, abs=0.01)
    assert maya.record.limited[B] > 0.5
    assert maya.record.stall_time == 0.0
    assert maya.torque(B) < -1.1


def test_a_motor_with_torque_to_spare_goes_as_if_unlimited() -> None:
    free, limited = powered(), powered()
    for axis in (B, C):
        limited.limit_torque(axis, 3.0)
    for maya in (free, limited):
        go(maya, C, -100_000.0)
        settle(maya, B, -100_000.0)
    assert free.true_joints() == limited.true_joints()
    assert limited.record.limited == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("of_boom", [0.0, 5_000.0])
@pytest.mark.parametrize("after", [0.0, 1e-9, 5e-7, 1e-6])
def test_lines_at_rest_near_their_torque_limit_are_few_events(after: float, of_boom: float) -> None:
    """The end of a motion may be evaluated a little late; the boom may still turn then."""
    maya = powered(truth=TrueConstants(lag=(0.02, 0.02, 0.02)))
    for axis in (B, C):
        maya.limit_torque(axis, 1.1)
    go(maya, A, of_boom, 1_000.0)
    end = go(maya, B, -430_000.0, 45_000.0) + 0.02
    run(maya, end + after)
    assert maya.position(B) == pytest.approx(-430_000.0, abs=1.0)
    assert len(run(maya, end + 0.2)) < 200


def test_more_torque_lets_a_motor_catch_up() -> None:
    maya = powered()
    maya.limit_torque(B, 0.05)
    settle(maya, B, -1_000.0)
    maya.limit_torque(B, 3.0)
    run(maya, maya.now + 0.1)
    assert maya.position(B) == -1_000.0
