"""The reference of one axis as a function of time: piecewise quadratic, closed form, never stepped.

Positions are motor counts since power-up. The machine plans a timeline, the plant follows it (and may look at
a time before the present, since it follows late).
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from itertools import chain
from math import inf, nextafter, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

FLAT = 1e-9
"""An acceleration below this [counts/s²] turns no axis round."""

_FEW = 12
"""Up to so many pieces a loop is faster than numpy."""


class TimelinePiece(NamedTuple):
    """From time `t` [s]: position `p` [counts], velocity `v` [counts/s], acceleration `a` [counts/s²].

    A piece is valid until the `t` of the next one; the last one for ever.
    """

    t: float
    p: float
    v: float
    a: float

    def at(self, t: float) -> tuple[float, float]:
        """Return position [counts] and velocity [counts/s] at time `t` [s]."""
        s = t - self.t
        return self.p + (self.v + 0.5 * self.a * s) * s, self.v + self.a * s

    def turn(self, start: float, end: float) -> float | None:
        """Return the time strictly between `start` and `end` [s] at which the velocity changes its sign."""
        if abs(self.a) < FLAT:
            return None
        turn = self.t - self.v / self.a
        return turn if start < turn < end else None

    def arrival(self, level: float, rising: bool) -> float:
        """Return when the piece passes `level` [counts] on its way up (or down) [s].

        The quadratic is solved in the form that does not cancel; it must have such a root.
        """
        direction = 1.0 if rising else -1.0
        gap, v, a = direction * (level - self.p), direction * self.v, direction * self.a
        speed = sqrt(max(0.0, v * v + 2.0 * a * gap))
        if v >= 0.0:
            return self.t + (2.0 * gap / (v + speed) if v + speed > 0.0 else 0.0)
        return self.t + ((speed - v) / a if a else 0.0)


class Timeline:
    """Reference of one axis; begins at rest at `position` [counts] and, unless planned, stays there."""

    __slots__ = ("_pieces", "_table", "_times", "_version")

    def __init__(self, position: float = 0.0, t: float = 0.0) -> None:
        self._pieces = [TimelinePiece(t, position, 0.0, 0.0)]
        self._times = [t]
        self._table: _TimelineTable | None = None
        self._version = 0

    @property
    def end(self) -> float:
        """When the last piece begins [s]: at rest from there on, unless the axis jogs."""
        return self._times[-1]

    @property
    def jogs(self) -> bool:
        """Whether the last piece still moves, so that the axis never comes to rest by itself."""
        return self._pieces[-1].v != 0.0 or self._pieces[-1].a != 0.0

    @property
    def version(self) -> int:
        """Counts the plans made; a reader that remembers something about the future compares it."""
        return self._version

    @property
    def pieces(self) -> tuple[TimelinePiece, ...]:
        """The pieces kept, oldest first."""
        return tuple(self._pieces)

    def ahead(self, t: float) -> list[TimelinePiece]:
        """Return the plan from time `t` [s] on; the first piece begins there."""
        index = self._index(t)
        piece = self._pieces[index]
        return [TimelinePiece(t, *self.at(t), piece.a if t >= piece.t else 0.0), *self._pieces[index + 1 :]]

    def plan(self, t: float, pieces: Sequence[TimelinePiece]) -> None:
        """Replace everything from time `t` [s] on; `pieces` are in order of time and the first begins at `t`.

        The last piece extends for ever, so it is at rest or of constant velocity. Raises `ValueError` where
        the pieces do not begin at `t`.
        """
        if not pieces or pieces[0].t != t:
            raise ValueError(f"the first piece must begin at {t}")
        kept = bisect_left(self._times, t)
        self._pieces[kept:] = pieces
        self._times[kept:] = [piece.t for piece in pieces]
        self._table = None
        self._version += 1

    def hold(self, t: float) -> None:
        """Stop at once: rest from time `t` [s] on at the position the axis has then."""
        position, _ = self.at(t)
        self.plan(t, (TimelinePiece(t, position, 0.0, 0.0),))

    def at(self, t: float) -> tuple[float, float]:
        """Return position [counts] and velocity [counts/s] at time `t` [s]; rest before the first piece."""
        piece = self._pieces[-1]  # mostly the present is in the last one, at rest or at speed
        if t < piece.t:
            piece = self._pieces[self._index(t)]
            if t < piece.t:
                return piece.p, 0.0
        return piece.at(t)

    def sample(self, ts: Floats) -> Floats:
        """Return the positions [counts] at the times `ts` [s], shape of `ts`."""
        return self.motion(ts)[0]

    def motion(self, ts: Floats) -> tuple[Floats, Floats, Floats]:
        """Return positions [counts], velocities [counts/s] and accelerations [counts/s²] at `ts` [s].

        Each has the shape of `ts`. Before the first piece the axis is at rest.
        """
        times, p0, v0, a0 = self._arrays().columns
        index = np.searchsorted(times, ts, side="right") - 1
        early = index < 0
        index[early] = 0
        s = ts - times[index]
        a = a0[index]
        v = v0[index]
        if early.any():
            s[early] = a[early] = v[early] = 0.0
        return p0[index] + (v + 0.5 * a * s) * s, v + a * s, a

    def boundaries(self, t0: float, t1: float) -> list[float]:
        """Return the times in (t0, t1] at which a piece begins."""
        return self._times[bisect_right(self._times, t0) : bisect_right(self._times, t1)]

    def changes(self, t0: float, t1: float) -> Floats:
        """Return the times in (t0, t1] at which a piece begins, and in [t0, t1] at which the axis turns within one."""
        table = self._arrays()
        begins, turns = table.columns[0], table.turns
        return np.concatenate((begins[(begins > t0) & (begins <= t1)], turns[(turns >= t0) & (turns <= t1)]))

    def bounds(self, t0: float, t1: float) -> tuple[float, float]:
        """Return a lower and an upper bound of the positions [counts] in [t0, t1]; they may be a little wide."""
        first, last = self._index(t0), self._index(t1)
        if last - first <= _FEW:
            return self._span(t0, t1)
        table = self._arrays()
        low, high = self._span(self._times[last], t1)
        return min(low, float(table.low[first:last].min())), max(high, float(table.high[first:last].max()))

    def crossing(self, level: float, t0: float, t1: float, rising: bool) -> float | None:
        """Return the first time in (t0, t1] at which the position reaches `level` [counts] from below.

        With `rising` false: from above. A position that only touches the level has reached it; one that
        begins at the level must leave it first.
        """
        low, high = self.bounds(t0, t1)
        if t1 <= t0 or not low <= level <= high:
            return None
        direction = 1.0 if rising else -1.0
        before = direction * (self.at(t0)[0] - level)
        for piece, a, b in self._monotone(t0, t1):
            after = direction * (piece.at(b)[0] - level)
            if before < 0.0 <= after:
                return min(max(piece.arrival(level, rising), a, nextafter(t0, inf)), b)
            before = after
        return None

    def forget(self, before: float) -> None:
        """Drop the pieces that end before time `before` [s].

        Called by the plant, which alone knows how far into the past it still looks.
        """
        gone = self._index(before)
        if gone > 0:
            del self._pieces[:gone]
            del self._times[:gone]
            self._table = self._table and self._table.without(gone)

    def _index(self, t: float) -> int:
        return max(0, bisect_right(self._times, t) - 1)

    def _monotone(self, t0: float, t1: float) -> Iterator[tuple[TimelinePiece, float, float]]:
        """Yield the stretches (piece, from, to) of (t0, t1] within which the axis does not turn."""
        index = self._index(t0)
        start = max(t0, self._times[index])
        while start < t1 and index < len(self._pieces):
            piece = self._pieces[index]
            index += 1
            end = t1 if index == len(self._pieces) else min(t1, self._times[index])
            turn = piece.turn(start, end)
            if turn is not None:
                yield piece, start, turn
                start = turn
            yield piece, start, end
            start = end

    def _span(self, t0: float, t1: float) -> tuple[float, float]:
        low = high = self.at(t0)[0]
        for piece, a, b in self._monotone(t0, t1):
            for position in (piece.at(a)[0], piece.at(b)[0]):
                low, high = min(low, position), max(high, position)
        return low, high

    def _arrays(self) -> _TimelineTable:
        if self._table is None:
            self._table = _TimelineTable.of(self._pieces)
        return self._table


class _TimelineTable(NamedTuple):
    """The pieces as columns; of each but the last the least and greatest position, and when it turns, if it does."""

    columns: tuple[Floats, Floats, Floats, Floats]  # t, p, v, a
    low: Floats
    high: Floats
    turns: Floats

    @classmethod
    def of(cls, pieces: list[TimelinePiece]) -> _TimelineTable:
        flat = np.fromiter(chain.from_iterable(pieces), np.float64, 4 * len(pieces))
        columns = np.ascontiguousarray(flat.reshape(-1, 4).T)  # (4, pieces)
        t, p, v, a = columns[:, :-1]
        length = columns[0, 1:] - t
        end = p + (v + 0.5 * a * length) * length
        turn = np.divide(-v, a, out=np.zeros(len(a)), where=np.abs(a) >= FLAT)
        turn = np.minimum(np.maximum(turn, 0.0), length)
        extreme = p + (v + 0.5 * a * turn) * turn
        low = np.minimum(np.minimum(p, end), extreme)
        high = np.maximum(np.maximum(p, end), extreme)
        turns = (t + turn)[(turn > 0.0) & (turn < length)]
        return cls((columns[0], columns[1], columns[2], columns[3]), low, high, turns)

    def without(self, gone: int) -> _TimelineTable:
        """Return the table without its first `gone` pieces."""
        t, p, v, a = self.columns
        return _TimelineTable((t[gone:], p[gone:], v[gone:], a[gone:]), self.low[gone:], self.high[gone:], self.turns)
