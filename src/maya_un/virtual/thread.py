"""One of the eight threads of a program: where it is, and what it waits for."""

from __future__ import annotations

from dataclasses import dataclass, field

COUNT = 8
"""Threads 0 to 7."""

STACK_DEPTH = 16
"""How deep subroutines may nest."""


@dataclass(slots=True)
class Thread:
    """State of one thread; `running` until it ends. `line` is the line it executes."""

    number: int
    running: bool = False
    line: int = 0
    locals: dict[str, int] = field(default_factory=dict[str, int])
    """Stack variables `^a` to `^h` of the subroutine under way (raw fixed point)."""
