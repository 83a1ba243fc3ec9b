"""`maya plot`: pictures of the workspace and of a job before any motion."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from dmc41x3.address import SIM
from dmc41x3.i18n import marked, phrase, translate
from dmc41x3.loops import run_virtual
from maya_un.assembly.stack import stack
from maya_un.cli import output
from maya_un.cli.configure import configuration, taught_places
from maya_un.cli.progress import computing
from maya_un.cli.settings import OutputSettings
from maya_un.client import pictures
from maya_un.config import Config
from maya_un.errors import InvalidValue
from maya_un.kinematics.workspace import Workspace
from maya_un.process.spec.job import Job, load_job
from maya_un.schema.encoding import to_data
from maya_un.schema.previews import JobInspection
from maya_un.values import Point

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DEFAULT = "maya-workspace.svg"
"""Default file of the picture of the workspace, in the current folder."""


DRAWING = marked("Drawing the picture")
"""Text on the terminal while a picture is drawn."""


class PlotRequest(NamedTuple):
    """Options of `maya plot workspace`: a view, the height of the plan [m], a place to mark [m], a file."""

    view: str = "all"
    height: float | None = None
    point: Point | None = None
    output: str | None = None


def workspace(request: PlotRequest, settings: OutputSettings) -> int:
    """Draw the workspace of the current configuration and print the file's path; return the exit code.

    Raises `InvalidValue` and `FileUnwritable`.
    """
    from maya_un.plots import style
    from maya_un.plots.workspace import WorkspaceView, workspace_figure

    path = Path(request.output or DEFAULT)
    style.kind_of(path)
    config = configuration(settings)
    height = config.cell.grasp_height if request.height is None else request.height
    if not 0.0 <= height <= config.geometry.height:
        reason = phrase(
            "it must be a height between the table and the boom, 0 to {height:g} m", height=config.geometry.height
        )
        raise InvalidValue(key="--height", value=height, reason=reason)
    with computing(DRAWING, settings):
        reachable = Workspace.of(config)
        style.save(workspace_figure(reachable, height, WorkspaceView(request.view), request.point), path)
        nearest = None if request.point is None else reachable.nearest(request.point)
    answer = {
        "path": str(path),
        "view": request.view,
        "height": height,
        "point": None if request.point is None else request.point._asdict(),
        "nearest": None if nearest is None else nearest._asdict(),
    }
    return output.answer(answer, translate("Picture: {path}", settings.language, path=path), settings)


DEFAULT_PICTURE = "maya-job.svg"
"""Default file of the picture, in the current folder."""

SAMPLES = 300
"""Samples drawn per motion."""

_HORIZON = 1e6


def plot(file: str, target: str | None, settings: OutputSettings) -> int:
    """Draw the job of `file` from the homed pose, and return the exit code.

    A job that is refused at a step is drawn up to this step, and the exit code is an error's. Raises the errors of
    reading the job, `InvalidJob` for a job without motion, `InvalidValue` and `FileUnwritable`.
    """
    path = Path(target or DEFAULT_PICTURE)
    inspection = draw(load_job(Path(file)), configuration(settings), path, settings)
    preview = inspection.preview
    answer = {
        "path": str(path),
        "duration": preview.duration,
        "lowest": preview.lowest,
        "highest": preview.highest,
        "closest": [to_data(near) for near in inspection.closest],
        "stop_time": inspection.stop_time,
        "stop_distance": inspection.stop_distance,
        "refusal": None if preview.refusal is None else to_data(preview.refusal),
    }
    output.answer(answer, translate("Picture: {path}", settings.language, path=path), settings)
    if preview.refusal is None:
        return output.DONE
    notice = preview.refusal.notice
    return output.concluded({"state": "refused", "code": notice.code, "message": notice.message}, settings)


def draw(job: Job, config: Config, path: Path, settings: OutputSettings) -> JobInspection:
    """Write the picture of a job from the homed pose, and return the inspection; raises as `plot` does."""
    from maya_un.plots import style

    style.kind_of(path)
    with computing(DRAWING, settings):
        inspection, workspace = run_virtual(inspected(job, config, taught_places(settings)), _HORIZON)
        style.save(figure(job.name, inspection, config, workspace), path)
    return inspection


async def inspected(job: Job, config: Config, places: Path | None = None) -> tuple[JobInspection, Workspace]:
    """Return a job in detail from the homed pose of a twin, and the workspace of its check.

    `places` is the file of taught places.
    """
    async with stack(config, SIM, live=False, places=places) as robot:
        inspection = await robot.service.inspect(job, from_homed=True, samples=SAMPLES)
        return inspection, robot.controller.workspace


def figure(name: str, inspection: JobInspection, config: Config, workspace: Workspace) -> Figure:
    """Return the figure of a job from the homed pose; raises `InvalidJob` for a job without motion."""
    title = f"{name}, {inspection.preview.duration:.1f} s from the homed pose on"
    return pictures.figure(title, inspection, config, workspace)
