"""When a sequence is where: the stretches of constant acceleration of its present plan, and how much of it is laid out.

A new plan replaces the old one from some time on. Of a plan with long arcs only a part becomes timelines at once, up
to `reach`; at `horizon`, somewhat before, the next part is due.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from math import inf, sqrt

from dmc41x3.twin.motion.path import PathSpan, SequencePath
from dmc41x3.twin.motion.route import Route

AHEAD = 5000
"""About how many pieces of a timeline are worked out at a time."""


class Schedule:
    """A plan that is empty at time `t` [s]; `end` is when the sequence ends, infinite where it never does."""

    def __init__(self, t: float) -> None:
        self.end = t
        self.reach = self.horizon = inf
        self._stretches: list[PathSpan] = []
        self._times: list[float] = []
        self._exit = 0.0
        self._fresh = 0

    def state(self, t: float) -> PathSpan:
        """Return where on the path the sequence is at time `t`."""
        at, segment, s, v, a = self._stretches[self._index(t)]
        span = min(t, self.end) - at
        return PathSpan(t, segment, s + (v + 0.5 * a * span) * span, max(0.0, v + a * span), a)

    def entry(self, number: int) -> PathSpan:
        """Return the state at the start of a segment that is still to come, or to be appended to the path."""
        index = bisect_left(self._stretches, number, key=lambda stretch: stretch.segment)
        if index == len(self._stretches):
            return PathSpan(self.end, number, 0.0, self._exit, 0.0)
        return self._stretches[index]

    def last(self, t: float) -> bool:
        """Tell whether the last stretch is under way at time `t`."""
        return bool(self._times) and t >= self._times[-1]

    def reaches(self, distance: float, t: float, route: Route) -> float:
        """Return when after `t` the way along the route is `distance` [counts], the end where it never is [s]."""
        for index in range(self._index(t), len(self._stretches)):
            at, number, s, v, a = self._stretches[index]
            rest = distance - route.at(number)[1].way - s
            square = v * v + 2.0 * a * rest
            if square >= 0.0 and v + sqrt(square) > 0.0:
                there = at + 2.0 * rest / (v + sqrt(square))
                if there <= self._until(index):
                    return max(t, there)
        return self.end

    def steady(self, t: float) -> float:
        """Return when the acceleration under way at time `t` ends [s]."""
        index = self._index(t)
        while index < len(self._stretches) and self._stretches[index].a > 0.0:
            index += 1
        return max(t, self._times[index] if index < len(self._times) else self.end)

    def splice(self, new: SequencePath, t: float, route: Route) -> None:
        """Let a new path replace the old one from time `t` on; one without any way left rests there."""
        if not new.stretches and self._stretches and t <= self._times[0]:
            new = new._replace(stretches=[self.state(t)._replace(a=0.0)])
        self._fresh = bisect_left(self._times, t)
        self._stretches[self._fresh :] = new.stretches
        self._times[self._fresh :] = [stretch.t for stretch in new.stretches]
        self.end, self._exit = new.end, new.speed
        self._look_ahead(t, route)

    def extend(self, route: Route) -> float:
        """Have the next part laid out; return from when on."""
        t = self.reach
        index = self._index(t)
        if self._times[index] < t:
            index += 1
            self._stretches.insert(index, self.state(t))
            self._times.insert(index, t)
        self._fresh = index
        self._look_ahead(t, route)
        return t

    def drop(self, t: float) -> None:
        """Forget what is over at time `t`."""
        gone = self._index(t)
        del self._stretches[:gone], self._times[:gone]

    def fresh(self) -> list[tuple[PathSpan, float]]:
        """Return the stretches of the part that is to be laid out, each with its end [s]."""
        first = self._fresh
        ends = [*self._times[first + 1 :], self.end]
        laid = zip(self._stretches[first:], ends, strict=False)  # a plan without any way has but its end
        return [(stretch, min(end, self.reach)) for stretch, end in laid if stretch.t < self.reach]

    def _look_ahead(self, t: float, route: Route) -> None:
        """Choose how far from `t` on the timelines are worked out now."""
        self.reach = self.horizon = inf
        if not route.curved and len(self._stretches) - self._fresh <= AHEAD:
            return
        left = float(AHEAD)
        for index in range(self._fresh, len(self._stretches)):
            at, number, _, v, a = self._stretches[index]
            arc = route.at(number)[0].arc
            span = self._until(index) - at
            count = arc.quadratics(v, a, span) if arc else 1.0
            if count > left and span < inf:
                self.reach = at + span * min(1.0, max(left, 100.0) / count)
                self.horizon = t + 0.75 * (self.reach - t)
                return
            left -= count

    def _index(self, t: float) -> int:
        return max(0, bisect_right(self._times, t) - 1)

    def _until(self, index: int) -> float:
        """Return when a stretch ends [s]."""
        return self._times[index + 1] if index + 1 < len(self._times) else self.end
