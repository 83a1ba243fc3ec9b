"""Pictures of jobs before they are carried out."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from dmc41x3.i18n import phrase
from maya_un.client import requests
from maya_un.client.jobs import JobLike, body_of
from maya_un.client.plans import robot
from maya_un.client.steps import Plan
from maya_un.errors import InvalidJob
from maya_un.schema.previews import JobInspection

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from maya_un.config import Config
    from maya_un.kinematics.workspace import Workspace
    from maya_un.plots.job import MotionPhase

SAMPLES = 60
"""Samples per motion: enough for a smooth curve, in a picture of some 100 kB."""

_MANY = 12
"""With more phases than this, a picture names the steps instead."""


class Picture:
    """A figure that a notebook displays automatically; `figure` is a matplotlib figure."""

    def __init__(self, figure: Figure) -> None:
        self.figure = figure

    def save(self, path: str | os.PathLike[str]) -> None:
        """Save the picture as .svg, .png or .pdf, by the ending; raises `InvalidValue` and `FileUnwritable`."""
        from maya_un.plots import style  # noqa: PLC0415 - matplotlib loads slowly, and few clients draw

        style.save(self.figure, Path(path))

    def __repr__(self) -> str:
        return "<picture of a job>"

    def _repr_svg_(self) -> str:
        from maya_un.plots import style  # noqa: PLC0415 - as above

        return style.rendered(self.figure, "svg").decode()


def plot(job: JobLike, *, samples: int = SAMPLES) -> Plan[Picture]:
    """Return a picture of a job from the current position: axes over time with limits, and the gripper's path.

    Nothing moves. Each motion is drawn with `samples` samples. Raises `InvalidJob` if the job contains no motion.
    """
    from maya_un.kinematics.workspace import Workspace  # noqa: PLC0415 - few clients draw

    inspection = yield from robot.inspect(job, samples=samples)
    config = yield from requests.config()
    title = f"{body_of(job).get('name', 'job')}, {inspection.preview.duration:.1f} s"
    return Picture(figure(title, inspection, config, Workspace.of(config)))


def figure(title: str, inspection: JobInspection, config: Config, workspace: Workspace) -> Figure:
    """Return the figure of a job; raises `InvalidJob` if the job contains no motion."""
    import numpy as np  # noqa: PLC0415 - as above

    from maya_un.plots.job import job_figure  # noqa: PLC0415 - as above

    motions = inspection.motions
    if not motions:
        refusal = inspection.preview.refusal
        reason = phrase("nothing in it moves the axes") if refusal is None else refusal.notice.message.rstrip(".")
        raise InvalidJob(key="steps" if refusal is None else refusal.key, reason=reason)
    time, joints, velocity = (
        np.concatenate([np.array(getattr(motion, name)) for motion in motions])
        for name in ("time", "joints", "velocity")
    )
    return job_figure(time, joints, velocity, phases(inspection), config, workspace, title)


def phases(inspection: JobInspection) -> Sequence[MotionPhase]:
    """Return the intervals to name in a picture: the phases of a job, or its steps if there are too many phases."""
    from maya_un.plots.job import MotionPhase  # noqa: PLC0415 - as above

    bands = [band for band in inspection.bands if band.end > band.start]
    if len(bands) <= _MANY:
        return [MotionPhase(band.phase, band.start, band.end) for band in bands]
    names = {step.index: step.step for step in inspection.preview.steps}
    ends: dict[int, tuple[float, float]] = {}
    for band in bands:
        begun, _ = ends.get(band.step, (band.start, band.end))
        ends[band.step] = (begun, band.end)
    return [MotionPhase(names[step], start, end, str(step)) for step, (start, end) in ends.items()]
