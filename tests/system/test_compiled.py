"""The compiled package: it does the same as the plain one, to the bit, and passes the same tests.

Compiling takes minutes and a C compiler, so all this is for `./test --long`.
"""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from tests.campaign import Campaign
from tests.system.processes import CALM, done, running

pytestmark = [pytest.mark.long, pytest.mark.system]

ROOT = Path(__file__).parents[2]
SUITE = (
    "tests/contract", "tests/properties", "tests/unit/dmc41x3", "tests/unit/kinematics", "tests/unit/machine",
    "tests/unit/motion", "tests/unit/controller", "tests/unit/robot",
)  # fmt: skip
"""The tests of what is compiled, and of what is built on it."""

SHARDS = 4


def with_package(folder: Path) -> dict[str, str]:
    """Return an environment in which Python finds the package in `folder` first."""
    return os.environ | {"PYTHONPATH": os.pathsep.join((str(folder), str(ROOT)))}


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the unpacked compiled wheel."""
    made = tmp_path_factory.mktemp("compiled")
    build = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--wheel-dir", str(made), str(ROOT)]
    subprocess.run(build, check=True, env=os.environ | {"MAYA_COMPILE": "1"})
    (wheel,) = made.glob("*.whl")
    assert "none-any" not in wheel.name
    zipfile.ZipFile(wheel).extractall(made / "package")
    return made / "package"


def output(folder: Path, *arguments: str) -> str:
    """Return what Python prints with the package in `folder`."""
    done = subprocess.run(
        [sys.executable, *arguments], cwd=ROOT, env=with_package(folder), check=True, capture_output=True, text=True
    )
    return done.stdout


def test_the_doctor_names_it(compiled: Path) -> None:
    told = output(compiled, "-c", "from maya_un.http.doctor import host; print(next(host.software()).key)")
    assert told.strip() == "software_compiled"


@pytest.mark.parametrize("shard", range(SHARDS))
def test_random_jobs_are_the_same_on_the_wire(shard: int, compiled: Path, campaign: Campaign) -> None:
    jobs = campaign.size(ci=10, long=10_000 // SHARDS)
    task = ["-m", "tests.wire_of_jobs", f"{campaign.seed} {shard}", str(jobs)]
    plain = output(ROOT / "src", *task)
    assert len(set(plain.split())) > 0.9 * jobs
    assert output(compiled, *task) == plain


def test_a_robot_that_runs_carries_a_job_out(compiled: Path, tmp_path: Path) -> None:
    """Its workers get and return what the compiled modules compute."""
    job = tmp_path / "job.yaml"
    job.write_text("steps: [home, {pick: [0.5, 1.1, 0.4]}, {place: [1.1, 0.5, 0.4]}]")
    with running(f"up --port 0 --speed 200 {CALM}", with_package(compiled)) as up:
        up.until("http://")
        code, said = done(f"run {job}", env=with_package(compiled))
    assert code == 0, said


def test_it_passes_the_tests_of_its_parts(compiled: Path) -> None:
    tests = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *SUITE]
    environment = with_package(compiled)
    environment.pop("MAYA_TEST_LONG", None)
    subprocess.run(tests, cwd=ROOT, env=environment, check=True)
