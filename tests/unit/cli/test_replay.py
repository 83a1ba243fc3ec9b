"""`maya replay`: a recording of a twin is the same again, and what was falsified is found and named."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pytest

from dmc41x3.loops import run_virtual
from dmc41x3.wire.transcript import WirePiece
from maya_un.cli.main import main
from maya_un.cli.recordings.replay import OF_A_LATER_TWIN, OF_A_MACHINE, OF_A_TWIN, ReplayOptions, tolerated
from maya_un.config import RecorderConfig
from maya_un.errors import LimitReached
from maya_un.machine.truth import TrueConstants
from maya_un.recorder import mcap_file
from maya_un.recorder.recording import Recording, RecordingOrigin
from maya_un.testing import faults
from maya_un.values import Joints
from tests.recorded import recorded
from tests.unit.recorder.recordings import RECORDING
from tests.virtual_time import elapse

WAY = (Joints(0.35, 1.48, 1.34), Joints(0.35, 1.52, 1.28))


async def _job(settings: RecorderConfig | None = None, rest: float = 1.0, *, known: bool = True) -> Recording:
    """Return the recording of two moves with the gripper closed between."""
    async with recorded(settings=settings, known=known) as robot:
        await elapse(rest)
        await robot.controller.move(WAY[0])
        await robot.controller.gripper(open_=False)
        await robot.controller.move(WAY[1])
        await elapse(1.0)
        return robot.recorder.taken("asked")


@pytest.fixture(scope="module")
def job() -> Recording:
    """The recording of a twin from its power-up."""
    return run_virtual(_job())


@pytest.fixture
def replayed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Callable[[Recording], tuple[int, dict[str, Any]]]:
    """Say a recording again; return exit code and report."""

    def replay(recording: Recording) -> tuple[int, dict[str, Any]]:
        path = tmp_path / "one.mcap"
        with path.open("wb") as file:
            mcap_file.write(recording, file)
        code = main(["replay", str(path), "--json"])
        return code, json.loads(capsys.readouterr().out)

    return replay


Replayed = Callable[[Recording], tuple[int, dict[str, Any]]]


def test_a_job_on_the_twin_is_the_same_again(job: Recording, replayed: Replayed) -> None:
    code, told = replayed(job)
    assert (code, told["differences"], told["same"]) == (0, [], True)
    assert told["compared"] == told["commands"] > 300
    assert len(told["motions"]) == 2
    assert all(motion["recorded"] == motion["replayed"] > 1.0 for motion in told["motions"])
    last = job.states[-1].counts
    assert [end["replayed"] for end in told["ends"]] == list(last)
    assert told["not_compared"] == [
        "Not compared: jobs, steps and the queue, because the controller does not know them."
    ]


def test_recording_without_its_start_begins_at_the_first_rest(replayed: Replayed) -> None:
    job = run_virtual(_job(RecorderConfig(seconds=20.0), rest=40.0))
    assert not job.header.complete
    code, told = replayed(job)
    assert (code, told["differences"]) == (0, [])
    assert told["begin"] >= job.header.whole
    assert told["compared"] > 300
    assert [end["replayed"] for end in told["ends"]] == list(job.states[-1].counts)


def test_a_machine_is_compared_with_the_twin_that_its_configuration_describes(replayed: Replayed) -> None:
    job = run_virtual(_job(RecorderConfig(seconds=20.0), rest=40.0, known=False))
    code, told = replayed(job)
    assert (code, told["differences"]) == (0, [])
    assert told["tolerances"] == {"counts": 50.0, "seconds": 0.1}
    assert any("friction, lag and stiffness" in words for words in told["not_compared"])


def test_a_machine_recorded_from_the_first_command_on_is_compared_too(replayed: Replayed) -> None:
    job = run_virtual(_job(known=False))
    assert job.header.complete
    code, told = replayed(job)
    assert told["compared"] > 300
    assert all(one["what"] != "data record" for one in told["differences"])
    assert code == 0


def _count_sent(job: Recording, text: bytes) -> int:
    return next(place for place, piece in enumerate(job.wire) if piece.side == "client" and text in piece.data)


def test_a_falsified_answer_is_found_and_named(job: Recording, replayed: Replayed) -> None:
    asked = _count_sent(job, b"_ERA,")
    place = next(n for n in range(asked, len(job.wire)) if b" 742.0000 " in job.wire[n].data)
    piece = job.wire[place]
    false = piece._replace(data=piece.data.replace(b" 742.0000 ", b" 743.0000 ", 1))
    code, told = replayed(replace(job, wire=(*job.wire[:place], false, *job.wire[place + 1 :])))
    (found,) = told["differences"]
    assert code == 1
    assert "_ERA" in found["what"]
    before, _, now = found["how"].partition(" became ")
    assert (" 743.0000 " in before, now) == (True, before.replace("743.0000", "742.0000"))
    assert found["time"] == job.wire[asked].time


def test_a_falsified_position_is_found_and_named(job: Recording, replayed: Replayed) -> None:
    last = max(n for n, piece in enumerate(job.wire) if piece.data == b"QR\r")
    place = next(n for n in range(last, len(job.wire)) if job.wire[n].side == "controller")
    data = bytearray(job.wire[place].data)
    data[82 + 36 + 8 + 2] ^= 0x01  # axis B, 65 536 counts
    false = job.wire[place]._replace(data=bytes(data))
    code, told = replayed(replace(job, wire=(*job.wire[:place], false, *job.wire[place + 1 :])))
    assert code == 1
    found = {one["what"]: one for one in told["differences"]}
    assert set(found) == {"data record", "end of axis B"}
    assert found["data record"]["times"] == 1
    assert "B position" in found["data record"]["how"]


def test_a_command_that_is_missing_is_found_and_named(job: Recording, replayed: Replayed) -> None:
    place = _count_sent(job, b"BGS\r")
    code, told = replayed(replace(job, wire=(*job.wire[:place], *job.wire[place + 1 :])))
    assert code == 1
    what = [one["what"] for one in told["differences"]]
    assert "bytes of the controller" in what
    assert "motion" in what or any(one.startswith("end of axis") for one in what)
    first = min(told["differences"], key=lambda one: one["time"])
    assert first["time"] == pytest.approx(job.wire[place].time, abs=0.1)


def test_a_command_that_the_controller_never_got_is_found_and_named(job: Recording, replayed: Replayed) -> None:
    """The answer of a command is missing, and whatever comes next answers the ones behind it."""
    place = _count_sent(job, b"OB 1,")
    answer = next(n for n in range(place, len(job.wire)) if job.wire[n].side == "controller")
    data = job.wire[answer].data
    assert data.startswith(b":")
    false = job.wire[answer]._replace(data=data[1:])
    wire = [*job.wire[:answer], *([false] if data[1:] else []), *job.wire[answer + 1 :]]
    code, told = replayed(replace(job, wire=tuple(wire)))
    assert code == 1
    assert min(one["time"] for one in told["differences"]) >= job.wire[place].time


def test_another_machine_is_found_and_named(job: Recording, replayed: Replayed) -> None:
    source = job.header.origin.twin
    assert source is not None
    switches = [list(pair) for pair in TrueConstants().switches]
    switches[1][1] = 1.51  # line b meets its long end on its way
    other = replace(source, truth=asdict(TrueConstants()) | {"switches": switches})
    header = replace(job.header, origin=replace(job.header.origin, twin=other))
    code, told = replayed(replace(job, header=header))
    assert code == 1
    found = [(one["what"], one["how"]) for one in told["differences"]]
    assert ("met the forward limit of B", "it happens in the replay only") in found
    assert any(what == "end of axis B" for what, _ in found)
    assert any(what == "motion" for what, _ in found)


def test_another_scale_of_a_machine_is_found_and_named(replayed: Replayed) -> None:
    """The configuration of the recording has 2 % fewer counts to the metre: a line meets its switch on its way."""
    job = run_virtual(_job(RecorderConfig(seconds=20.0), rest=40.0, known=False))
    config = json.loads(json.dumps(job.header.origin.config))
    config["axes"]["b"]["maximum"], config["axes"]["c"]["minimum"] = 1.51, 0.8
    header = replace(job.header, origin=RecordingOrigin(config, "10.0.0.5:23"))
    code, told = replayed(replace(job, header=header))
    assert code == 1
    assert any(one["what"] == "met the forward limit of B" for one in told["differences"])


async def _switch_sticks() -> Recording:
    async with recorded() as robot:
        moving = asyncio.get_running_loop().create_task(robot.controller.move(WAY[0]))
        await elapse(1.5)
        with faults.stuck_limit(robot.virtual, "B", "reverse"), pytest.raises(LimitReached):
            await moving
        await elapse(1.0)
        return robot.recorder.taken("limit")


def test_external_faults_are_told_from_effects_of_commands(replayed: Replayed) -> None:
    code, told = replayed(run_virtual(_switch_sticks()))
    assert code == 1
    found = {one["what"]: one["how"] for one in told["differences"]}
    assert found["met the reverse limit of B"] == "it does not happen in the replay"
    assert found["message MAYA limit"] == "it does not happen in the replay"
    assert "B switches" in found["data record"]


def test_people_get_a_table_and_the_ends(job: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, picture = tmp_path / "one.mcap", tmp_path / "both.svg"
    place = _count_sent(job, b"BGS\r")
    with path.open("wb") as file:
        mcap_file.write(replace(job, wire=(*job.wire[:place], *job.wire[place + 1 :])), file)
    assert main(["replay", str(path), "--plot", str(picture)]) == 1
    said = capsys.readouterr().out
    assert said.splitlines()[0].split()[:2] == ["time", "[s]"]
    assert "answers nothing" in said
    assert f"Picture: {picture}" in said
    assert "recorded" in picture.read_text(encoding="utf-8")


def test_a_tolerance_can_be_named(job: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "one.mcap"
    with path.open("wb") as file:
        mcap_file.write(job, file)
    assert main(["replay", str(path), "--counts", "7", "--seconds", "0.5", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["tolerances"] == {"counts": 7.0, "seconds": 0.5}
    assert main(["replay", str(path), "--counts", "-1"]) == 2
    assert "--counts = -1.0 is not valid" in capsys.readouterr().err


def test_faster_clock_gives_lower_accuracy() -> None:
    header = RECORDING.header
    assert tolerated(RECORDING, ReplayOptions()) == OF_A_TWIN
    later = replace(RECORDING, header=replace(header, complete=False))
    assert tolerated(later, ReplayOptions()) == OF_A_LATER_TWIN
    fast = replace(RECORDING, header=replace(header, origin=replace(header.origin, speed=50.0)))
    assert tolerated(fast, ReplayOptions()) == pytest.approx((100.0, 1.0))
    machine = replace(RECORDING, header=replace(header, origin=replace(header.origin, twin=None)))
    assert tolerated(machine, ReplayOptions()) == OF_A_MACHINE


def test_without_a_rest_there_is_no_start(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "one.mcap"
    header = replace(RECORDING.header, complete=False)
    with path.open("wb") as file:
        mcap_file.write(replace(RECORDING, header=header, wire=(WirePiece(91.0, 1, "client", b"TP\r"),)), file)
    assert main(["replay", str(path)]) == 2
    assert "no instant at which the axes were at rest" in capsys.readouterr().err
