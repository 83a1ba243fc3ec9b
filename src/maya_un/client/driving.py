"""The control lease as a client holds it: shown with every request, and missed aloud once it is lost."""

from __future__ import annotations

from maya_un.errors import LeaseLost


class HeldLease:
    """The lease that a client shows, "" while it holds none."""

    def __init__(self) -> None:
        self.id = ""
        self._lost: LeaseLost | None = None

    @property
    def missed(self) -> bool:
        """Whether it was lost and nobody has been told yet."""
        return self._lost is not None

    def begin(self, lease: str) -> None:
        """Show `lease` from now on."""
        self.id = lease
        self._lost = None

    def end(self) -> None:
        """Show none any more."""
        self.id = ""
        self._lost = None

    def lose(self, error: LeaseLost) -> None:
        """Note that it is lost; it is shown until the end, so that nothing is done in another's name."""
        if self.id:
            self._lost = error

    def require(self) -> None:
        """Raise `LeaseLost`, once, where it was lost."""
        lost, self._lost = self._lost, None
        if lost is not None:
            raise lost
