"""Commissioning on twins: mistakes in the wiring are named in time; an interrupted one is safe and continues."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from itertools import count, product
from pathlib import Path

import pytest

from dmc41x3.driver import Driver
from dmc41x3.loops import run_virtual
from dmc41x3.twin.timeline import TimelinePiece
from dmc41x3.wire.transport import Transport
from maya_un import errors
from maya_un.assembly.controller import machine_of
from maya_un.assembly.stack import stack
from maya_un.commission.guarded import HELD
from maya_un.commission.progress import report
from maya_un.commission.questions import ALREADY, QUIT, Question
from maya_un.commission.steps import STEPS, STROKE_DIFFERS
from maya_un.config import Config, load
from maya_un.controller.controller import GalilController
from maya_un.errors import LinkLost, LinkTimeout, MachineError, NotConnected
from maya_un.machine.truth import TrueConstants
from maya_un.machine.wiring_faults import KINDS, WiringFault
from maya_un.process.spec.job import load_job
from maya_un.process.spec.tasks import starting_parts
from maya_un.testing import faults
from tests.campaign import Campaign
from tests.commissioning import Bench, bench, faulty
from tests.conventions.source import ROOT
from tests.system.test_homing import with_switches
from tests.virtual_time import elapse

pytestmark = pytest.mark.system

MACHINES = ROOT / "examples" / "machines"

NAMES: dict[str, type[MachineError]] = {
    "encoder_reversed": errors.EncoderReversed,
    "motor_reversed": errors.MotorReversed,
    "both_reversed": errors.AxisBackwards,
    "encoder_dead": errors.EncoderDead,
    "encoder_factor": errors.EncoderScaleWrong,
    "encoders_exchanged": errors.EncodersExchanged,
    "motors_exchanged": errors.MotorsExchanged,
    "axes_exchanged": errors.AxesExchanged,
    "amplifier_off": errors.AmplifierNotEnabled,
    "brake_closed": errors.BrakeClosed,
    "torque_low": errors.TorqueTooLow,
    "switch_levels": errors.SwitchLevelsInverted,
    "switch_inverted": errors.SwitchInverted,
    "switch_open": errors.SwitchNotConnected,
    "switches_exchanged": errors.SwitchesExchanged,
    "gripper_output": errors.GripperAtOtherOutput,
    "gripper_dead": errors.GripperSilent,
    "gripper_inverted": errors.GripperInverted,
    "stop_open": errors.StopNotConnected,
    "stop_inverted": errors.StopInverted,
}
"""The name of every kind of mistake."""

READ_AT_REST = {errors.SwitchNotConnected, errors.SwitchInverted}
"""Mistakes that look the same while the axis stands at the switch."""

CORRECTED = {"axes_exchanged", "switch_levels", "gripper_output", "gripper_inverted"}
"""Mistakes that a change of the configuration removes."""


def test_every_kind_of_mistake_has_a_name() -> None:
    assert NAMES.keys() == KINDS.keys()


def found_as(fault: WiringFault) -> tuple[str, str]:
    """Return the step that finds a mistake, and a word of its sentence: the part.

    Too little torque may be enough for the first short move; then the step of the travel finds it.
    """
    name = fault.part.split()[0] if fault.part else ""
    match fault.kind.split("_")[0]:
        case "stop" | "gripper" as step:
            return step, ""
        case "switch" | "switches" | "axes":
            return "limits", name
        case _:
            return f"direction.{name}", name


def named(kind: str, seed: int, config: Config) -> None:
    """Fail unless a mistake, and no other, is named at its part before anything moves more than announced."""

    async def commissioned() -> tuple[WiringFault, Bench]:
        fault = faulty(config, seed, kind)
        on = bench(config, fault.truth, seed=seed)
        await on.run(home=False)
        await on.twin.controller.close()
        return fault, on

    fault, on = run_virtual(commissioned())
    step, part = found_as(fault)
    name = NAMES[kind]
    if name in READ_AT_REST and on.person.answers.get(f"limits.{fault.part.replace(' ', '.')}.press") == ALREADY:
        name = errors.PressedSwitchInactive
    at = step.replace("direction", "travel") if kind == "torque_low" and step not in on.codes else step
    assert on.codes.get(at) == [name.code], (fault.kind, fault.part, on.codes)
    assert set().union(*on.codes.values()) == {name.code}
    assert f" {part}" in on.progress.results[at].errors[0][1]
    assert on.person.excesses == []
    assert not any(on.motors_on)


@pytest.mark.parametrize("kind", KINDS)
def test_a_mistake_in_the_wiring_is_named_before_anything_moves_further_than_announced(
    kind: str, campaign: Campaign
) -> None:
    for case in range(campaign.size(ci=1, long=20)):
        named(kind, campaign.rng(case).randrange(1000), Config())


@pytest.mark.parametrize(
    ("part", "advice"),
    [
        ("a", "If they are as intended, scale.pulses_per_degree must be about {scale} counts/°."),
        (
            "c",
            "If they are as intended, scale.pulses_per_metre (it holds for lines b and c, so both need the same"
            " resolution) must be about {scale} counts/m.",
        ),
    ],
)
def test_wrong_scale_is_reported_with_the_key_to_change(part: str, advice: str) -> None:
    def faults() -> Iterator[tuple[int, WiringFault]]:
        return ((seed, faulty(Config(), seed, "encoder_factor")) for seed in count())

    async def commissioned() -> Bench:
        seed, fault = next((seed, fault) for seed, fault in faults() if fault.part.split()[0] == part)
        on = bench(Config(), fault.truth, seed=seed)
        await on.run(home=False)
        await on.twin.controller.close()
        return on

    ((_, sentence),) = run_virtual(commissioned()).progress.results[f"direction.{part}"].errors
    before, about, after = advice.partition("{scale}")
    assert about
    assert f"Check resolution and gear of axis {part}. {before}" in sentence
    assert sentence.endswith(after)


def test_mistakes_of_other_machines_are_named(campaign: Campaign) -> None:
    kinds = ("encoder_reversed", "motor_reversed", "encoder_dead", "switch_open")
    for name, kind in campaign.some(list(product(("table-top", "hall", "rewired"), kinds)), ci=4):
        named(kind, 100 + kinds.index(kind), load(MACHINES / f"{name}.toml"))


async def pick_works(config: Config, truth: TrueConstants, seed: int, job: Path) -> None:
    """Fail unless `maya up` with a configuration homes the machine and carries the part of a job."""
    task = load_job(job)
    parts = starting_parts(task, config.cell.grasp_height)
    async with stack(config, truth=truth, seed=seed, parts=parts, live=False) as maya:
        report = await maya.service.wait((await maya.service.submit(task)).id)
        assert report.state == "done", report.message
        assert maya.twin is not None
        record = maya.twin.mechanics.record
        assert not record.drops
        assert record.stall_time == 0.0
        assert all(record.parts[name] != place for name, place in parts.items())


def complete(config: Config, truth: TrueConstants, seed: int, job: Path) -> Bench:
    """Commission a machine whole, and fail unless the resulting configuration works."""

    async def commissioned() -> Bench:
        on = bench(config, truth, seed=seed)
        assert await on.run(), (on.codes, on.progress.results)
        result = on.procedure().config
        await on.twin.controller.close()
        await pick_works(result, truth, seed, job)
        return on

    on = run_virtual(commissioned())
    assert on.person.excesses == []
    return on


JOB = ROOT / "examples" / "01_pick_and_place.yaml"


def test_a_machine_without_mistakes_passes_whole_and_works(campaign: Campaign) -> None:
    for name in campaign.some(["", "table-top", "hall", "rewired"], ci=1):
        config = load(MACHINES / f"{name}.toml") if name else Config()
        job = MACHINES / f"{name}.yaml"
        on = complete(config, machine_of(config), 3, job if job.exists() else JOB)
        assert on.codes == {}
        assert on.progress.changes == {}
        readings = on.progress.results["home"].readings
        for line in "bc":
            assert float(readings[f"long end of {line}"].removesuffix(" mm")) == pytest.approx(
                config.axes["abc".index(line)].maximum * 1e3, abs=STROKE_DIFFERS * 1e3
            )


@pytest.mark.parametrize("fitted", [("none", "none", "none"), ("maximum", "minimum", "minimum")])
def test_a_machine_with_fewer_switches_passes_whole(fitted: tuple[str, str, str]) -> None:
    config = with_switches(Config(), *fitted)

    async def commissioned() -> Bench:
        on = bench(config, machine_of(config), seed=3)
        assert await on.run(), (on.codes, on.progress.results)
        return on

    on = run_virtual(commissioned())
    assert on.codes == {}
    assert on.person.excesses == []


def test_a_machine_whose_datum_a_person_gives_is_not_called_homed() -> None:
    config = with_switches(Config(), "none", "both", "both")

    async def commissioned() -> tuple[Bench, list[str]]:
        said: list[str] = []
        on = bench(config, machine_of(config), seed=3)
        on.person.on_ask = lambda question: said.append(question.text)
        assert await on.run(), (on.codes, on.progress.results)
        await on.twin.controller.close()
        return on, said

    on, said = run_virtual(commissioned())
    titles = {step.key: step.title for step in STEPS}
    rows = report(on.progress, titles, (), "en").splitlines()
    assert "| First homing | skipped: a person gives the datum |  |" in rows
    assert "not homed yet" in said[-1]
    assert "`maya datum`" in said[-1]
    assert not any("is homed and can work" in text for text in said)


def test_a_corrected_configuration_works(campaign: Campaign) -> None:
    for kind in campaign.some(sorted(CORRECTED), ci=1):
        fault = faulty(Config(), 1, kind)
        on = complete(Config(), fault.truth, 1, JOB)
        assert on.codes[found_as(fault)[0]] == [NAMES[kind].code]


def test_several_mistakes_at_once_are_corrected() -> None:
    config = load(MACHINES / "rewired.toml")
    on = complete(Config(), machine_of(config), 4, JOB)
    assert on.procedure().config == config


READY = [
    "connection.ready",
    "stop.ready",
    "limits.ready",
    "gripper.ready",
    *(f"{step}.{axis}.ready" for step in ("direction", "travel") for axis in "abc"),
    "home.ready",
]
CLOSE = 210
"""The seed of a machine whose boom stands 0.2° from its limit switch."""

MOVES = [key for key in READY if key.startswith(("direction", "travel", "home"))]
GUARDED = 3.0
"""Time within which the guard in the controller has stopped the axes after a loss of the link [s]."""

MOMENTS = (0.05, 0.5)
"""Times after the announcement at which the interruption comes [s]."""


def after(on: Bench, key: str, seconds: float, act: object) -> None:
    """Call `act` some time after a step was announced, once."""
    done: list[str] = []

    def look(question: Question) -> None:
        if question.key == key and not done:
            done.append(key)
            assert callable(act)
            asyncio.get_running_loop().call_later(seconds, act)

    on.person.on_ask = look


async def interrupted(key: str, moment: float) -> None:
    """Fail unless Ctrl-C at a moment of a step stops the motors, and a later call continues."""
    on = bench(Config(), seed=3)
    task = asyncio.ensure_future(on.run(home=key == "home.ready"))
    after(on, key, moment, task.cancel)
    try:
        await task
        assert key not in MOVES  # a step without motion may be over already
    except asyncio.CancelledError:
        assert await on.still()
        if key != "home.ready":  # after a homing has begun, motors hold, as after `maya stop`
            assert not any(on.motors_on)
        done = [one for one, result in on.progress.results.items() if result.state.done and one != "stop"]
        on.person.on_ask = lambda _question: None
        on.person.asked.clear()
        assert await on.run(home=key == "home.ready"), on.codes
        assert "stop.press" in on.person.asked  # the emergency stop is tested at every call
        assert not [one for one in on.person.asked if any(one.startswith(f"{step}.") for step in done)]
    assert on.person.excesses == []
    await on.twin.controller.close()


@pytest.mark.timeout(1200)
def test_ctrl_c_stops_the_motors_and_a_later_call_continues(campaign: Campaign) -> None:
    for key, moment in campaign.some(list(product(READY, MOMENTS)), ci=2):
        run_virtual(interrupted(key, moment))


async def lost(key: str) -> None:
    """Fail unless a lost link in a step stops the axes, and a later call continues."""
    on = bench(Config(), seed=3)
    virtual = on.twin.controller
    after(on, key, 0.4, lambda: virtual.faults.inject("cut", {}))
    with pytest.raises((LinkLost, LinkTimeout, NotConnected)):
        await on.run(home=key == "home.ready")
    await elapse(GUARDED)
    assert await on.still()
    on.person.on_ask = lambda _question: None
    assert await on.run(home=key == "home.ready"), on.codes
    assert on.person.excesses == []
    await virtual.close()


@pytest.mark.timeout(1200)
def test_a_lost_link_stops_the_axes_and_a_later_call_continues(campaign: Campaign) -> None:
    for key in campaign.some(MOVES, ci=1):
        run_virtual(lost(key))


def test_next_program_takes_the_boom_s_torque_limit_of_before_a_commissioning_that_lost_its_link() -> None:
    async def lost() -> None:
        on = bench(Config(), seed=3)
        other = await Driver.open(on.twin.controller.loopback(), timeout=1.0)
        before = await other.value("_TLA")
        on.person.on_ask = lambda question: on.twin.controller.cut() if question.key == "direction.a.seen" else None
        with pytest.raises(MachineError):
            await on.run(home=False)
        await elapse(5.0)

        async def dial() -> Transport:
            return on.twin.controller.loopback()

        other = await Driver.open(on.twin.controller.loopback(), timeout=1.0)
        assert await other.value("_TLA") < 0.5 * before
        controller = GalilController(dial, "twin", Config())
        await controller.open()
        assert await other.value("_TLA") == pytest.approx(before, abs=1e-3)
        await controller.close()
        await other.close()
        await on.twin.controller.close()

    run_virtual(lost())


def test_an_axis_that_something_stops_on_the_way_back_is_named() -> None:
    async def stopped() -> Bench:
        on = bench(Config(), seed=3)
        other = await Driver.open(on.twin.controller.loopback(), timeout=1.0)
        ending: list[asyncio.Task[str]] = []
        after(on, "direction.a.length", 1.5 * HELD, lambda: ending.append(asyncio.create_task(other.send("STA"))))
        await on.run(home=False)
        await ending[0]
        await other.close()
        await on.twin.controller.close()
        return on

    on = run_virtual(stopped())
    assert on.codes["direction.a"] == [errors.MotionNotCompleted.code]
    assert on.person.excesses == []


def test_an_axis_that_runs_away_at_rest_is_named() -> None:
    """The encoder is reversed, and somebody touches the axis as soon as its motor is on."""

    async def unstable() -> Bench:
        fault = faulty(Config(), 3, "encoder_reversed")
        on = bench(Config(), fault.truth, seed=3)
        axis = "abc".index(fault.part)

        def touch() -> None:
            body = on.twin.mechanics
            body.timelines[axis].plan(body.now, (TimelinePiece(body.now, body.position(axis) + 20.0, 0.0, 0.0),))

        after(on, f"direction.{fault.part}.ready", HELD / 2.0, touch)
        await on.run(home=False)
        await on.twin.controller.close()
        return on

    on = run_virtual(unstable())
    assert errors.AxisUnstable.code in set().union(*on.codes.values()), on.codes
    assert on.person.excesses == []


def test_an_axis_close_to_a_switch_is_tested_in_the_other_direction() -> None:
    async def close() -> Bench:
        on = bench(Config(), seed=CLOSE)
        await on.run(home=False)
        await on.twin.controller.close()
        return on

    on = run_virtual(close())
    assert "direction.a.other.seen" in on.person.asked
    assert on.codes == {}
    assert on.person.excesses == []


def test_quit_keeps_the_results() -> None:
    async def quits() -> None:
        on = bench(Config(), seed=3)
        on.person.on_ask = lambda question: QUIT if question.key == "gripper.ready" else None
        assert not await on.run()
        assert [key for key, one in on.progress.results.items() if one.state.done] == ["connection", "stop", "limits"]
        await on.twin.controller.close()

    run_virtual(quits())


def test_an_owned_controller_is_refused() -> None:
    async def twice() -> None:
        on = bench(Config(), seed=3)
        other = Bench(on.twin, on.config, on.progress, on.person)
        procedure = on.procedure()
        await procedure.machine()
        with pytest.raises(errors.ControllerOwned):
            await other.procedure().machine()
        await procedure.disconnect()
        await on.twin.controller.close()

    run_virtual(twice())


def test_latency_changes_no_judgement() -> None:
    async def late() -> Bench:
        on = bench(Config(), seed=3)
        with faults.latency(on.twin.controller, 0.02, jitter=0.02):
            await on.run(home=False)
        await on.twin.controller.close()
        return on

    on = run_virtual(late())
    assert on.codes == {}
    assert on.person.excesses == []
