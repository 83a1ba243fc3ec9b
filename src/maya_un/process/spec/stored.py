"""The form in which an accepted job is stored.

The journal stores jobs and commands as written, with the taught places that they name.

A taught place that a job names is stored with the job, as it was on submission. Later teaching and restarts do not
change the job that was checked on acceptance.

    {"name": …, "steps": […]}                       a job that names no taught place
    {"wish": {"command": …}}                        one primitive
    {"job": {…}, "taught": {"poses": {…}, "pallets": {…}}}      with taught places; also a primitive
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, TypeVar

from maya_un.errors import InvalidValue
from maya_un.process.journal.protocol import JobRow
from maya_un.process.spec.job import Grid, Job
from maya_un.process.spec.pallet import read_reference
from maya_un.process.spec.poses import TaughtPallet, TaughtPlaces
from maya_un.process.spec.tasks import Expansion, Recall, expand, single
from maya_un.robot.primitives import PRIMITIVES, Primitive, from_dict, to_dict
from maya_un.schema.jobs import TaughtPose
from maya_un.values import Joints, Point

COMMAND_KEY = "wish"
"""Key of a single primitive in the journal. Its name is old: journals of version 1 have it, so it cannot change."""


def job_of_command(request: Mapping[str, object]) -> Job | None:
    """Return the job of a command like {"command": "pick", "target": "shelf"}, None if the command contains no name.

    Raises `InvalidValue` for `next` and `each`, which are cells of a job only.
    """
    command = request.get("command")
    primitive = PRIMITIVES.get(command) if isinstance(command, str) else None
    if primitive is None or not primitive.argument.nameable:
        return None
    key = primitive.argument.key
    name = request.get(key)
    if not isinstance(name, str) or len(request) != 2:
        return None
    reference = read_reference(name)
    if reference is not None and isinstance(reference.which, str):
        raise InvalidValue(key=key, value=name, reason="next and each are for jobs; name a cell by row and column")
    return Job.parse({"name": command, "steps": [{command: name}]})


T = TypeVar("T")

Body = dict[str, Any]
"""Plain data that JSON can hold."""


@dataclass(frozen=True, slots=True)
class StoredJob:
    """A job ready to be queued: its name, its stored form, and its expansion."""

    name: str
    body: Body
    expansion: Expansion


def write_job(job: Job, grasp_height: float, recall: Recall) -> StoredJob:
    """Return the stored form of a job; raises as `tasks.expand` and `recall` do."""
    body: Body = job.as_data()
    noted = _Noted(recall)
    expansion = expand(job, grasp_height, noted.recall)
    return StoredJob(job.name, body if noted.empty else {"job": body, "taught": noted.body()}, expansion)


def write_command(request: Primitive | Mapping[str, object], grasp_height: float, recall: Recall) -> StoredJob:
    """Return the stored form of one primitive; raises `InvalidRequest`, `UnknownName`, `InvalidValue`."""
    job = job_of_command(request) if isinstance(request, Mapping) else None
    if job is not None:
        noted = _Noted(recall)
        expansion = expand(job, grasp_height, noted.recall)
        body: Body = {COMMAND_KEY: dict(request) if isinstance(request, Mapping) else {}}
        return StoredJob(job.name, body if noted.empty else body | {"taught": noted.body()}, expansion)
    primitive = from_dict(request, grasp_height) if isinstance(request, Mapping) else request
    return StoredJob(primitive.command, {COMMAND_KEY: to_dict(primitive)}, single(primitive))


def expanded(body: Body, grasp_height: float) -> Expansion:
    """Return the expansion of a stored job; raises as `tasks.expand` does."""
    taught = _taught(body["taught"]) if "taught" in body else TaughtPlaces()
    if COMMAND_KEY not in body:
        return expand(Job.parse(as_written(body)), grasp_height, lambda: taught)
    job = job_of_command(body[COMMAND_KEY])
    if job is not None:
        return expand(job, grasp_height, lambda: taught)
    return single(from_dict(body[COMMAND_KEY], grasp_height))


def as_written(body: Body) -> Body:
    """Return a job as it was submitted, without the data that is stored with it; a command as {"wish": …}."""
    if COMMAND_KEY in body:
        return {COMMAND_KEY: body[COMMAND_KEY]}
    return body["job"] if "taught" in body else body


def version_of(row: JobRow) -> str:
    """Return a hash of what an approval is about: the steps of a job, its taught places, its options without notes."""
    options = {key: value for key, value in asdict(row.options).items() if key not in {"held", "notes"}}
    text = json.dumps({"body": row.body, "options": options}, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:16]


class _Noted:
    """Returns the taught places, and records which of them are used."""

    def __init__(self, recall: Recall) -> None:
        self._recall = recall
        self._poses = _Noting[TaughtPose]({})
        self._pallets = _Noting[TaughtPallet]({})

    def recall(self) -> TaughtPlaces:
        taught = self._recall()
        self._poses, self._pallets = _Noting(taught.poses), _Noting(taught.pallets)
        return TaughtPlaces(self._poses, self._pallets)

    @property
    def empty(self) -> bool:
        return not self._poses.used and not self._pallets.used

    def body(self) -> Body:
        poses = {
            name: {
                "joints": list(pose.joints),
                "point": None if pose.point is None else list(pose.point),
                "taught": pose.taught,
            }
            for name, pose in self._poses.used.items()
        }
        pallets = {
            name: {"grid": pallet.grid.model_dump(mode="json", warnings=False), "taught": pallet.taught}
            for name, pallet in self._pallets.used.items()
        }
        return {"poses": poses, "pallets": pallets}


class _Noting(dict[str, T]):
    """A mapping that records which entries are read."""

    def __init__(self, known: Mapping[str, T]) -> None:
        super().__init__(known)
        self.used: dict[str, T] = {}

    def __getitem__(self, name: str) -> T:
        self.used[name] = super().__getitem__(name)
        return self.used[name]


def _taught(body: Body) -> TaughtPlaces:
    poses = {
        name: TaughtPose(
            name,
            Joints(*pose["joints"]),
            None if pose["point"] is None else Point(*pose["point"]),
            pose["taught"],
        )
        for name, pose in body["poses"].items()
    }
    pallets = {
        name: TaughtPallet(name, Grid.model_validate(pallet["grid"]), pallet["taught"])
        for name, pallet in body["pallets"].items()
    }
    return TaughtPlaces(poses, pallets)
