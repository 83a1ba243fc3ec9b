"""A simulated person at the twin, who acts on its mechanics and sees only them, not the readings of the controller."""

from __future__ import annotations

from dmc41x3.i18n import Phrase
from maya_un.assembly.controller import Twin
from maya_un.commission.questions import ALREADY, CLOSED, GO, NO, NOTHING, OPEN, YES, Question, QuestionKind
from maya_un.machine.truth import Switch

VISIBLE = 3e-4
"""A shorter motion is not seen [m]; of the boom, at its end."""

_LOOKS = {QuestionKind.SEEN, QuestionKind.LENGTH, QuestionKind.LAMP, QuestionKind.GRIPPER}


class TwinPerson:
    """A person who follows all instructions correctly."""

    def __init__(self, twin: Twin) -> None:
        self._twin = twin
        self._before = twin.mechanics.true_joints()

    async def ask(self, question: Question) -> str:
        """Carry out the instruction, and return what there is to see."""
        self._twin.controller.look()
        return self._found(question) if question.ask in _LOOKS else self._done(question)

    def begin(self, title: Phrase) -> None:
        """Do nothing: the simulated person needs no news of the steps."""

    def tell(self, text: Phrase) -> None:
        """Do nothing: the simulated person needs no messages."""

    def _done(self, question: Question) -> str:
        """Do what is asked for."""
        match question.ask:
            case QuestionKind.READY:
                self._before = self._twin.mechanics.true_joints()
            case QuestionKind.PRESS_SWITCH | QuestionKind.RELEASE_SWITCH:
                return self._switch(question)
            case QuestionKind.PRESS_STOP | QuestionKind.RELEASE_STOP:
                self._twin.press_stop(pressed=question.ask is QuestionKind.PRESS_STOP)
            case QuestionKind.SUPPORT | QuestionKind.FREE:
                self._twin.mechanics.support(question.ask is QuestionKind.SUPPORT)
            case _:
                return NO
        return GO

    def _found(self, question: Question) -> str:
        """Look at what is asked for."""
        assert question.axis is not None or question.ask is QuestionKind.GRIPPER
        match question.ask:
            case QuestionKind.SEEN:
                return self._seen()
            case QuestionKind.LENGTH:
                return f"{abs(self._ways()[question.axis or 0]) * 1e3:.1f}"
            case QuestionKind.LAMP:
                return NO if "abc"[question.axis or 0] in self._twin.mechanics.truth.wiring.amplifier_off else YES
            case _:
                return CLOSED if self._twin.mechanics.record.gripper_closed else OPEN

    def _switch(self, question: Question) -> str:
        assert question.axis is not None
        side: Switch = "forward" if question.side == "forward" else "reverse"
        mechanics = self._twin.mechanics
        here, places = mechanics.true_joints()[question.axis], mechanics.truth.switches[question.axis]
        if here >= places[1] if side == "forward" else here <= places[0]:
            return ALREADY if question.ask is QuestionKind.PRESS_SWITCH else GO
        mechanics.press(question.axis, side, down=question.ask is QuestionKind.PRESS_SWITCH)
        self._twin.controller.look()
        return GO

    def _ways(self) -> list[float]:
        """Return how far a, b, c moved since the last announcement [m]; of the boom, at its end."""
        now, arm = self._twin.mechanics.true_joints(), self._twin.mechanics.truth.length
        a, b, c = (here - before for here, before in zip(now, self._before, strict=True))
        return [a * arm, b, c]

    def _seen(self) -> str:
        ways = self._ways()
        axis = max(range(3), key=lambda one: abs(ways[one]))
        if abs(ways[axis]) < VISIBLE:
            return NOTHING
        return f"{'abc'[axis]}{'+' if ways[axis] > 0.0 else '-'}"
