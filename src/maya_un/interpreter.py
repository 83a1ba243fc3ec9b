"""Settings of the Python interpreter for a process with an event loop that must not wait; imports nothing heavy."""

from __future__ import annotations

import gc
import sys

TURN = 0.001
"""Longest wait of a loop for the interpreter's lock while another thread runs Python [s]."""


def quiet_collector() -> None:
    """Switch the garbage collection on, and reduce it, because it blocks the event loop.

    A full collection walks all objects: 50 to 100 ms in a service, in which a stop would wait. One of the younger
    objects walks at most 7 500 of them, which takes 2 ms.
    """
    gc.set_threshold(1_500, 4, 60_000)
    gc.enable()


def prompt_loop() -> None:
    """Prevent garbage collection and other threads from blocking the loop of this process for long."""
    quiet_collector()
    sys.setswitchinterval(TURN)
