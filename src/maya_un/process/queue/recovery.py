"""The choices for an interrupted job, and the effect of each. Pure; only a person chooses.

Nobody can know from here whether the gripper holds a part: the power may have gone at any instant. So it is asked
wherever what comes next depends on it, and taken from the machine only where that is certain: an open gripper is empty.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

from dmc41x3.i18n import marked
from maya_un.errors import AnswerNeeded, InvalidValue
from maya_un.robot.primitives import PRIMITIVES
from maya_un.robot.primitives.primitive import PartEffect
from maya_un.schema.jobs import Choice, TaskState

QUESTION = marked("is a part in the gripper?", "AnswerNeeded.question")


class RecoveryChoice(StrEnum):
    """The choices of a person."""

    RESUME = "resume"
    REDO = "redo"
    SKIP = "skip"
    ABORT = "abort"


@dataclass(frozen=True, slots=True)
class RecoverySituation:
    """An interrupted job: the `command` of the step that was under way ("" between two), those of the steps after it.

    `holding` is what the machine tells of the gripper: False where it is open, None where only a person can see.
    """

    command: str
    rest: tuple[str, ...]
    holding: bool | None


class RecoveryDecision(NamedTuple):
    """The effect of a choice: the step's next state (None if no step was running), and whether the job continues.

    `holding` is what is known of the gripper now, None where it does not matter.
    """

    step: TaskState | None
    goes_on: bool
    holding: bool | None


def choices(situation: RecoverySituation) -> tuple[Choice, ...]:
    """Return what may be chosen."""
    step = situation.command
    if not step:
        meanings = {RecoveryChoice.RESUME: "go on with the next step", RecoveryChoice.ABORT: "end the job as cancelled"}
    else:
        meanings = {
            RecoveryChoice.RESUME: _resumed(step),
            RecoveryChoice.REDO: f"do the {step} again",
            RecoveryChoice.SKIP: f"leave the {step} out and go on with the next step",
            RecoveryChoice.ABORT: "end the job as cancelled",
        }
    return tuple(Choice(one.value, meaning, _needs_answer(situation, one)) for one, meaning in meanings.items())


def decide(situation: RecoverySituation, choice: str, holding: bool | None) -> RecoveryDecision:
    """Return what `choice` does, where a person says whether the gripper is `holding` a part (None: he did not say).

    Raises `InvalidValue` for what is no choice here or contradicts the machine, and `AnswerNeeded`.
    """
    offered = [one.name for one in choices(situation)]
    if choice not in offered:
        raise InvalidValue(key="choice", value=repr(choice), reason=f"it is one of {', '.join(offered)}")
    if holding and situation.holding is False:
        raise InvalidValue(key="holding", value="true", reason="the gripper is open")
    chosen = RecoveryChoice(choice)
    if holding is None and _needs_answer(situation, chosen):
        raise AnswerNeeded(
            question=QUESTION, options=marked("holding: true or false; `--holding yes` or `no`", "AnswerNeeded.options")
        )
    known = situation.holding if holding is None else holding
    if chosen is RecoveryChoice.ABORT:
        return RecoveryDecision(TaskState.CANCELLED if situation.command else None, goes_on=False, holding=known)
    if not situation.command:
        return RecoveryDecision(None, goes_on=True, holding=known)
    if chosen is RecoveryChoice.SKIP:
        return RecoveryDecision(TaskState.SKIPPED, goes_on=True, holding=known)
    done = chosen is RecoveryChoice.RESUME and known is _held_after(situation.command)
    return RecoveryDecision(TaskState.DONE if done else TaskState.QUEUED, goes_on=True, holding=known)


def _held_after(command: str) -> bool | str:
    """Return what the gripper holds after a step, "whatever" where that tells nothing of the step."""
    return {PartEffect.TAKES: True, PartEffect.PUTS: False}.get(PRIMITIVES[command].part, "whatever")


def _resumed(command: str) -> str:
    match PRIMITIVES[command].part:
        case PartEffect.TAKES:
            return f"with the part in the gripper the {command} counts as done, otherwise do it again"
        case PartEffect.PUTS:
            return f"with the gripper empty the {command} counts as done, otherwise do it again"
        case _:
            return f"do the {command} again, which does no harm, and go on"


def _needs_answer(situation: RecoverySituation, chosen: RecoveryChoice) -> bool:
    """Whether a person has to say what the gripper holds: what comes depends on it and the machine cannot tell.

    That a place has happened is not told by an open gripper: it may have opened when the power went.
    """
    if chosen is RecoveryChoice.ABORT:
        return False
    if chosen is RecoveryChoice.RESUME and situation.command and PRIMITIVES[situation.command].part is PartEffect.PUTS:
        return True
    again = chosen in {RecoveryChoice.RESUME, RecoveryChoice.REDO} and situation.command
    return situation.holding is None and _matters([*([situation.command] if again else []), *situation.rest])


def _matters(commands: Iterable[str]) -> bool:
    """Whether it matters to these steps what the gripper holds: before it is opened or closed for itself."""
    parts = (PRIMITIVES[command].part for command in commands)
    return next((part for part in parts if part is not PartEffect.NONE), None) in {PartEffect.TAKES, PartEffect.PUTS}
