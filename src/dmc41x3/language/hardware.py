"""Facts that hold for every DMC-41x3."""

from __future__ import annotations

LETTERS = "ABCDEFGH"
"""Letters of the axes, of which a controller has the first few, and of its eight Ethernet handles."""

ALIASES = str.maketrans("XYZW", "ABCD")
"""Second names of the first four axes, for `str.translate`."""

SAMPLES = 1024
"""Servo samples in a second at TM 1000."""

SHORTEST_PERIOD, LONGEST_PERIOD = 8, 30000
"""Range of the period of DR [samples]; the period is even."""
