"""What befalls bytes between the controller and its hosts: delays, losses, doubles, nonsense, silence."""

from __future__ import annotations

from random import Random

from dmc41x3.twin.handles import Handle


class Disturbance:
    """The state of the wire; everything at rest is a good wire. Probabilities are per reply.

    `latency` and `jitter` [s] delay what the controller sends, `drop` loses it, `duplicate` sends it twice, `garbage`
    puts `noise` random bytes before it. `balk` is how probably a command is refused without being looked at.
    Handles in `silent` neither hear nor are heard. `refusing` is true while nobody may connect.
    """

    def __init__(self, seed: int = 0) -> None:
        self.random = Random(seed)
        self.latency = 0.0
        self.jitter = 0.0
        self.drop = 0.0
        self.duplicate = 0.0
        self.garbage = 0.0
        self.noise = 8
        self.balk = 0.0
        self.refusing = False
        self.silent: set[Handle] = set()

    @property
    def clear(self) -> bool:
        """Whether what the controller sends arrives as it is and at once."""
        return not (self.latency or self.jitter or self.drop or self.duplicate or self.garbage or self.silent)

    def delay(self) -> float:
        """Return how much later the next reply arrives [s]."""
        return self.latency + (self.random.uniform(0.0, self.jitter) if self.jitter else 0.0)

    def outgoing(self, data: bytes) -> list[bytes]:
        """Return what becomes of a reply: nothing, itself, itself twice, nonsense and itself."""
        if self.drop and self.random.random() < self.drop:
            return []
        pieces = [data]
        if self.duplicate and self.random.random() < self.duplicate:
            pieces.append(data)
        if self.garbage and self.random.random() < self.garbage:
            pieces.insert(0, self.random.randbytes(self.noise))
        return pieces

    def balks(self) -> bool:
        """Tell whether the next command is refused."""
        return self.balk > 0.0 and self.random.random() < self.balk
