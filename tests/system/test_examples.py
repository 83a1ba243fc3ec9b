"""The examples, as they stand in the repository, on the twin in virtual time."""

from __future__ import annotations

import asyncio
import runpy
import sys
from math import dist
from pathlib import Path

import pytest

from maya_un.assembly.stack import stack
from maya_un.cli.progress import Display
from maya_un.cli.questions import answer_questions
from maya_un.config import Config, load
from maya_un.process.spec.job import load_job
from maya_un.process.spec.tasks import starting_parts
from maya_un.values import Point

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
TWO_COUNTS = 2e-4
"""Two counts of the boom, far out [m]."""

JOBS = sorted(EXAMPLES.glob("*.yaml"))
MACHINES = sorted((EXAMPLES / "machines").glob("*.toml"))


def job_for(machine: Path) -> Path:
    """Return the job of a machine: the one of its name, else the first example."""
    own = machine.with_suffix(".yaml")
    return own if own.exists() else JOBS[0]


CASES = {path.stem: (path, None) for path in JOBS} | {path.stem: (job_for(path), path) for path in MACHINES}


@pytest.mark.system
@pytest.mark.parametrize("name", CASES)
async def test_job_leaves_its_parts_at_the_targets(name: str) -> None:
    path, machine = CASES[name]
    job, config = load_job(path), Config() if machine is None else load(machine)
    parts = starting_parts(job, config.cell.grasp_height)
    async with stack(config, parts=parts, live=False) as maya:
        assert maya.twin is not None
        number = (await maya.service.submit(job)).id
        answers = asyncio.create_task(answer_questions(maya, number, Display(), "en", dry=True))
        report = await maya.service.wait(number)
        answers.cancel()
        await asyncio.wait({answers})
        assert report.state == "done", report.message
        assert report.parts.keys() == parts.keys()
        for part, commanded in report.parts.items():
            assert commanded is not None
            assert commanded != parts[part]
            assert dist(maya.twin.mechanics.parts[part], commanded) < TWO_COUNTS
        assert report.predicted == pytest.approx(sum(step.duration or 0.0 for step in report.steps[1:]), rel=1e-3)
        record = maya.twin.mechanics.record
        assert not record.drops
        assert record.stall_time == 0.0


@pytest.mark.system
async def test_the_job_of_the_how_to_page_is_done_each_time_it_is_run(tmp_path: Path) -> None:
    page = EXAMPLES.parent / "docs" / "how-to" / "run-a-job.md"
    path = tmp_path / "job.yaml"
    path.write_text(page.read_text(encoding="utf-8").partition("```yaml\n")[2].partition("```")[0], encoding="utf-8")
    job, config = load_job(path), Config()
    async with stack(config, live=False) as maya:
        for _ in range(2):
            report = await maya.service.wait((await maya.service.submit(job)).id)
            assert report.state == "done", report.message


@pytest.mark.system
def test_the_python_example_ends_with_the_cube_on_the_tray(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = EXAMPLES / "03_python_api.py"
    monkeypatch.setattr(sys, "argv", [str(path)])
    space = runpy.run_path(str(path), run_name="__main__")
    tray = space["TRAY"]
    assert isinstance(tray, Point)
    assert f"the cube stands at ({tray.x}, {tray.y}, {tray.z})" in capsys.readouterr().out


@pytest.mark.waits("about 7 s of homing, a pick and a place at fifty times real speed, through HTTP")
@pytest.mark.system
@pytest.mark.timeout(180)
def test_the_client_example_ends_with_the_cube_on_the_tray(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = EXAMPLES / "06_client.py"
    monkeypatch.setattr(sys, "argv", [str(path)])
    x, y = runpy.run_path(str(path), run_name="__main__")["TRAY"]
    said = capsys.readouterr().out
    assert "done ['done', 'done']" in said
    assert "refused with 3002" in said
    assert f"the cube stands at ({x:.2f}, {y:.2f}, 0.40)" in said
