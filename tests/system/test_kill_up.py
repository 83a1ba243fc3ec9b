"""SIGKILL of the real `maya up`: it restarts paused, reports the interrupted job, and moves nothing."""

from __future__ import annotations

import select
from pathlib import Path
from typing import Any

import pytest

from tests.campaign import Campaign
from tests.journals import looked_up
from tests.system.processes import Wire, running
from tests.system.robots import Running, up

pytestmark = pytest.mark.system

STEPS = 8
JOB = {"name": "jaws", "steps": [{"gripper": ("open", "close")[step % 2]} for step in range(STEPS)]}
"""Steps of half a second that need no homing."""


def outputs(wire: Wire) -> list[float]:
    """Return the gripper's output, and whether an axis moves."""
    return wire.numbers("@OUT[1],_BGA,_BGB,_BGC")


def choice_of(offer: dict[str, Any], name: str) -> dict[str, object]:
    """Return the arguments of a choice, for a machine without any part."""
    asked = next(choice for choice in offer["choices"] if choice["name"] == name)["needs_answer"]
    return {"choice": name, "holding": False} if asked else {"choice": name}


def require_offer(robot: Running, job: int) -> dict[str, Any] | None:
    """Compare what is offered with the steps that are known to be done; return it."""
    view = robot.ask("GET", "/v1/queue")[1]
    steps = robot.ask("GET", f"/v1/jobs/{job}")[1]["steps"]
    done = [step["state"] for step in steps].count("done")
    assert [step["state"] for step in steps[:done]] == ["done"] * done
    if done == STEPS and not view["recovery"]:
        return None
    assert (view["mode"], view["reason"], view["running"]) == ("paused", "restart", None)
    offer = view["recovery"]
    if offer is not None:
        assert offer["job"] == job
        assert offer["index"] in {0, done + 1}
    return offer


@pytest.mark.waits("about 10 s: three kills within 2.5 s each, and steps of 0.5 s of a twin at real speed")
def test_maya_up_killed_repeatedly_finishes_its_job(
    campaign: Campaign, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MAYA_STATE_DIR", str(tmp_path / "kept"))
    rng, kills = campaign.rng(), campaign.size(ci=3, long=40)
    with running("dmc serve --port 0 --seed 5") as twin:
        address = twin.until(":")
        with Wire(address) as wire:
            numbers: list[int] = []
            while kills >= 0:
                with up(f"--address {address}", cold=True) as robot:
                    if not numbers or not _carry_on(robot, wire, numbers[-1]):
                        numbers.append(robot.ask("POST", "/v1/jobs", JOB)[1]["id"])
                    if kills:
                        select.select([], [], [], rng.uniform(0.0, 2.5))
                        robot.process.kill()
                    else:
                        robot.until(lambda queue: not queue["counts"])
                        robot.end()
                kills -= 1
    states = looked_up(tmp_path / "kept" / "maya.db", "SELECT id, state FROM jobs ORDER BY id")
    assert states == [(number, "done") for number in numbers]
    steps = looked_up(tmp_path / "kept" / "maya.db", "SELECT count(*) FROM steps WHERE state = 'done'")
    assert steps == [(STEPS * len(numbers),)]


def _carry_on(robot: Running, wire: Wire, job: int) -> bool:
    """See that nothing moves, then let an interrupted job go on; return whether there was one."""
    before = outputs(wire)
    offer = require_offer(robot, job)
    status = robot.ask("GET", "/v1/status")[1]
    robot.ask("GET", f"/v1/events?since={status['last_event']}&wait=1.0")
    assert outputs(wire) == before
    assert before[1:] == [0.0, 0.0, 0.0]
    if offer is not None:
        assert robot.ask("POST", "/v1/queue/recovery", choice_of(offer, "resume"))[0] < 300
        return True
    unfinished = bool(robot.ask("GET", "/v1/queue")[1]["counts"])
    if unfinished:
        assert robot.ask("POST", "/v1/queue/resume")[0] < 300
    return unfinished
