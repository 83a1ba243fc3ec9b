"""`maya plot`: pictures of what the machine can reach, and of what a job will do."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from maya_un.cli import output
from maya_un.cli.configure import configuration
from maya_un.cli.settings import OutputSettings
from maya_un.cli.words import word
from maya_un.errors import InvalidValue
from maya_un.kinematics.workspace import Workspace
from maya_un.values import Point

DEFAULT = "maya-workspace.svg"
"""Where the picture of the workspace goes when nothing is said, in the current folder."""


class PlotRequest(NamedTuple):
    """What `maya plot workspace` was asked for: a view, the height of the plan [m], a place to mark [m], a file."""

    view: str = "all"
    height: float | None = None
    point: Point | None = None
    output: str | None = None


def workspace(request: PlotRequest, settings: OutputSettings) -> int:
    """Draw the workspace of the configuration in force and say where; return the exit code.

    Raises `InvalidValue` and `FileUnwritable`.
    """
    from maya_un.plots import style
    from maya_un.plots.workspace import WorkspaceView, workspace_figure

    path = Path(request.output or DEFAULT)
    style.kind_of(path)
    config = configuration(settings)
    reachable = Workspace.of(config)
    height = config.cell.grasp_height if request.height is None else request.height
    if not 0.0 <= height <= config.geometry.height:
        reason = f"the plan is cut between the table and the boom, 0 to {config.geometry.height:g} m"
        raise InvalidValue(key="--height", value=height, reason=reason)
    style.save(workspace_figure(reachable, height, WorkspaceView(request.view), request.point), path)
    nearest = None if request.point is None else reachable.nearest(request.point)
    answer = {
        "path": str(path),
        "view": request.view,
        "height": height,
        "point": None if request.point is None else request.point._asdict(),
        "nearest": None if nearest is None else nearest._asdict(),
    }
    return output.answer(answer, word("picture", settings.language, path=path), settings)
