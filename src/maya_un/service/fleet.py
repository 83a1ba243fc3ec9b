"""The robots of the broker to which this robot is connected, for displays; nothing here commands a robot."""

from __future__ import annotations

from maya_un.schema.fleet import FleetView


class FleetService:
    """The latest view of the fleet; without a program that watches a broker, the view says so."""

    def __init__(self) -> None:
        self._view = FleetView()
        self.changes = 0

    def view(self) -> FleetView:
        """Return the latest view."""
        return self._view

    def show(self, view: FleetView) -> None:
        """Replace the view, and count the change; one other thread may call this."""
        self._view = view
        self.changes += 1

    @property
    def watched(self) -> bool:
        """Whether a broker is watched."""
        return self._view.link not in {"none", "unsupported"}
