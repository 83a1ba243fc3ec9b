"""Words for the modes of the robot, in each language."""

from __future__ import annotations

from dmc41x3.i18n import PHRASE, translate


def mode_word(mode: str, language: str) -> str:
    """Return a mode of the robot, the value of a `Mode`, as a word."""
    return translate(mode, language, PHRASE).replace("_", " ")
