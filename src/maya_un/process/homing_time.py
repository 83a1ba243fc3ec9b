"""How long a homing takes, which no plan tells: as long as the last one did, before that a bound."""

from __future__ import annotations

from maya_un.config import Config, Units
from maya_un.events import Event, EventLog, HomingBegun, HomingDone

_STROKES = 2.0
"""So often each line passes its stroke, the ways between the switches and the slow approaches included."""


class HomingTime:
    """Watches homings; `seconds` is what the next one will about take [s], at any speed override."""

    def __init__(self, config: Config, events: EventLog) -> None:
        self.seconds = _bound(config)
        self._began: float | None = None
        events.heard_by(self._hear)

    def _hear(self, event: Event) -> None:
        if isinstance(event, HomingBegun):
            self._began = event.time
        elif isinstance(event, HomingDone) and self._began is not None:
            self.seconds = event.time - self._began
            self._began = None


def _bound(config: Config) -> float:
    a, b, c = config.axes.a, config.axes.b, config.axes.c
    lines = (b.maximum - b.minimum) + (c.maximum - c.minimum)
    turn = (a.maximum - a.minimum) * Units.of(config).per_unit[0] / a.speed_counts
    return _STROKES * lines / config.homing.speed + turn
