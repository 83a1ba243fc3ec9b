"""Facts that hold for every DMC-41x3."""

from __future__ import annotations

LETTERS = "ABCDEFGH"
"""Letters of the axes, of which a controller has the first ones, and of its eight Ethernet handles."""

ALIASES = str.maketrans("XYZW", "ABCD")
"""The first four axes have second names, for `str.translate`."""

SAMPLES = 1024
"""Samples of the servo in a second at TM 1000."""

SHORTEST_PERIOD, LONGEST_PERIOD = 8, 30000
"""Range of the period of DR [samples]; it is even."""
