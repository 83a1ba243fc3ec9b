"""`maya doctor`: run every check and print its result at once."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Iterator
from pathlib import Path

from dmc41x3.address import REAL, SIM
from maya_un.cli import output
from maya_un.cli.addresses import target_address
from maya_un.cli.configure import configuration
from maya_un.cli.doctor import controller, service
from maya_un.cli.settings import OutputSettings
from maya_un.config import Config
from maya_un.errors import MayaError
from maya_un.http.doctor import host
from maya_un.http.doctor.finding import Finding, guarded, skipped
from maya_un.http.doctor.words import meaning, message, name, remedy
from maya_un.http.log import written_down
from maya_un.schema.diagnosis import Diagnosis, FindingOutcome
from maya_un.schema.encoding import to_data

_MARKS = {
    FindingOutcome.OK: ("ok", "32"),
    FindingOutcome.WARN: ("WARN", "33"),
    FindingOutcome.FAIL: ("FAIL", "31"),
    FindingOutcome.SKIPPED: ("–", "2"),
}


def doctor(address: str | None, settings: OutputSettings) -> int:
    """Run all checks and print the results; return 1 if one fails, else 0.

    The controller at `address` is checked over a separate handle, and only while no service runs here; without an
    address, it is the configured one, if a configuration exists. Raises `InvalidValue` for an invalid address.
    """
    config = _config(settings)
    target = address if address is not None else REAL if host.config_file(_named(settings)) else None
    place = None if target is None else target_address(target, config.controller.address)
    found: list[Finding] = []
    for finding in _all(place, config, settings):
        found.append(finding)
        if not settings.json:
            output.say(_line(finding, settings.language, coloured=sys.stdout.isatty()))
    if settings.json:
        output.emit(to_data(Diagnosis(tuple(message(finding, settings.language) for finding in found))))
    return output.FAILED if any(finding.outcome is FindingOutcome.FAIL for finding in found) else output.DONE


def _config(settings: OutputSettings) -> Config:
    """Return the current configuration, the manual's values if it is invalid; a separate check reports that."""
    try:
        return configuration(settings)
    except MayaError:
        return Config()


def _all(target: str | None, config: Config, settings: OutputSettings) -> Iterator[Finding]:
    running, trouble = service.found(settings.language)
    yield from trouble
    pid = 0 if running is None else running.running.pid
    looks = host.looks(_named(settings), config, settings.language, pid)
    served = None if running is None else running.running.config
    if served is not None:
        looks[0] = ("configuration", lambda: host.served_config(served, settings.language))
    looks.insert(1, ("controller", lambda: _controller(target, config, settings.language, asked=running is not None)))
    if running is not None:
        looks.insert(0, ("service", running.findings))
    yield from guarded(looks, written_down)


def _named(settings: OutputSettings) -> Path | None:
    return None if settings.config is None else Path(settings.config)


def _controller(target: str | None, config: Config, language: str, *, asked: bool) -> Iterator[Finding]:
    if asked:
        yield skipped("controller", "controller_asked")
    elif target is None:
        yield skipped("controller", "controller_unnamed")
    elif target == SIM:
        yield skipped("controller", "controller_twin")
    else:
        yield from asyncio.run(controller.findings(target, config, language))


def _line(finding: Finding, language: str, *, coloured: bool) -> str:
    mark, colour = _MARKS[finding.outcome]
    shown = f"{mark:<5}"
    head = f"\x1b[{colour}m{shown}\x1b[0m" if coloured else shown
    advice = remedy(finding, language)
    text = f"{head} {name(finding.check, language)}: {meaning(finding, language)}"
    return f"{text}\n      → {advice}" if advice else text
