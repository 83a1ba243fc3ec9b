"""`maya migrate`: what to change in scripts of the original stack. An installed package brings the checks."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Protocol, cast

import typer

from dmc41x3.i18n import translate, translate_phrase
from maya_un.cli import output
from maya_un.cli.settings import OutputSettings, settings_of

if TYPE_CHECKING:
    from maya_un.errors import MayaError

GROUP = "maya_un.tools"
"""The group of entry points with tools that other packages add to `maya`."""


class MigrationFinding(Protocol):
    """A finding: a line (from 1), what stands there, the key and kind of its rule, and two sentences."""

    @property
    def line(self) -> int:
        """The line, from 1."""
        ...

    @property
    def found(self) -> str:
        """The text in that line."""
        ...

    @property
    def key(self) -> str:
        """The name of the rule."""
        ...

    @property
    def kind(self) -> str:
        """change, check or same."""
        ...

    def sentences(self, language: str) -> tuple[str, str]:
        """Return the reason, and what to write instead; both empty if it works as before."""
        ...


class Skipped(Protocol):
    """A file that was not read, and the reason."""

    @property
    def file(self) -> str:
        """The path of the file."""
        ...

    @property
    def reason(self) -> str:
        """The reason, a phrase."""
        ...


class CheckReport(Protocol):
    """The findings by file, the files that were not read, and the number of those that were."""

    @property
    def findings(self) -> Sequence[tuple[str, MigrationFinding]]:
        """The findings, each with the path of its file."""
        ...

    @property
    def unread(self) -> Sequence[Skipped]:
        """The files that were not read."""
        ...

    @property
    def files(self) -> int:
        """The number of files that were read."""
        ...

    @property
    def clean(self) -> bool:
        """Whether nothing is to be changed or checked, and every file was read."""
        ...


class Checker(Protocol):
    """A module that checks files."""

    def check(self, path: str) -> CheckReport:
        """Return what to change in a file or below a folder; raises `FileUnreadable`."""
        ...


def register(app: typer.Typer, how: dict[str, Any]) -> None:
    """Add the command to `app`; `how` contains the options of all commands."""
    app.command(**how)(migrate)


def migrate(
    context: typer.Context,
    path: Annotated[str, typer.Argument(metavar="FILE", help="a script, or a folder with scripts")],
) -> int:
    """Show what to change in scripts written for the original Maya (ROS Kinetic, Python 2).

    It reads Python 2 and 3, launch files, shell scripts, DMC programs, messages, package.xml and CMakeLists.txt, and
    changes and executes nothing. The exit code is 0 if there is nothing to change, else 1.

    Example: maya migrate ~/catkin_ws/src
    """
    settings = settings_of(context)
    report = _checker().check(path)
    return show(report, settings)


def _checker() -> Checker:
    from importlib.metadata import entry_points

    found = entry_points(group=GROUP)
    if "migrate" not in found.names:
        raise _missing()
    return cast("Checker", found["migrate"].load())


def _missing() -> MayaError:
    from maya_un.errors import EdgeNotInstalled

    return EdgeNotInstalled(edge="migrate")


def show(report: CheckReport, settings: OutputSettings) -> int:
    """Print a report, as text or JSON, and return the exit code."""
    output.answer(as_data(report, settings.language), as_text(report, settings.language), settings)
    return output.DONE if report.clean else output.FAILED


def as_data(report: CheckReport, language: str) -> dict[str, object]:
    """Return a report as data with stable keys."""
    return {
        "files": report.files,
        "findings": [_finding(file, one, language) for file, one in report.findings],
        "unread": [
            {"file": one.file, "reason": translate_phrase(one.reason, language)} for one in report.unread
        ],
    }  # fmt: skip


def _finding(file: str, one: MigrationFinding, language: str) -> Mapping[str, object]:
    why, instead = one.sentences(language)
    return {
        "file": file, "line": one.line, "kind": str(one.kind), "rule": one.key, "found": one.found, "why": why,
        "instead": instead,
    }  # fmt: skip


def as_text(report: CheckReport, language: str) -> str:
    """Return a report as text: a paragraph for each finding, the names that remain, and a summary."""
    lines: list[str] = []
    for file, one in report.findings:
        why, instead = one.sentences(language)
        if why:
            mark = f" ({translate('check', language)})" if str(one.kind) == "check" else ""
            lines += [f"{file}:{one.line}: {one.found}{mark}", f"    {why}", f"    {instead}"]
    for one in report.unread:
        reason = translate_phrase(one.reason, language)
        lines.append(translate("{file}: not read: {reason}", language, file=one.file, reason=reason))
    remaining = sorted({one.found for _, one in report.findings if not one.sentences(language)[0]})
    if remaining:
        lines.append(translate("Works as before: {names}.", language, names=", ".join(remaining)))
    return "\n".join([*lines, _summary(report, language)])


def _summary(report: CheckReport, language: str) -> str:
    kinds = Counter(str(one.kind) for _, one in report.findings)
    return translate(
        "{files} files read: {change} places to change, {check} to check, {unread} files not read.",
        language,
        files=report.files,
        change=kinds["change"],
        check=kinds["check"],
        unread=len(report.unread),
    )
