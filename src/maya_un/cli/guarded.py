"""A program for the controller, with Maya's guard behind it."""

from __future__ import annotations

from dataclasses import replace

from dmc41x3.cli.program import read
from dmc41x3.language.program import split
from dmc41x3.language.source import ProgramSource
from maya_un.cli.configure import configuration
from maya_un.cli.settings import OutputSettings
from maya_un.controller.guard_program import merged


def guarded(file: str, settings: OutputSettings) -> ProgramSource:
    """Return the program in a file with Maya's guard behind it; raises `FileUnreadable` and `GuardBlocked`."""
    config = configuration(settings)
    letters = "".join(sorted(axis.letter for axis in (config.axes.a, config.axes.b, config.axes.c)))
    source = read(file)
    text = merged(source.text, config.safety.guard_time or type(config.safety)().guard_time, letters)
    return replace(source, lines=split(text))
