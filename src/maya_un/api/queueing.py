"""The queue at the door: looked at, paused, reordered, and what becomes of an interrupted job.

Students may change and cancel what is their own; the gate has looked at everybody's role before.
"""

from __future__ import annotations

from collections.abc import Mapping

from maya_un.api.access.caller import LOCAL, Caller
from maya_un.process.view import JobLine, QueueView


class Queueing:
    """Asks and changes the queue of a process; every method that changes it returns how that stands then."""

    def view(self) -> QueueView:
        """Return the queue now, with the first 50 that wait."""
        raise NotImplementedError

    async def pause(self, by: Caller = LOCAL, *, when: str = "after step") -> QueueView:
        """Begin nothing more: `when` is "after step", or "now" to brake on the path and hold the step under way too.

        Raises `InvalidValue` for another `when`, and `CannotPause` for "now" while the robot homes.
        """
        raise NotImplementedError

    async def resume(self, by: Caller = LOCAL) -> QueueView:
        """Go on, with the step that is held too; raises `AnswerNeeded` while an interrupted job waits for a choice."""
        raise NotImplementedError

    async def step(self, by: Caller = LOCAL) -> QueueView:
        """Do one step and pause; while the queue runs, pause after the step under way.

        Raises `AnswerNeeded` as `resume` does.
        """
        raise NotImplementedError

    async def clear(self, by: Caller = LOCAL) -> QueueView:
        """Cancel all jobs that wait, held ones too; what is under way goes on."""
        raise NotImplementedError

    async def hold(self, number: int, by: Caller = LOCAL) -> JobLine:
        """Put a job aside that waits; raises `NotFound`, `WrongState`, `NotAllowed`."""
        raise NotImplementedError

    async def release(self, number: int, by: Caller = LOCAL) -> JobLine:
        """Let a job wait for its turn that was held; for a proposal that is the approval.

        Raises `NotFound`, `WrongState`.
        """
        raise NotImplementedError

    async def move(
        self,
        number: int,
        *,
        before: int | None = None,
        after: int | None = None,
        to: str | None = None,
        by: Caller = LOCAL,
    ) -> JobLine:
        """Put a job `before` or `after` another that waits, or `to` "first" or "last"; say one of the three.

        It takes the priority that it needs there. Raises `NotFound`, `WrongState`, `InvalidRequest`, `InvalidValue`.
        """
        raise NotImplementedError

    async def change(self, number: int, changes: Mapping[str, object], by: Caller = LOCAL) -> JobLine:
        """Change a job that has not begun: priority, notes, depends_on, on_failure, retries, stepwise, job (its body).

        Of one that is paused or interrupted the steps that have not begun may be replaced. Raises `NotFound`,
        `WrongState`, `InvalidRequest`, `InvalidValue`, `InvalidJob`, `UnknownName`, `NotAllowed`.
        """
        raise NotImplementedError

    async def again(self, number: int, *, from_step: int | None = None, by: Caller = LOCAL) -> JobLine:
        """Queue a job that has ended once more, as a new one, from a step (from 1) on: the first that was not done.

        Raises `NotFound`, `WrongState`, `InvalidValue`.
        """
        raise NotImplementedError

    async def recover(
        self, choice: str, *, holding: bool | None = None, resume_queue: bool = True, by: Caller = LOCAL
    ) -> QueueView:
        """Say what becomes of the interrupted job: resume, redo, skip or abort, and whether the gripper holds a part.

        What is to go on is checked whole from where the robot is, and refused as motion is (`NotHomed`, `PathRefused`
        and others); then it still waits. Raises `NotFound` where there is none, `InvalidValue` for what is no choice or
        contradicts the machine, `AnswerNeeded`.
        """
        raise NotImplementedError
