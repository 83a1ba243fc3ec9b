"""Compute the results of jobs before anything moves, in a worker if there is one.

With a worker, no computation blocks the loop, for a request or for the queue itself. Without one, as in a dry run, the
loop computes, and runs other tasks between two steps.
"""

from __future__ import annotations

import asyncio
import pickle
from collections.abc import Generator, Sequence
from typing import TypeVar

from maya_un.controller.protocol import Controller
from maya_un.errors import MayaError, TakesTooLong, TooLarge, TooMuchAsked, WorkerFailed
from maya_un.process import desk
from maya_un.process.inspection import inspected
from maya_un.process.job import Job
from maya_un.process.names import Recall
from maya_un.process.preview import JobOutlook, course_of, walked
from maya_un.process.tasks import Expansion, Task, expand
from maya_un.process.taught import TaughtPlaces
from maya_un.process.written import Body, StoredJob, expanded, write_job
from maya_un.robot.plan import Pose
from maya_un.robot.protocol import Robot
from maya_un.schema.previews import JobInspection, JobPreview
from maya_un.workers import Work, WorkerSet

T = TypeVar("T")

CHECK = "check"
"""Principal of the computation of the job that begins next."""

REPORT = "report"
"""Principal of the computation of a job that somebody reads."""

SUBMITTED = 128
"""Most jobs of one principal that may be parsed at once; more are refused."""

_LONG = 200
"""A job of more steps is expanded in a thread if there is no worker."""


class JobComputer:
    """Computes jobs for a robot, with `staff` if there is any."""

    def __init__(
        self, robot: Robot, controller: Controller, grasp_height: float, recall: Recall, staff: WorkerSet | None
    ) -> None:
        self._robot = robot
        self._controller = controller
        self._grasp_height = grasp_height
        self._recall = recall
        self._staff = staff
        self._sealed: tuple[TaughtPlaces | None, bytes] = (None, b"")

    async def written(self, job: object, *, whose: str) -> StoredJob:
        """Return a job of somebody ready to be queued, which comes as `desk.parsed` reads it.

        Raises as `Job.parse` and `write_job` do, and as `Workers.run`.
        """
        if self._staff is None:
            return write_job(desk.parsed(job), self._grasp_height, self._recall)
        asked = (job, self.taught(), self._grasp_height)
        answer = await self._staff.people.run(desk.write, *asked, whose=f"submit {whose}", each=SUBMITTED)
        name, body, rest = answer.value
        return StoredJob(name, body, Expansion(_joined(answer.parts), rest.parts, rest.remarks))

    async def expanded(self, body: Body, steps: int = 0, *, whose: str = CHECK) -> Expansion:
        """Return what a kept job of so many `steps` comes to; raises as `written.expanded` does, and `Workers.run`."""
        if self._staff is not None and "wish" not in body:
            worker = self._staff.people if whose == REPORT else self._staff.own
            answer = await worker.run(desk.expand_kept, body, self._grasp_height, whose=whose, each=SUBMITTED)
            return Expansion(_joined(answer.parts), answer.value.parts, answer.value.remarks)
        return await self._expanded_here(body, steps)

    async def expanded_anyway(self, body: Body) -> Expansion:
        """Return what a kept job comes to, also where no worker can be had: what it has done must not be forgotten.

        Raises as `written.expanded` does.
        """
        try:
            return await self.expanded(body)
        except (WorkerFailed, TakesTooLong, TooLarge, TooMuchAsked):
            return await self._expanded_here(body, _LONG + 1)

    async def _expanded_here(self, body: Body, steps: int) -> Expansion:
        if steps <= _LONG:
            return expanded(body, self._grasp_height)
        return await asyncio.get_running_loop().run_in_executor(None, expanded, body, self._grasp_height)

    async def walk(self, tasks: Sequence[Task], start: Pose, *, whose: str = CHECK) -> JobOutlook:
        """Return what `tasks` will be from `start`, and where they end; sends nothing, and lets others run meanwhile.

        Raises as `Workers.run` does.
        """
        if self._staff is None:
            return await _slowly(walked(self._robot, tasks, start))
        pose, courses = start, list[JobOutlook]()
        for begin in range(0, len(tasks), desk.PIECE):
            some = list(tasks[begin : begin + desk.PIECE])
            courses.append(await self._asked(desk.walk, some, pose, whose=whose))
            pose = courses[-1].end
            if courses[-1].preview.refusal is not None:
                break
        return course_of(courses, start)

    async def require(self, tasks: Sequence[Task], start: Pose) -> None:
        """Raise the refusal of the first of `tasks` that would be refused from `start`; sends nothing."""
        pose = start
        for begin in range(0, len(tasks), desk.PIECE):
            some = list(tasks[begin : begin + desk.PIECE])
            if self._staff is not None:
                pose = await self._asked(desk.require, some, pose, whose=CHECK)
                continue
            for task in some:
                pose = self._robot.preview(task.primitive, pose).end
                await asyncio.sleep(0)

    async def preview(self, job: Job, start: Pose) -> JobPreview:
        """Return what `job` would be from `start`; raises as `written` does for what it says; sends nothing."""
        if self._staff is None:
            tasks = expand(job, self._grasp_height, self._recall).tasks
            return (await _slowly(walked(self._robot, tasks, start))).preview
        return await self._asked(desk.preview, job, self.taught(), self._grasp_height, start, whose=CHECK)

    async def inspect(self, job: Job, start: Pose, samples: int) -> JobInspection:
        """Return `job` in detail, from `start`; raises as `preview` does; sends nothing."""
        if self._staff is None:
            tasks = expand(job, self._grasp_height, self._recall).tasks
            return await _slowly(inspected(self._robot, tasks, start, samples))
        asked = (job, self.taught(), self._grasp_height, start, samples)
        return await self._asked(desk.inspect, *asked, whose=CHECK)

    def taught(self) -> bytes:
        """Return a pickle of what is taught, or of the error why nobody can tell."""
        try:
            taught = self._recall()
        except MayaError as error:
            return pickle.dumps(error)
        if taught is not self._sealed[0]:
            self._sealed = (taught, pickle.dumps(taught, pickle.HIGHEST_PROTOCOL))
        return self._sealed[1]

    async def _asked(self, work: Work[..., T], *args: object, whose: str) -> T:
        assert self._staff is not None
        return (await self._staff.own.run(work, self._controller.workspace, *args, whose=whose)).value


async def _slowly(work: Generator[None, None, T]) -> T:
    """Return what work comes to, done in this loop; others run at each of its steps."""
    while True:
        try:
            next(work)
        except StopIteration as end:
            return end.value
        await asyncio.sleep(0)


def _joined(parts: Sequence[Sequence[Task]]) -> tuple[Task, ...]:
    return tuple(task for part in parts for task in part)
