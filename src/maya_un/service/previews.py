"""Previews of jobs, and whether points can be reached; nothing moves.

A long job arrives as the bytes of a request, and every answer is bytes. A worker parses, computes and serializes; only
the bytes pass through this process. The worker serves all callers in turn.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from typing import Any, TypeVar

from dmc41x3.i18n import phrase
from maya_un.config import Config
from maya_un.controller import planner
from maya_un.controller.protocol import Controller
from maya_un.errors import InvalidValue
from maya_un.kinematics.workspace import Workspace
from maya_un.process import computation
from maya_un.process.computation import JobComputer
from maya_un.robot.plan_builder import Pose
from maya_un.schema.encoding import in_pieces, to_json
from maya_un.schema.previews import ExampleJob, JobText, ParsedJob, Reach, Reachability, WorkspaceShape
from maya_un.service.access.operations import LOCAL, Caller
from maya_un.service.computing import Computing
from maya_un.service.reachability import reach_of, reachability_of, shape_of
from maya_un.values import Joints, Point
from maya_un.workers import Work, Workers

T = TypeVar("T")

MOST_SAMPLES = 10_000
"""Maximum number of samples per motion."""


class PreviewService:
    """Computes previews for a `controller`, in `workers` if given; `start` returns the start of a job.

    Every method raises the errors of the computation (`InvalidJob`, `UnknownName`, `Unreachable` …), and with workers
    `TooMuchAsked`, `TakesTooLong`, `TooLarge` and `WorkerFailed`.
    """

    def __init__(
        self,
        controller: Controller,
        computer: JobComputer,
        start: Callable[[bool], Pose],
        config: Config,
        workers: Workers | None,
    ) -> None:
        self._controller = controller
        self._computer = computer
        self._start = start
        self._grasp_height = config.cell.grasp_height
        self.computing = Computing(workers)

    async def preview(self, job: object, *, from_homed: bool = False, by: Caller = LOCAL) -> bytes:
        """Return a `JobPreview` as JSON, of a job as `computation.parsed` reads it.

        It starts at the position of the robot, or at the end of homing.
        """
        start = self._start(from_homed)
        if self.computing.workers is None:
            return to_json(await self._computer.preview(computation.parsed(job), start))
        course = self._computer.course(start)
        return await self.computing.pieces(
            by, preview, self._controller.workspace, job, self._computer.taught(), self._grasp_height, course
        )

    async def inspect(self, job: object, *, from_homed: bool = False, samples: int = 200, by: Caller = LOCAL) -> bytes:
        """Return a `JobInspection` as JSON, of a job as for `preview`, with `samples` per motion (2 to 10 000).

        Raises `InvalidValue`, and `TooLarge` if all motions together have more than `computation.MOST_SAMPLED` samples.
        """
        require_samples(samples)
        start = self._start(from_homed)
        if self.computing.workers is None:
            return to_json(await self._computer.inspect(computation.parsed(job), start, samples))
        course = self._computer.course(start)
        return await self.computing.pieces(
            by, inspect, self._controller.workspace, job, self._computer.taught(), self._grasp_height, course, samples
        )

    async def decoded(self, body: bytes, whose: str) -> dict[str, Any]:
        """Return a JSON object that is too long to parse in a loop; raises `InvalidRequest`."""
        if self.computing.workers is None:
            return computation.decode_object(body)
        return (await self.computing.workers.run(computation.decoded, body, whose=f"read {whose}")).value

    async def parse(self, request: bytes | Mapping[str, Any], by: Caller = LOCAL) -> ParsedJob:
        """Return the job in the `text` of a request, or its first mistake; raises `InvalidRequest`."""
        return await self.computing.value(by, computation.read_text, request)

    async def format(self, job: object, by: Caller = LOCAL) -> JobText:
        """Return a job as YAML; raises `InvalidJob`, `InvalidRequest`."""
        return await self.computing.value(by, computation.write_text, job)

    async def examples(self, by: Caller = LOCAL) -> list[ExampleJob]:
        """Return the example jobs, in the order of their names."""
        from maya_un.process.spec.examples import example_jobs  # noqa: PLC0415 - it loads yaml

        return await self.computing.value(by, example_jobs)

    async def reach(self, point: Point, by: Caller = LOCAL) -> Reach:
        """Return whether `point` [m] can be reached; if not, the reason and the nearest reachable point."""
        return await self._asked(by, reach, point)

    async def reach_many(self, points: Sequence[Point], by: Caller = LOCAL) -> Reachability:
        """Return whether each of the `points` [m] is reachable."""
        return await self._asked(by, reach_many, points)

    async def shape(self, z: float | None = None, by: Caller = LOCAL) -> WorkspaceShape:
        """Return the shape of the workspace, with its rings at a height `z` [m]."""
        return await self._asked(by, shape, z)

    async def fk(self, joints: Joints, by: Caller = LOCAL) -> Point:
        """Return the gripper point of joints (rad, m, m)."""
        return await self._asked(by, fk, joints)

    async def ik(self, point: Point, by: Caller = LOCAL) -> Joints:
        """Return the joints that hold the gripper at `point` [m]."""
        return await self._asked(by, ik, point)

    async def _asked(self, by: Caller, work: Work[..., T], *args: object) -> T:
        return await self.computing.value(by, work, self._controller.workspace, *args)


def require_samples(samples: int) -> None:
    """Raise `InvalidValue` for a number of samples that is not allowed."""
    if not 2 <= samples <= MOST_SAMPLES:
        raise InvalidValue(key="samples", value=samples, reason=phrase("it must be 2 to {most}", most=MOST_SAMPLES))


def prepare(config: Config) -> None:
    """Prepare a worker for a machine; the import of this module loads all that it needs."""
    planner.prepare(config)


def preview(*args: Any) -> Generator[Any, None, None]:
    """Yield the result of `computation.preview` as JSON."""
    yield from in_pieces(to_json((yield from computation.preview(*args))))


def inspect(*args: Any) -> Generator[Any, None, None]:
    """Yield the result of `computation.inspect` as JSON."""
    yield from in_pieces(to_json((yield from computation.inspect(*args))))


def reach(workspace: Workspace, point: Point) -> Generator[None, None, Reach]:
    """Return the reachability of a point."""
    yield
    return reach_of(workspace, point)


def reach_many(workspace: Workspace, points: Sequence[Point]) -> Generator[None, None, Reachability]:
    """Return the reachability of several points."""
    yield
    return reachability_of(workspace, points)


def shape(workspace: Workspace, z: float | None) -> Generator[None, None, WorkspaceShape]:
    """Return the shape of a workspace."""
    yield
    return shape_of(workspace, z)


def fk(workspace: Workspace, joints: Joints) -> Generator[None, None, Point]:
    """Return the gripper point of joints."""
    yield
    return workspace.mechanism.fk(workspace.require(joints))


def ik(workspace: Workspace, point: Point) -> Generator[None, None, Joints]:
    """Return the joints of a gripper point."""
    yield
    return workspace.require(point)
