"""A drawn machine, by the commands of its user: check, dry run, up, home, pick and place, calibrate."""

from __future__ import annotations

import json
from pathlib import Path
from random import Random
from typing import Any

import pytest

from maya_un.config import load
from maya_un.config.files import merged, parse
from maya_un.kinematics.mechanism import Mechanism
from maya_un.values import Joints
from tests.campaign import Campaign
from tests.machines import Machine, keys_of_machine
from tests.system.processes import done, running

pytestmark = pytest.mark.system

SPEED = 50
"""Factor of the twin's clock: a slow machine takes minutes for its homing. At 200, a busy computer reacts too late."""

CLEAR = 0.05
"""The places are clear of every limit by this [m]: the gripper also goes above them."""

TRIES = 40
"""Pairs of places that are tried in dry runs: the way between two of them may leave the workspace."""

POINTS, HIGHER = 16, 0.008
"""Measured points of a machine whose mast is so much higher than configured [m]."""


@pytest.fixture(autouse=True)
def own_places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("MAYA_RUNTIME_DIR", "MAYA_STATE_DIR", "XDG_CONFIG_HOME"):
        monkeypatch.setenv(name, str(tmp_path / name))


def answer(line: str) -> dict[str, Any]:
    """Run a command that must succeed, and return its answer."""
    code, said = done(f"{line} --json")
    assert code == 0, said
    return json.loads(said)


def drawn_machine(rng: Random, file: Path) -> Machine:
    """Draw a machine and its wiring, and write its configuration."""
    keys = keys_of_machine(rng)
    for name, letter in zip("abc", rng.sample("ABC", 3), strict=True):
        keys["axes"][name]["letter"] = letter
    keys["wiring"] = {"limit_active_level": rng.choice((-1, 1))}
    file.write_text(merged("", keys))
    return Machine.of(load(file))


def drawn_places(machine: Machine, rng: Random, count: int) -> list[Joints]:
    """Return places inside the workspace of a machine."""
    return [place for _ in range(count) if (place := machine.drawn_place(rng, CLEAR)) is not None]


def write_job(machine: Machine, rng: Random, file: Path) -> None:
    """Write a job that carries a part between two drawn places of one height, and passes its dry run."""
    mechanism = Mechanism.of(machine.config)
    said = ""
    for _ in range(TRIES):
        here, there = ([round(value, 3) for value in mechanism.fk(place)] for place in drawn_places(machine, rng, 2))
        steps = ["home", {"pick": "cube"}, {"place": [*there[:2], here[2]]}]
        file.write_text(json.dumps({"name": "carry", "parts": {"cube": here}, "steps": steps}))
        code, said = done(f"run {file} --dry-run")
        if code == 0:
            return
    raise AssertionError(f"no pair of places passes, the last one: {said}")


def write_points(machine: Machine, rng: Random, file: Path) -> None:
    """Write points measured on a machine whose mast is higher than configured."""
    height = machine.config.geometry.height + HIGHER
    real = Mechanism.of(parse({"geometry": {"height": height}}, machine.config))
    rows = [(*place, *real.fk(place)) for place in drawn_places(machine, rng, POINTS)]
    lines = [",".join(map(repr, row)) for row in rows]
    file.write_text("\n".join(["a_rad,b_m,c_m,x,y,z", *lines, ""]))


def use(machine: Machine, rng: Random, folder: Path, seed: int) -> None:
    """Fail unless the commands of a user do with a machine, configured by MAYA_CONFIG, what they should."""
    job, points, config = folder / "job.yaml", folder / "points.csv", folder / "robot.toml"
    answer(f"config check {config}")
    write_job(machine, rng, job)
    with running(f"up --speed {SPEED} --port 0 --journal memory --seed {seed} --table {job}") as up:
        up.until("Ctrl-C")  # it is ready
        answer("home")
        report = answer(f"run {job}")
        assert report["state"] == "done"
        assert report["parts"]["cube"]["error"] < 1e-3
    write_points(machine, rng, points)
    answer(f"calibrate {points} --apply")
    assert load(config).geometry.height == pytest.approx(machine.config.geometry.height + HIGHER, abs=1e-4)
    answer(f"config check {config}")


@pytest.mark.timeout(1200)
def test_a_drawn_machine_is_used_by_commands(
    tmp_path: Path, campaign: Campaign, monkeypatch: pytest.MonkeyPatch
) -> None:
    for case in range(campaign.size(ci=1, long=10)):
        rng = campaign.rng(case)
        folder = tmp_path / str(case)
        folder.mkdir()
        monkeypatch.setenv("MAYA_CONFIG", str(folder / "robot.toml"))
        use(drawn_machine(rng, folder / "robot.toml"), rng, folder, seed=case)
