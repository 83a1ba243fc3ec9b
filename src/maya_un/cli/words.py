"""Words for the modes of the robot and the states of jobs and steps, in each language."""

from __future__ import annotations

from dmc41x3.i18n import PHRASE, translate


def mode_word(mode: str, language: str) -> str:
    """Return a mode of the robot, the value of a `Mode`, as a word."""
    return translate(mode, language, PHRASE).replace("_", " ")


def state_word(state: str, language: str) -> str:
    """Return a state of a job or a step, the value of a `TaskState`, as a word."""
    return translate(state, language, "WrongState.state")
