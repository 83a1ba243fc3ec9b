"""Two hosts on one controller, each with its own runtime and state folder: one owns it, the other is refused.

The mechanics of the served twin say what happened.
"""

from __future__ import annotations

import json
import signal
from pathlib import Path

import pytest

from maya_un.assembly.controller import Twin
from maya_un.config import Config
from maya_un.errors import ControllerMoves, ControllerOwned, OwnershipLost
from tests.system.processes import Wire, done, running
from tests.system.test_watchdog import mark, served, wait_for

pytestmark = pytest.mark.system

GUARD_TIME = Config().safety.guard_time
BRAKING = 1.5
"""A stop takes less than this [s]."""
SAMPLES = 1024.0


def places(folder: Path) -> dict[str, str]:
    """Return the environment of a host of its own: nothing that another host writes is in its folders."""
    return {"MAYA_RUNTIME_DIR": str(folder / "run"), "MAYA_STATE_DIR": str(folder / "kept")}


def rests_within(wire: Wire, seconds: float) -> None:
    """Wait until the axes are at rest, by the controller's own clock."""
    latest = wire.time + seconds
    while any(wire.numbers("_BGS,_BGA,_BGB,_BGC")):
        assert wire.time < latest, "the axes still move"


def at_rest(twin: Twin) -> tuple[float, ...]:
    return tuple(twin.mechanics.true_joints())


@pytest.mark.waits("1 s until an owner that was killed counts as dead, by the clock of a twin at real speed")
def test_second_maya_up_is_refused_and_the_watchdog_of_the_first_works(tmp_path: Path) -> None:
    with served(seed=5) as (twin, address), Wire(address) as wire:
        mark(twin, wire)
        first, second = places(tmp_path / "one"), places(tmp_path / "two")
        with running(f"up --port 0 --skip-home --address {address}", first) as up:
            up.until("maya home")
            with running("jog r -500mm", first):
                wait_for(wire, "_BGS", 1.0)
                code, said = done(f"up --port 0 --address {address}", env=second)
                assert (code, str(ControllerOwned.code) in said) == (1, True), said
                assert f"process {up.number}" in said
                assert wire.numbers("_BGS") == [1.0]
                with running(f"up --port 0 --address {address}", second) as late:
                    up.send(signal.SIGKILL)
                    rests_within(wire, GUARD_TIME + BRAKING)
                    stands = at_rest(twin)
                    late.until("maya home")
                    assert at_rest(twin) == pytest.approx(stands, abs=2e-4)
        assert not twin.mechanics.record.drops


def test_a_second_host_cannot_move_the_gripper(tmp_path: Path) -> None:
    with served(seed=5) as (twin, address), Wire(address) as wire:
        mark(twin, wire)
        first, second = places(tmp_path / "one"), places(tmp_path / "two")
        with running(f"up --port 0 --skip-home --address {address}", first) as up:
            up.until("maya home")
            before = wire.numbers("_OP0"), twin.mechanics.record.gripper_closed
            job = tmp_path / "jaws.json"
            job.write_text(json.dumps({"steps": [{"gripper": "close"}, {"gripper": "open"}, {"gripper": "close"}]}))
            with running("jog r -500mm", first):
                wait_for(wire, "_BGS", 1.0)
                code, said = done(f"run {job} --address {address}", env=second)
                assert (code, str(ControllerOwned.code) in said) == (1, True), said
            assert (wire.numbers("_OP0"), twin.mechanics.record.gripper_closed) == before


@pytest.mark.waits("about 20 s of a motion of a twin at real speed, which several processes share")
def test_refused_maya_run_leaves_the_running_job_and_its_watchdog_alone(tmp_path: Path) -> None:
    with served(seed=5) as (twin, address), Wire(address) as wire:
        mark(twin, wire)
        first, second = places(tmp_path / "one"), places(tmp_path / "two")
        job = tmp_path / "way.json"
        job.write_text(json.dumps({"steps": [{"move": {"a": 1.0, "b": 1.3, "c": 1.5}}]}))
        with running(f"up --port 0 --skip-home --address {address}", first) as up:
            up.until("maya home")
            before = wire.say("LV")
            with running(f"run {job}", first) as run:
                wait_for(wire, "_BGS", 1.0)
                code, said = done(f"run {job} --address {address} --skip-home", env=second)
                assert (code, str(ControllerOwned.code) in said) == (1, True), said
                assert wire.numbers("_XQ7")[0] >= 0.0
                code, said = run.end()
                assert code == 0, said
            assert names(wire.say("LV")) >= names(before)


@pytest.mark.parametrize("tool", ["conform {address}", "download {address} {file}", "replay {log} {address}"])
def test_writing_tool_is_refused_next_to_a_living_owner(tool: str, tmp_path: Path) -> None:
    file, log = tmp_path / "x.dmc", tmp_path / "x.log"
    file.write_text("#X\nEN\n")
    log.write_text(json.dumps({"format": "maya-dmc-capture", "version": 1, "controller": "sim"}) + "\n")
    with served(seed=5) as (_, address), Wire(address) as wire, running(f"up --port 0 --address {address}") as up:
        up.until("maya home")
        before = written(wire)
        code, said = done(f"dmc {tool.format(address=address, file=file, log=log)}")
        assert (code, str(ControllerOwned.code) in said) == (1, True), said
        assert written(wire) == before


@pytest.mark.parametrize(
    "tool", ["dmc watch {address} _TPA --for 0.5", "dmc upload {address}", "doctor --address {address}"]
)
def test_reading_tool_is_never_refused_and_writes_nothing(tool: str, tmp_path: Path) -> None:
    with served(seed=5) as (_, address), Wire(address) as wire, running(f"up --port 0 --address {address}") as up:
        up.until("maya home")
        before = written(wire)
        code, said = done(tool.format(address=address), env=places(tmp_path / "two"))
        assert str(ControllerOwned.code) not in said
        assert code == 0 or tool.startswith("doctor"), said
        assert f"process {up.number}" in said or not tool.startswith("doctor")
        assert written(wire) == before


@pytest.mark.waits("about 20 s of motion of a twin at real speed, which several processes share")
def test_a_person_takes_the_controller_over_and_back(tmp_path: Path) -> None:
    with served(seed=5) as (twin, address), Wire(address) as wire:
        mark(twin, wire)
        first, second = places(tmp_path / "one"), places(tmp_path / "two")
        with running(f"up --port 0 --skip-home --address {address}", first) as one:
            one.until("maya home")
            with running("jog r -300mm", first) as jog:
                wait_for(wire, "_BGS", 1.0)
                code, said = done(f"up --port 0 --address {address} --take-over", env=second)
                assert (code, str(ControllerMoves.code) in said) == (1, True), said
                assert jog.end()[0] == 0
            with running(f"up --port 0 --skip-home --address {address} --take-over", second) as two:
                two.until("maya home")
                assert wire.numbers("mayapid") == [float(two.number)]
                refused_with(first, OwnershipLost.code)
                faults = done("logs --kind fault", env=first)[1]
                assert f"(process {one.number})" not in faults, faults
                code, said = done("recover", env=first)
                assert (code, str(ControllerOwned.code) in said) == (1, True), said
                assert done("jog r 0.05", env=first)[0] == 1
                assert done("jog r 0.05", env=second)[0] == 0
                code, said = done("recover --take-over", env=first)
                assert code == 0, said
                assert wire.numbers("mayapid") == [float(one.number)]
                refused_with(second, OwnershipLost.code)
                two.send(signal.SIGTERM)
                assert two.end()[0] == 0
            assert wire.numbers("_XQ7")[0] >= 0.0
            code, said = done("jog r 0.05", env=first)
            assert code == 0, said


def refused_with(host: dict[str, str], code: int) -> None:
    """Wait until the status of a host names a fault."""
    said = ""
    for _ in range(100):
        said = done("status --json", env=host)[1]
        if json.loads(said)["state"]["fault"] is not None and json.loads(said)["state"]["fault"]["code"] == code:
            return
    raise AssertionError(said)


def written(wire: Wire) -> list[bytes]:
    """Return what a client could have written: the names of the variables, the program, registers, outputs."""
    asked = ("UL", "MG _SPA,_ERA,_OEB,_CN0,_LDA,_TLA", "MG _OP0,_MOA,_MOB,_MOC", "MG _ZAA,_ZAB")
    return [b" ".join(sorted(names(wire.say("LV")))), *(wire.say(question) for question in asked)]


def names(listing: bytes) -> set[bytes]:
    return {line.split(b"=")[0].strip() for line in listing.splitlines() if b"=" in line}
