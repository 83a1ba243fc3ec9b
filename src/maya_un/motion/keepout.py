"""The proof that a path keeps clear of zones.

A clearance changes by no more than gripper, lines and anchors travel. So on a chord whose ends have the clearances
c₀ and c₁, and on which nothing travels further than L, it is nowhere less than (c₀ + c₁ − L)/2. Chords on which this
does not suffice are halved.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from maya_un.kinematics.mechanism import Floats, Mechanism
from maya_un.kinematics.workspace import Workspace
from maya_un.kinematics.zones import Zone, clearances, travel_bounds

_SMALLEST = 1e-5
"""A piece of a chord on which nothing travels further than this [m] and that is in doubt counts as too near."""

_LARGEST = 0.05
_MOST = 64
"""Chords on which things travel further [m] are looked at in so long parts from the start, at most so many."""


class ChordPlace(NamedTuple):
    """A place on a path: `share` (0 to 1) of the chord with this number."""

    chord: int
    share: float


class ZoneEntry(NamedTuple):
    """A place at which a path comes too near to a zone."""

    zone: Zone
    place: ChordPlace


def first_entry(workspace: Workspace, joints: Floats) -> ZoneEntry | None:
    """Return a place where the chords between knots (n, 3) come too near to a zone, None where that is excluded.

    It is kept to the size of an encoder count (`Workspace.zone_grain`). On the chords the lines must not be straight.
    """
    travelled = travel_bounds(workspace.mechanism, joints[:-1], joints[1:])
    if travelled.max() <= _LARGEST:
        return _first_entry(workspace, joints, travelled)
    parts = np.clip(np.ceil(travelled / _LARGEST), 1, _MOST).astype(np.intp)
    chords = np.repeat(np.arange(len(parts)), parts)
    shares = (np.arange(len(chords)) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[chords]
    finer = joints[chords] + shares[:, np.newaxis] * (joints[chords + 1] - joints[chords])
    finer = np.concatenate((finer, joints[-1:]))
    entry = _first_entry(workspace, finer, travel_bounds(workspace.mechanism, finer[:-1], finer[1:]))
    if entry is None:
        return None
    part, share = entry.place
    return ZoneEntry(entry.zone, ChordPlace(int(chords[part]), float(shares[part] + share / parts[chords[part]])))


def _first_entry(workspace: Workspace, joints: Floats, travelled: Floats) -> ZoneEntry | None:
    bound = -workspace.zone_grain
    clear = clearances(workspace.zones, workspace.mechanism, joints)
    doubtful = clear[:-1] + clear[1:] - travelled[:, np.newaxis] < 2.0 * bound
    for number in np.flatnonzero(doubtful.any(axis=0)).tolist():
        zone, chords = workspace.zones[number], np.flatnonzero(doubtful[:, number])
        place = _search(_Chords(workspace.mechanism, zone, joints), clear[:, number], chords, bound)
        if place is not None:
            return ZoneEntry(zone, place)
    return None


class _Chords(NamedTuple):
    """The chords between knots (n, 3), for one zone."""

    mechanism: Mechanism
    zone: Zone
    joints: Floats

    def at(self, chords: NDArray[np.intp], shares: Floats) -> Floats:
        """Return the joints (m, 3) at shares (m,) of chords (m,)."""
        starts = self.joints[chords]
        return starts + shares[:, np.newaxis] * (self.joints[chords + 1] - starts)

    def clear(self, chords: NDArray[np.intp], shares: Floats) -> Floats:
        """Return the clearances (m,) there [m]."""
        return self.zone.clearances(self.mechanism, self.at(chords, shares))

    def travelled(self, chords: NDArray[np.intp], begins: Floats, width: float) -> Floats:
        """Return bounds (m,) of what anything travels on pieces that begin at `begins` and are `width` wide [m]."""
        return travel_bounds(self.mechanism, self.at(chords, begins), self.at(chords, begins + width))


def _search(every: _Chords, clear: Floats, chords: NDArray[np.intp], bound: float) -> ChordPlace | None:
    """Return a place on `chords` where the clearance is below `bound`; `clear` (n,) is that of the knots.

    All pieces are as wide in a round, and halved for the next one.
    """
    begins, width = np.zeros(len(chords)), 1.0
    first, last = clear[chords], clear[chords + 1]
    while True:
        below = np.flatnonzero((first < bound) | (last < bound))
        if len(below):
            piece = int(below[0])
            return ChordPlace(int(chords[piece]), float(begins[piece] + (width if last[piece] < first[piece] else 0.0)))
        travelled = every.travelled(chords, begins, width)
        doubtful = first + last - travelled < 2.0 * bound
        chords, begins, travelled = chords[doubtful], begins[doubtful], travelled[doubtful]
        if not len(chords):
            return None
        width *= 0.5
        small = np.flatnonzero(travelled < _SMALLEST)
        if len(small):
            return ChordPlace(int(chords[small[0]]), float(begins[small[0]] + width))
        middle = every.clear(chords, begins + width)
        first, last = np.concatenate((first[doubtful], middle)), np.concatenate((middle, last[doubtful]))
        chords, begins = np.concatenate((chords, chords)), np.concatenate((begins, begins + width))
