"""The places of the parts, derived from jobs. No sensor measures them, and people may move parts by hand."""

from __future__ import annotations

from maya_un.events import Event, EventLog, GripperClosed, GripperOpened, StepAdvanced
from maya_un.process.queue.entries import QueueEntries
from maya_un.process.queue.report import JobRecord
from maya_un.process.spec.tasks import Action, HandledParts
from maya_un.robot.primitives.primitive import PartEffect
from maya_un.schema.jobs import TaskState
from maya_un.values import Point

_ENDED_EARLY = {TaskState.FAILED, TaskState.CANCELLED, TaskState.INTERRUPTED}


class BelievedParts:
    """Follows the parts that the latest job with named parts names, by the steps of all jobs and by the gripper.

    Before the first such job of this run there are none. A part counts as taken when a pick closes the gripper at its
    place, and as put down when a place opens the gripper. If the gripper opens otherwise, or a pick ends early, the
    place of the part is unknown.
    """

    def __init__(self, items: QueueEntries, events: EventLog) -> None:
        self._items = items
        self._handled = HandledParts({})
        self._named_by = 0
        self._under_way: Action | None = None
        events.heard_by(self._hear)

    @property
    def places(self) -> dict[str, Point | None]:
        """The places of the parts [m]; None for a part in the gripper, and for an unknown place."""
        return {name: None if name == self.held else place for name, place in self._handled.places.items()}

    @property
    def held(self) -> str | None:
        """The part that was taken last and not released since, None without one."""
        return self._handled.held

    def _hear(self, event: Event) -> None:
        doing = self._under_way
        match event:
            case StepAdvanced(job=number, index=index):
                self._advance(number, index)
            case GripperClosed() if doing is not None and doing.part is PartEffect.TAKES:
                self._handled.handle(doing)
            case GripperOpened() if doing is not None and doing.part is PartEffect.PUTS:
                self._handled.handle(doing)
            case GripperOpened():
                self._handled.release(None)
            case _:
                pass

    def _advance(self, number: int, index: int) -> None:
        item = self._items.in_memory(number)
        if item is None or item.record is None:
            return
        if item.record.expansion.start and number != self._named_by:
            self._adopt(number, item.record)
        step = item.record.steps[index - 1]
        action = step.task.action
        self._under_way = action if step.state is TaskState.RUNNING else None
        if step.state is TaskState.DONE:
            self._handled.handle(action)
        elif step.state in _ENDED_EARLY and action.part is PartEffect.TAKES and self.held is None:
            self._handled.handle(action)  # it may have taken the part
            self._handled.release(None)

    def _adopt(self, number: int, record: JobRecord) -> None:
        """Begin with the parts of a job, where its steps before this run have left them."""
        held, self._named_by = self.held, number
        self._handled = HandledParts(dict(record.expansion.start))
        self._handled.held = held if held in record.expansion.start else None
        for step in record.steps:
            if step.state is TaskState.DONE:
                self._handled.handle(step.task.action)
