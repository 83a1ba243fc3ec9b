"""Words that events and reports contain, each with its text for people.

A word is data: programs compare it, and it does not change. Its text is shown, and translated by the catalogue.
"""

from __future__ import annotations

from collections.abc import Mapping

from dmc41x3.i18n import marked, translate, translate_phrase

WORD = "word"
"""The context of these texts in the catalogue."""

Vocabulary = Mapping[str, str]
"""English texts by their words."""

PHASES: Vocabulary = {
    "raise": marked("raise the gripper", "word"),
    "datum_a": marked("find the switch of axis a", "word"),
    "datum_b": marked("find the switch of line b", "word"),
    "datum_c": marked("find the switch of line c", "word"),
    "stroke_b": marked("measure the stroke of line b", "word"),
    "stroke_c": marked("measure the stroke of line c", "word"),
    "pose": marked("move to the homed pose", "word"),
    "home": marked("home", "word"),
    "open": marked("open the gripper", "word"),
    "close": marked("close the gripper", "word"),
    "approach": marked("approach the place", "word"),
    "down": marked("go down", "word"),
    "up": marked("go up", "word"),
    "line": marked("move on a straight path", "word"),
    "move": marked("move", "word"),
    "follow": marked("follow the path", "word"),
    "jog": marked("jog", "word"),
    "guarded move": marked("guarded move", "word"),
}
"""Phases of a homing and of primitives, and the motions of the controller."""

STATES: Vocabulary = {
    "queued": marked("queued", "word"),
    "held": marked("held", "word"),
    "running": marked("running", "word"),
    "paused": marked("paused", "word"),
    "interrupted": marked("interrupted", "word"),
    "done": marked("done", "word"),
    "failed": marked("failed", "word"),
    "cancelled": marked("cancelled", "word"),
    "skipped": marked("skipped", "word"),
}
"""States of jobs, of steps, and of the queue."""

LEVELS: Vocabulary = {"on": marked("on", "word"), "off": marked("off", "word")}
"""States of inputs and outputs."""

LEASE_CHANGES: Vocabulary = {
    "taken": marked("taken", "word"),
    "released": marked("released", "word"),
    "expired": marked("expired", "word"),
    "handed over": marked("handed over", "word"),
    "offered": marked("offered", "word"),
    "asked": marked("asked for", "word"),
    "broken": marked("taken away by an administrator", "word"),
}
"""Changes of the control lease."""

STORAGE_STATES: Vocabulary = {
    "failing": marked("it cannot be written", "word"),
    "working": marked("it can be written again", "word"),
}
"""States of the storage of the queue."""

RECORDING_REASONS: Vocabulary = {
    "asked": marked("on request", "word"),
    "disconnected": marked("connection lost", "word"),
    "limit": marked("limit switch", "word"),
    "fault": marked("fault", "word"),
    "estop": marked("emergency stop", "word"),
    "crash": marked("defect of the program", "word"),
}
"""Reasons for which a recording is saved."""


def worded(vocabulary: Vocabulary, word: str, language: str = "en") -> str:
    """Return the text of a word in `language`.

    A word that is not listed is translated if it is a phrase. One of a newer program stays as it is.
    """
    return translate(vocabulary[word], language, WORD) if word in vocabulary else translate_phrase(word, language)
