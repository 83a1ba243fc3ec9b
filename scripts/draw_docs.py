"""Draws the pictures of docs/images that are made from the code.

With --check it writes nothing and says which pictures are not current: those whose words differ, or in which something
has moved by more than a hundredth of a point. Names restrict it to some pictures.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from itertools import zip_longest
from pathlib import Path

import architecture_figures
import calibration_figures
import mechanism_figures
import performance_figures
import planned_figures
import queue_figures
from matplotlib.figure import Figure

from dmc41x3.loops import run_virtual
from maya_un.cli import plot
from maya_un.config import Config
from maya_un.kinematics import Workspace
from maya_un.plots.style import rendered
from maya_un.plots.workspace import WorkspaceView, workspace_figure
from maya_un.process.spec.job import load_job

ROOT = Path(__file__).resolve().parent.parent
IMAGES = ROOT / "docs" / "images"
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")
NAMED = re.compile(r'(?<=id=")[^"]*|(?<=#)[0-9a-z]+(?=[")])')
TOLERANCE = 0.01


def main(arguments: list[str]) -> int:
    """Draw or check; return 1 where a check found a picture that is not current."""
    check = "--check" in arguments
    asked = [argument for argument in arguments if not argument.startswith("-")] or list(PICTURES)
    stale = 0
    for name in asked:
        new, path = drawn(name), IMAGES / name
        if path.exists() and (same(path.read_text(encoding="utf-8"), new) or (check and name in LOOSE)):
            continue
        stale += 1
        if check:
            print(f"docs/images/{name} is not current: run scripts/docs")
        else:
            path.write_text(new, encoding="utf-8")
            print(f"docs/images/{name}")
    return 1 if check and stale else 0


def drawn(name: str) -> str:
    """Return a picture as SVG, without blanks at the ends of its lines."""
    svg = rendered(PICTURES[name](), "svg").decode()
    return "\n".join(line.rstrip() for line in svg.splitlines()) + "\n"


def same(old: str, new: str) -> bool:
    """Whether two pictures differ by nothing but rounding, and names that are made from coordinates."""
    if old == new:
        return True
    old, new = (NAMED.sub("", text) for text in (old, new))
    if NUMBER.sub("", old) != NUMBER.sub("", new):
        return False
    numbers = zip_longest(NUMBER.findall(old), NUMBER.findall(new), fillvalue="inf")
    return all(abs(float(one) - float(two)) <= TOLERANCE for one, two in numbers)


def section() -> Figure:
    return workspace_figure(Workspace.of(Config()), Config().cell.grasp_height, WorkspaceView.SECTION)


def plan() -> Figure:
    return workspace_figure(Workspace.of(Config()), Config().cell.grasp_height, WorkspaceView.PLAN)


def job() -> Figure:
    example, config = load_job(ROOT / "examples" / "01_pick_and_place.yaml"), Config()
    inspection, workspace = run_virtual(plot.inspected(example, config), 1e6)
    return plot.figure(example.name, inspection, config, workspace)


PICTURES: dict[str, Callable[[], Figure]] = {
    "architecture-layers.svg": architecture_figures.layers,
    "architecture-way-of-a-job.svg": architecture_figures.way,
    "calibration-residuals.svg": calibration_figures.residuals,
    "job-profiles.svg": job,
    "maya.svg": mechanism_figures.robot,
    "mechanism-triangle.svg": mechanism_figures.triangle,
    "mechanism-forces.svg": mechanism_figures.forces,
    "mechanism-between-the-ends.svg": mechanism_figures.between_the_ends,
    "mechanism-stopping.svg": mechanism_figures.stopping,
    "mechanism-time-optimal.svg": planned_figures.time_optimal,
    "performance-growth.svg": performance_figures.growth,
    "performance-limit.svg": performance_figures.limit,
    "performance-peers.svg": performance_figures.peers,
    "queue-states.svg": queue_figures.states,
    "workspace-section.svg": section,
    "workspace-plan.svg": plan,
}
"""Every picture by its name in docs/images."""

LOOSE = {"architecture-way-of-a-job.svg", "calibration-residuals.svg", "job-profiles.svg", "mechanism-time-optimal.svg"}
"""Pictures of plans and fits, which the next improvement changes: a check only sees that they can be drawn."""

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
