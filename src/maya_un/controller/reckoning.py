"""Expected positions of the axes from this program's commands: any other change is foreign.

The reference of an axis (Galil DMC-41x3, command RP) changes by motion, by DP, and by SH, which sets it to the position
of the axis. So at rest it does not change, and in motion it stays on the path.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dmc41x3.language.record import DataRecord
from maya_un.config import Config, Units
from maya_un.controller import faults
from maya_un.errors import ForeignMotion, MachineError, PositionChanged
from maya_un.kinematics.mechanism import Floats
from maya_un.values import AXES

SETTLED = 20
"""Greatest distance of an axis at rest from its reference [counts]; SH changes the reference by no more."""

_ON_PATH = 16
"""In motion, the reference is within this share of the error limit (ER) of its path."""

_PUSHED = 4
"""An axis that is farther than this share of the error limit (ER) from its reference at rest was pushed."""

Counts = Sequence[float]


class PositionReckoner:
    """Known positions of Maya's axes at rest."""

    def __init__(self, config: Config, order: faults.Order) -> None:
        self._config = config
        self._units = Units.of(config)
        self._order = order
        self._last: DataRecord | None = None

    def forget(self) -> None:
        """Forget the positions, as during a motion of ours."""
        self._last = None

    def compare(self, record: DataRecord) -> MachineError | None:
        """Store a record of axes at rest; return the error for a foreign change, None without one.

        If an axis moves, another program began the motion, unless no record was stored before.
        """
        last = self._last
        if last is None:
            self._last = None if any(record.axes[place].moving for place in self._order) else record
            return None
        found = self._foreign(record) or self._changed(last, record) or self._pushed(record)
        self._last = record if found is None else None
        return found

    def _foreign(self, record: DataRecord) -> ForeignMotion | None:
        return next(
            (ForeignMotion(axis=AXES[i]) for i, place in enumerate(self._order) if record.axes[place].moving), None
        )

    def _changed(self, last: DataRecord, record: DataRecord) -> PositionChanged | None:
        for i, place in enumerate(self._order):
            before, now = last.axes[place], record.axes[place]
            if now.reference == before.reference:
                continue
            taken = abs(now.reference - before.position) <= SETTLED and abs(now.position - before.position) <= SETTLED
            if not taken:
                return self.changed(i, now.reference - before.reference)
        return None

    def _pushed(self, record: DataRecord) -> PositionChanged | None:
        for i, place in enumerate(self._order):
            axis = record.axes[place]
            away = axis.position - axis.reference
            if not axis.motor_off and abs(away) > self._config.axes[i].error_limit_counts // _PUSHED:
                return self.changed(i, away)
        return None

    def changed(self, axis: int, counts: float) -> PositionChanged:
        """Return the error for an axis (0 to 2) that is `counts` away from where it should be."""
        return PositionChanged(axis=AXES[axis], distance=self.shown(axis, counts))

    def shown(self, axis: int, counts: float) -> str:
        """Return a distance in counts of an axis (0 to 2) as text."""
        way = abs(counts) / self._units.per_unit[axis]
        return f"{way * 57.29577951308232:.2f} deg" if axis == 0 else f"{way * 1000.0:.2f} mm"

    def astray(self, places: Floats, here: Counts) -> PositionChanged | None:
        """Return the error for a reference `here` that is not on the path through `places` (n, 3) [counts]."""
        away = _off(places, np.asarray(here, dtype=np.float64))
        for i, counts in enumerate(away.tolist()):
            if abs(counts) > max(SETTLED, self._config.axes[i].error_limit_counts // _ON_PATH):
                return self.changed(i, counts)
        return None


def _off(places: Floats, here: Floats) -> Floats:
    """Return how far `here` lies from the nearest point of the chords through `places`, by axis."""
    starts, ways = places[:-1], np.diff(places, axis=0)
    lengths = np.einsum("ij,ij->i", ways, ways)
    shares = np.einsum("ij,ij->i", here - starts, ways) / np.where(lengths > 0.0, lengths, 1.0)
    away = here - (starts + np.clip(shares, 0.0, 1.0)[:, np.newaxis] * ways)
    nearest = int(np.einsum("ij,ij->i", away, away).argmin())
    return away[nearest]
