"""The mechanics' record as lines of JSON, written while the machine runs, for other processes.

| kind | when | keys beside `kind` and `time` |
|---|---|---|
| `start` | once, at power-up of the body | `format`, `epoch`, `truth`, `joints`, `point`, `parts` |
| `motion` | at most 50 ms after an axis moved or pushed | `since`, extremes, `stalled`, `outside`, state, `total` |
| `contact` | an axis meets an obstacle, or the last one is free | `axes`: those that are held back now, and state |
| `grip` | the gripper takes a part | `part`, and state |
| `release` | the gripper releases a part | `part`, `place`, and state |
| `drop` | a part fell more than 5 mm | `part`, `height`, `place`, and state |

Times are seconds of the body since power-up; `epoch` is the date of time 0 as seconds since 1970. Lengths are metres,
angles radians, tensions multiples of the load, and triples are in the order a, b, c. The extremes of `motion` are those
of the time from `since` to `time`; `total` holds those since power-up. State is `joints`, `point`, `closed`, `carried`.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

from maya_un.machine.log import PartDrop, Place, Window
from maya_un.machine.mechanics import SAMPLE, MayaMechanics

FORMAT = 1
"""Version of the lines."""

_AXES = "abc"


class MechanicsRecordWriter:
    """Writes the record of `mechanics` by `write`, a line at a time; `epoch` is the date of the body's time 0 [s].

    Events are written at once, motion at most every 50 ms of the body's time; `look` writes the pending motion.
    """

    def __init__(self, mechanics: MayaMechanics, write: Callable[[str], None], epoch: float) -> None:
        self._mechanics = mechanics
        self._write = write
        self._written = mechanics.now
        self._pending: Window | None = None
        self._last = (mechanics.true_joints(), mechanics.tension())
        parts = {name: list(place) for name, place in mechanics.parts.items()}
        truth = asdict(mechanics.truth)
        start = {"joints": mechanics.true_joints(), "point": mechanics.gripper_point(), "parts": parts}
        self._line("start", format=FORMAT, epoch=epoch, truth=truth, **start)
        mechanics.listen(self)

    def look(self) -> None:
        """Write everything up to the present time of the mechanics."""
        self._mechanics.settle()
        self._flush()

    def added(self, window: Window) -> None:
        """Add the window of a further span of time."""
        self._pending = window if self._pending is None else self._pending.then(window)
        if self._mechanics.now - self._written >= SAMPLE:
            self._flush()

    def held(self, axes: tuple[bool, ...]) -> None:
        """Write which axes an obstacle holds back from now on."""
        self._flush()
        self._event("contact", axes=[name for name, held in zip(_AXES, axes, strict=True) if held])

    def gripped(self, name: str) -> None:
        """Write that the gripper took a part."""
        self.look()
        self._event("grip", part=name)

    def released(self, name: str, place: Place, drop: PartDrop | None) -> None:
        """Write that the gripper released a part, and whether the part fell."""
        self.look()
        self._event("release", part=name, place=place)
        if drop is not None:
            self._event("drop", part=name, height=drop.height, place=place)

    def _flush(self) -> None:
        window, self._pending = self._pending, None
        since, self._written = self._written, self._mechanics.now
        if window is None or not self._is_news(window):
            return
        extremes = asdict(window)
        del extremes["since"], extremes["start_height"], extremes["drops"]
        total = asdict(self._mechanics.written)
        fallen = len(total.pop("drops"))
        self._event("motion", since=since, **extremes, total={**total, "drops": fallen})

    def _is_news(self, window: Window) -> bool:
        before = self._last
        self._last = (self._mechanics.true_joints(), self._mechanics.tension())
        return self._last != before or window.low != window.high or any(window.stalled)

    def _event(self, kind: str, **values: Any) -> None:
        record = self._mechanics.record
        state = {
            "joints": self._mechanics.true_joints(),
            "point": self._mechanics.gripper_point(),
            "closed": record.gripper_closed,
            "carried": record.carried,
        }
        self._line(kind, **values, **state)

    def _line(self, kind: str, **values: Any) -> None:
        self._write(json.dumps({"kind": kind, "time": self._mechanics.now, **values}) + "\n")
