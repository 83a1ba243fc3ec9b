"""Jobs as arguments of a client: plain data, a file, or a builder."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, TypeAlias

from dmc41x3.i18n import phrase
from maya_un.client.building import PrimitiveSteps
from maya_un.client.targets import Spot, plain
from maya_un.errors import InvalidJob

if TYPE_CHECKING:
    from maya_un.process.spec.job import Job

Steps = tuple[Any, ...]


@dataclass(frozen=True, slots=True)
class JobBuilder(PrimitiveSteps):
    """A job built step by step; every method returns a new builder, so a common beginning can be reused.

    `JobBuilder("one cube").part("cube", 0.5, 1.1).home().pick("cube").place([1.1, 0.5])`. The job is checked only when
    it is submitted or previewed.
    """

    name: str = "job"
    parts: Mapping[str, Sequence[float]] = field(default_factory=dict[str, Sequence[float]])
    places: Mapping[str, Sequence[float]] = field(default_factory=dict[str, Sequence[float]])
    pallets: Mapping[str, Mapping[str, Any]] = field(default_factory=dict[str, Mapping[str, Any]])
    steps: Steps = ()
    rounds: int = 1

    def part(self, name: str, *at: float) -> Self:
        """Name a part that stands at x, y and perhaps z [m] at the start."""
        return replace(self, parts={**self.parts, name: list(at)})

    def spot(self, name: str, *at: float) -> Self:
        """Name a place at x, y and perhaps z [m]."""
        return replace(self, places={**self.places, name: list(at)})

    def pallet(self, name: str, corners: Sequence[Spot], rows: int, columns: int, *, full: bool = False) -> Self:
        """Name a grid of places by its corners (names, or x, y and perhaps z [m]).

        With `full` a part stands on every cell at the start.
        """
        grid = {"corners": [plain(corner) for corner in corners], "rows": rows, "columns": columns, "full": full}
        return replace(self, pallets={**self.pallets, name: grid})

    def for_each(self, pallet: str, steps: JobBuilder) -> Self:
        """Do the steps of another builder for every cell of a pallet; in them `tray[each]` is the current cell."""
        return self.step({"for_each": pallet, "do": list(steps.steps)})

    def repeat(self, rounds: int) -> Self:
        """Do all steps `rounds` times."""
        return replace(self, rounds=rounds)

    def step(self, step: str | Mapping[str, Any]) -> Self:
        """Add a step in the format of a job file."""
        return replace(self, steps=(*self.steps, step))

    def body(self) -> dict[str, Any]:
        """Return the job as plain data in the format of a job file."""
        named = {"parts": self.parts, "places": self.places, "pallets": self.pallets}
        filled = {key: dict(value) for key, value in named.items() if value}
        return {"name": self.name, **filled, "steps": list(self.steps), "repeat": self.rounds}


JobLike: TypeAlias = "Mapping[str, Any] | JobBuilder | Job | str | os.PathLike[str]"
"""A job: plain data in the format of a job file, a builder, a parsed job, or the path of a job file."""


def body_of(job: JobLike) -> dict[str, Any]:
    """Return a job as plain data; raises `FileUnreadable`, and `InvalidJob` for a bad file or another object."""
    if isinstance(job, JobBuilder):
        return job.body()
    if isinstance(job, Mapping):
        return dict(job)
    if isinstance(job, str | os.PathLike):
        from maya_un.process.spec.job import load_job  # noqa: PLC0415 - few clients read files

        job = load_job(Path(job))
    if not hasattr(job, "model_dump"):
        raise InvalidJob(
            key="job",
            reason=phrase("{kind} is no job: pass a mapping, a JobBuilder or a file", kind=type(job).__name__),
        )
    return job.model_dump(mode="json", exclude_none=True, warnings=False)
