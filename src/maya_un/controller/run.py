"""A coordinated motion under way, and how fast it is wanted: its prediction follows every change of speed."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from math import inf

import numpy as np

from dmc41x3.language.numbers import SCALE, fixed
from maya_un.kinematics.mechanism import Floats
from maya_un.motion.move import CoordinatedMove
from maya_un.values import Joints, StopReport

OnVia = Callable[[int], None]
"""Told the number of every via as it is passed, from 0."""

PLACES = 4
"""Decimal places of a speed ratio (Galil DMC-41x3, command VR)."""

_ROUNDING = 1e-6
"""A via due within this time [s] is passed."""


class MotionPace:
    """How fast motion is wanted: the speed override (above 0 up to 1), and whether a person holds all motion.

    The override has the four decimal places that the controller prints; it keeps them as whole 1/65536. `news`
    completes at the next change.
    """

    def __init__(self) -> None:
        self.override = 1.0
        self.paused = False
        self.news: asyncio.Future[None] = asyncio.get_running_loop().create_future()

    @property
    def factor(self) -> float:
        """The override as the controller keeps it."""
        return fixed(self.override) / SCALE

    @property
    def ratio(self) -> float:
        """What the controller's speed ratio (VR) is to be: 0 in a pause, else the factor."""
        return 0.0 if self.paused else self.factor

    def change(self, *, override: float | None = None, paused: bool | None = None) -> None:
        """Take over what is wanted from now on and wake whoever waits for it."""
        self.override = self.override if override is None else round(override, PLACES)
        self.paused = self.paused if paused is None else paused
        self.news.set_result(None)
        self.news = asyncio.get_running_loop().create_future()


class MotionRun:
    """A motion that began at loop time `began` [s], by `move`, whose profile is the prediction as it is now.

    `members` are the axes in it (0 to 2), `factor` the override it begins with. `vias` are ways along its path
    [counts], in order: `on_via` is told each as it is passed. Times are the loop's; a change of speed counts from when
    it was sent, which is early by as long as it takes to the controller.
    """

    def __init__(
        self,
        move: CoordinatedMove,
        began: float,
        members: tuple[int, ...],
        factor: float = 1.0,
        *,
        vias: tuple[float, ...] = (),
        on_via: OnVia | None = None,
    ) -> None:
        self.move = move
        self.began = began
        self.acknowledged = began
        """When the controller's answer to `BGS` came: it began before that, however slow the link was."""
        self.members = members
        self._factor = factor
        self._paused = False
        self._stood = 0.0
        self._rests_at = inf
        self._vias = vias if on_via is not None else ()
        self._on_via = on_via
        self._passed = 0
        if factor != 1.0:
            self._drive(0.0, factor)

    @cached_property
    def places(self) -> Floats:
        """The path: where the axes are at its start and at the end of every segment, of shape (n, 3) [counts]."""
        return np.array(self.move.places, dtype=np.float64)

    @property
    def end(self) -> float:
        """When the axes will be at rest at their end; infinite in a pause."""
        return self.began + self.move.duration

    @property
    def rest(self) -> float:
        """When the axes come to rest: in a pause where that holds them, else at the end."""
        return min(self.end, self.began + self._rests_at)

    def follow(self, pace: MotionPace, now: float) -> None:
        """Predict anew from `now` on for the pace wanted."""
        t = now - self.began
        if self._paused and not pace.paused:
            self._stood += max(0.0, t - self._rests_at)
            self._rests_at = inf
        if pace.paused and not self._paused:
            self._drive(t, 0.0)
            if self.move.duration == inf:
                self._rests_at = self.move.profile.pieces[-1].t
        elif not pace.paused:
            self._drive(t, pace.factor)
        self._paused, self._factor = pace.paused, pace.factor

    def times(self, now: float) -> tuple[float, float]:
        """Return how long it has moved and how long it will have in all [s]; standing in a pause does not count."""
        moved = min(now - self.began, self._rests_at)
        whole = self.move.duration
        if whole == inf:
            whole = self.move.profile.changed(self._rests_at, self._factor).duration
        return moved - self._stood, whole - self._stood

    def stop_report(self, now: float) -> StopReport:
        """Return what a stop said now makes of it."""
        elapsed = now - self.began
        duration, end = self.move.stop_at(elapsed)
        here = self.move.position_at(elapsed)
        return StopReport(duration > 0.0, duration, _minus(end, here))

    def next_via(self) -> float:
        """Return when the next via is passed; infinite where none is left or a pause keeps it away."""
        if self._passed >= len(self._vias):
            return inf
        return self.began + self.move.profile.when(self._vias[self._passed])

    def tell_vias(self, now: float) -> None:
        """Tell the vias that are passed by `now`, in order, each once."""
        while self._on_via is not None and self._passed < len(self._vias) and self.next_via() <= now + _ROUNDING:
            self._passed += 1
            self._on_via(self._passed - 1)

    def _drive(self, t: float, ratio: float) -> None:
        self.move = replace(self.move, profile=self.move.profile.changed(t, ratio))


def _minus(one: Joints, two: Joints) -> tuple[float, float, float]:
    return one.a - two.a, one.b - two.b, one.c - two.c
