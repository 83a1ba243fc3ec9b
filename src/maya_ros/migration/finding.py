"""A finding, the rules that any reader of a file applies to names, and the present names by their declarations."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache

from dmc41x3.i18n import translate, translate_phrase
from maya_ros.graph import catalogue, events
from maya_ros.graph.table import TABLE, Kind, Row
from maya_ros.migration import original
from maya_ros.migration.original import LAUNCH, PACKAGES, PROGRAMS, REMAINS, RENAMED, Rule

LONGEST = 100
"""Longest text of a finding's place [characters]."""


@dataclass(frozen=True, slots=True)
class ScriptFinding:
    """A line of a file (from 1) to which a rule applies; `found` is what it holds, `details` complete the rule.

    Without a rule, `found` works unchanged.
    """

    line: int
    found: str
    rule: Rule | None = None
    details: Mapping[str, str] = field(default_factory=dict[str, str])

    @property
    def key(self) -> str:
        """The key of its rule."""
        return REMAINS if self.rule is None else self.rule.key

    @property
    def kind(self) -> original.Severity:
        """Its meaning."""
        return original.Severity.SAME if self.rule is None else self.rule.kind

    def sentences(self, language: str) -> tuple[str, str]:
        """Return why it was found, and what to write instead."""
        if self.rule is None:
            return "", ""
        details = dict(self.details)
        if "reason" in details:
            details["reason"] = translate_phrase(details["reason"], language)
        return (
            translate(self.rule.why, language, **details),
            translate(self.rule.instead, language, **details),
        )


def finding(line: int, found: str, rule: Rule, **details: str) -> ScriptFinding:
    """Return a finding; a long text is cut."""
    return ScriptFinding(line, shown(found), rule, details)


def shown(text: str) -> str:
    """Return a text on one line, cut to `LONGEST`, without control characters."""
    line = "".join(one if one.isprintable() else "\N{REPLACEMENT CHARACTER}" for one in " ".join(text.split()))
    return line if len(line) <= LONGEST else f"{line[: LONGEST - 1]}…"


def listed(names: Iterable[str]) -> str:
    """Return names in a row."""
    return ", ".join(names)


@cache
def rows() -> Mapping[str, Row]:
    """Return the rows of the graph by their names."""
    return {row.name: row for row in TABLE}


def row_of(name: str) -> Row | None:
    """Return the row of a name, with or without its slash."""
    return rows().get(f"/{name.removeprefix('/')}")


@cache
def words() -> Mapping[str, str]:
    """Return the words of events by the names of their constants."""
    return {word.upper(): word for word in events.words()}


@cache
def constants() -> Mapping[str, str]:
    """Return the keys of the configuration by the names of the manual's constants."""
    from maya_ros.ros1.constants import KEYS  # noqa: PLC0415 - the configuration imports slowly

    return KEYS


@cache
def commands() -> tuple[str, ...]:
    """Return the names of the primitives."""
    from maya_un.robot.primitives import PRIMITIVES  # noqa: PLC0415 - imports slowly

    return tuple(PRIMITIVES)


@cache
def types() -> Mapping[str, tuple[str, ...]]:
    """Return the types that a script names, of Maya's packages, with the types of their parts."""
    services = {name: catalogue.halves(name) for name in catalogue.services()}
    halves = {half for parts in services.values() for half in parts}
    actions = {row.type for row in TABLE if row.form is Kind.ACTION}
    suffixes = ("Action", "ActionGoal", "ActionResult", "ActionFeedback", "Goal", "Result", "Feedback")
    parts = {f"{action}{suffix}" for action in actions for suffix in suffixes}
    messages = set(catalogue.kinds()) - halves - parts
    whole: dict[str, tuple[str, ...]] = {
        **{name: (name,) for name in messages},
        **services,
        **{name: (f"{name}Goal", f"{name}Result", f"{name}Feedback") for name in actions},
    }
    return {name: whole[name] for name in sorted(whole) if name.partition("/")[0] in PACKAGES}


def fields(kind: str) -> tuple[str, ...]:
    """Return the fields of a message type, or of the first part of a service or action."""
    return tuple(one.name for one in catalogue.spec(types().get(kind, (kind,))[0]).fields)


def of_package(package: str, names: Iterable[str]) -> str:
    """Return those of the names that belong to a package, without its name, in a row."""
    found = [name.partition("/")[2] for name in names if name.startswith(f"{package}/")]
    return listed(found) or "-"


def of_name(line: int, name: str) -> Iterator[ScriptFinding]:
    """Yield what a name of a topic, service or action means."""
    full = f"/{name.removeprefix('/')}"
    if full in RENAMED:
        yield finding(line, name, original.NAME, old=full, new=RENAMED[full])
    elif name in rows():
        yield ScriptFinding(line, name)


def of_type(line: int, text: str) -> Iterator[ScriptFinding]:
    """Yield what a type like maya_robot/MayaPrimitive means."""
    package, _, name = text.partition("/")
    if package not in PACKAGES:
        return
    if not name_is_type(package, name):
        known = of_package(package, types())
        yield finding(line, text, original.TYPE_UNKNOWN, package=package, name=name, known=known)
    else:
        yield ScriptFinding(line, text)


def name_is_type(package: str, name: str) -> bool:
    """Return whether a package has a type, or a part of one, for example TaskGoal."""
    return f"{package}/{name}" in types() or f"{package}/{name}" in catalogue.kinds()


def of_launch(line: int, text: str, file: str, arguments: Iterable[str]) -> Iterator[ScriptFinding]:
    """Yield what a launch file ("package/name") and its arguments mean."""
    package, _, name = file.partition("/")
    if package not in PACKAGES:
        return
    if file not in LAUNCH:
        yield finding(line, text, original.LAUNCH_FILE, package=package, name=name, known=listed(LAUNCH))
        return
    wrong = [argument for argument in arguments if argument not in LAUNCH[file]]
    for argument in wrong:
        known = listed(sorted(LAUNCH[file]))
        yield finding(line, text, original.LAUNCH_ARGUMENT, file=file, name=argument, known=known)
    if not wrong:
        yield ScriptFinding(line, file)


def of_program(line: int, text: str, package: str, name: str) -> Iterator[ScriptFinding]:
    """Yield what a program of a package means."""
    if package not in PACKAGES:
        return
    if name not in PROGRAMS[package]:
        known = listed(sorted(PROGRAMS[package]))
        yield finding(line, text, original.PROGRAM, package=package, name=name, known=known)
    else:
        yield ScriptFinding(line, f"{package} {name}")


def of_package_name(line: int, name: str) -> Iterator[ScriptFinding]:
    """Yield a package that remains; others are the user's."""
    if name in PACKAGES:
        yield ScriptFinding(line, name)
