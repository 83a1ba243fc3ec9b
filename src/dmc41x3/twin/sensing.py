"""What the controller reads of a plant where something is broken: encoders that count no more, switches that stick.

The plant itself goes on as before. Its own record, where it keeps one, is of what is, not of what is read.
"""

from __future__ import annotations

INPUTS = ("forward", "reverse", "home")
"""Inputs of an axis, in the order in which a plant gives them."""


class Sensing:
    """The broken sensors of one plant; positions are motor counts."""

    def __init__(self) -> None:
        self._lost: dict[int, float] = {}
        self._shift: dict[int, float] = {}
        self._forced: dict[tuple[int, str], bool] = {}

    def fail_encoder(self, axis: int, position: float, on: bool) -> None:
        """Let an encoder count no more, with the axis at `position`; or let it count on from where it stopped."""
        if on:
            self._lost.setdefault(axis, self.position(axis, position))
        elif axis in self._lost:
            self._shift[axis] = self._lost.pop(axis) - position

    def force_inputs(self, axis: int, levels: dict[str, bool | None]) -> None:
        """Hold inputs of an axis at an electrical level, true for high, or let them go (None).

        Raises `ValueError` for another name than forward, reverse, home.
        """
        for name, level in levels.items():
            if name not in INPUTS:
                raise ValueError(f"an axis has the inputs {', '.join(INPUTS)}, and not {name}")
            if level is None:
                self._forced.pop((axis, name), None)
            else:
                self._forced[axis, name] = level

    def resume(self, axis: int) -> None:
        """Let an axis be where its encoder says, for its reference begins there anew and the plant is the reference."""
        self._shift.pop(axis, None)

    def lost(self, axis: int) -> bool:
        """Return whether an encoder counts no more."""
        return axis in self._lost

    def position(self, axis: int, position: float) -> float:
        """Return what is read of an axis that is at `position`."""
        lost = self._lost.get(axis)
        return position + self._shift.get(axis, 0.0) if lost is None else lost

    def velocity(self, axis: int, velocity: float) -> float:
        """Return what is read of an axis that moves at `velocity`."""
        return 0.0 if axis in self._lost else velocity

    def inputs(self, axis: int, levels: tuple[bool, bool, bool]) -> tuple[bool, bool, bool]:
        """Return what is read of inputs that are at `levels`."""
        if not self._forced:
            return levels
        forward, reverse, home = (
            self._forced.get((axis, name), level) for name, level in zip(INPUTS, levels, strict=True)
        )
        return forward, reverse, home
