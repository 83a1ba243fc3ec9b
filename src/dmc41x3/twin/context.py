"""What a command is executed with: the unit, the one who sent it, and the evaluation of its arguments."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from dmc41x3.language.codes import ErrorCode
from dmc41x3.twin.handles import Handle
from dmc41x3.twin.language.expressions import ONE, evaluate
from dmc41x3.twin.motion.axis import Axis
from dmc41x3.twin.motion.core import MotionCore
from dmc41x3.twin.operands import OperandScope
from dmc41x3.twin.refusal import Rejection
from dmc41x3.twin.thread import Thread
from dmc41x3.twin.unit import Unit

Answer: TypeAlias = str | bytes | None
"""Text (a line end is added), bytes as they are, or nothing but the prompt."""


@dataclass(slots=True)
class CallerContext:
    """One caller's view of the unit: a handle's, or that of a program's thread, which has no handle."""

    unit: Unit
    names: OperandScope
    caller: Handle | None = None
    thread: Thread | None = None

    @property
    def core(self) -> MotionCore:
        """The motion of the unit."""
        return self.unit.core

    def axes(self, places: list[int]) -> list[Axis]:
        """Return axes by their places."""
        return [self.unit.axes[place] for place in places]

    def number(self, text: str) -> float:
        """Return the value of an expression; raises `Rejection`."""
        return evaluate(text, self.names) / ONE

    def integer(self, text: str, minimum: int, maximum: int) -> int:
        """Return the value of an expression without its fraction; raises `Rejection` (6) where it is out of range."""
        value = int(self.number(text))
        if not minimum <= value <= maximum:
            raise Rejection(ErrorCode.OUT_OF_RANGE)
        return value


Handler: TypeAlias = Callable[[CallerContext, str], Answer]
"""A command: gets the text behind its two letters; raises `Rejection` where the answer is `?`."""
