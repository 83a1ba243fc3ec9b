"""The results of a commissioning: kept in a file, so that an interrupted one continues, and shown as a report."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

from dmc41x3.files import unreadable
from dmc41x3.i18n import marked, translate, translate_phrase
from maya_un.config import Config
from maya_un.config.files import parse, replace
from maya_un.config.settings import nested
from maya_un.errors import InvalidConfig

FILE = "commissioning.json"
"""Name of the file in the state folder."""


class CheckState(StrEnum):
    """How a step ended."""

    PASSED = "passed"
    CORRECTED = "corrected"
    FAILED = "failed"
    SKIPPED = "skipped"
    LEFT_TO_PERSON = "left_to_person"
    BLOCKED = "blocked"
    INTERRUPTED = "interrupted"

    @property
    def done(self) -> bool:
        """Whether the step need not be repeated."""
        return self in {CheckState.PASSED, CheckState.CORRECTED, CheckState.LEFT_TO_PERSON}


@dataclass(slots=True)
class CheckResult:
    """The result of a step: mistakes as (code, English sentence), and readings by name."""

    state: CheckState = CheckState.INTERRUPTED
    errors: list[tuple[int, str]] = field(default_factory=list[tuple[int, str]])
    readings: dict[str, Any] = field(default_factory=dict[str, Any])


@dataclass(slots=True)
class CommissioningProgress:
    """The results so far of the commissioning of the controller at `address`.

    `changes` are the corrected settings by their dotted names. Results are stored at every change if there is a `path`.
    `damaged`: stored results could not be used.
    """

    address: str
    path: Path | None = None
    results: dict[str, CheckResult] = field(default_factory=dict[str, CheckResult])
    changes: dict[str, Any] = field(default_factory=dict[str, Any])
    damaged: bool = False

    @classmethod
    def stored(cls, path: Path, address: str, config: Config) -> CommissioningProgress:
        """Return the stored results, empty if there are none of this controller.

        If the file is damaged, or its changes do not fit the present `config`, the results are empty too, and
        `damaged`. Raises `FileUnreadable`.
        """
        found = cls(address, path)
        try:
            value = json.loads(path.read_text(encoding="utf-8"))
            json.dumps(value, ensure_ascii=False).encode()  # half a pair of surrogates cannot be shown
            if value["address"] == address:
                found.changes = dict(value["changes"])
                found.results = {key: _result(one) for key, one in value["steps"].items()}
                parse(nested(found.changes), config)
        except FileNotFoundError:
            return found
        except OSError as error:
            raise unreadable(path, error) from error
        except (*_DAMAGE, InvalidConfig):
            return cls(address, path, damaged=True)
        return found

    @property
    def kept(self) -> bool:
        """Whether the results are stored, so that a later program continues."""
        return self.path is not None

    @property
    def has_mistakes(self) -> bool:
        """Whether a step has found a mistake that a person must remove."""
        return any(one.state is CheckState.FAILED for one in self.results.values())

    def done(self, key: str) -> bool:
        """Return whether a step need not be repeated."""
        return key in self.results and self.results[key].state.done

    def save(self) -> None:
        """Store the results; raises `FileUnwritable`."""
        if self.path is not None:
            replace(self.path, json.dumps(self.data(), indent=1) + "\n")

    def data(self) -> dict[str, Any]:
        """Return the results as JSON data."""
        steps = {
            key: {
                "state": str(one.state),
                "errors": [{"code": code, "message": text} for code, text in one.errors],
                "readings": one.readings,
            }
            for key, one in self.results.items()
        }
        return {"address": self.address, "steps": steps, "changes": self.changes}


_DAMAGE = (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError)
"""Errors of reading a file that no commissioning has written."""


def _result(value: Mapping[str, Any]) -> CheckResult:
    errors = [(int(error["code"]), str(error["message"])) for error in value["errors"]]
    return CheckResult(CheckState(value["state"]), errors, dict(value["readings"]))


_STATES: Mapping[CheckState, str] = {
    CheckState.PASSED: marked("passed"),
    CheckState.CORRECTED: marked("passed after a correction of the configuration"),
    CheckState.FAILED: marked("failed"),
    CheckState.SKIPPED: marked("skipped"),
    CheckState.LEFT_TO_PERSON: marked("skipped: a person gives the datum"),
    CheckState.BLOCKED: marked("waits for other steps"),
    CheckState.INTERRUPTED: marked("interrupted"),
}


def state_text(state: CheckState, language: str) -> str:
    """Return a state in words."""
    return translate(_STATES[state], language)


def report(
    progress: CommissioningProgress, titles: Mapping[str, str], differences: Iterable[tuple[str, Any, Any]], lang: str
) -> str:
    """Return the report as Markdown; `differences` are settings with their present and their new value."""
    lines = [
        f"# {translate('Commissioning of {address}', lang, address=progress.address)}",
        "",
        f"| {translate('step', lang)} | {translate('result', lang)} | {translate('readings', lang)} |",
        "|---|---|---|",
    ]
    for key, title in titles.items():
        result = progress.results.get(key)
        if result is None:
            lines.append(f"| {title} | {translate('not begun', lang)} | |")
            continue
        readings = ", ".join(f"{name} {value}" for name, value in result.readings.items())
        lines.append(f"| {title} | {state_text(result.state, lang)} | {readings} |")
    errors = [(titles.get(key, key), one) for key, result in progress.results.items() for one in result.errors]
    if errors:
        lines += ["", f"## {translate('Mistakes', lang)}", ""]
        lines += [f"- {title}: {code} {translate_phrase(text, lang)}" for title, (code, text) in errors]
    changes = list(differences)
    if changes:
        lines += ["", f"## {translate('Changes of the configuration', lang)}", ""]
        lines += [f"- `{name}`: {json.dumps(old)} → {json.dumps(new)}" for name, old, new in changes]
    return "\n".join(lines) + "\n"
