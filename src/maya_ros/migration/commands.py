"""Reads line by line: commands of a shell, DMC programs, definitions of messages, and CMake."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Iterator, Sequence

import yaml

from dmc41x3.language.codes import ERROR_TEXTS
from dmc41x3.language.commands import InvalidCommand, parse, split_line
from maya_ros.graph import catalogue, types
from maya_ros.graph.table import Kind
from maya_ros.migration import finding as present
from maya_ros.migration import original
from maya_ros.migration.finding import ScriptFinding, finding, listed
from maya_ros.migration.original import PACKAGES, Rule
from maya_un.errors import InvalidMessage

LONGEST_LINE = 10_000
"""Longer lines are no commands of a person [characters]."""

_STARTS = re.compile(r"\s*(?:\$\s+)?(?:sudo\s+|exec\s+)?(?:ros(?:launch|run|topic|service|cd)|rqt)\s")

_PATTERNS: tuple[tuple[re.Pattern[str], Rule], ...] = (
    (re.compile(r"\bros-kinetic-|\bpython-ros\w+"), original.APT),
    (re.compile(r"/opt/ros/kinetic/\w*setup\.\w+"), original.SETUP),
    (re.compile(r"git\s+clone\b.*Maya-ROS-UN"), original.CLONE),
    (re.compile(r"\b(?:roscd|cd|clone)\s.*\bros-coms\b|\b(?:PORT|IP|NAME)=\S+\s+(?:yarn|npm run)\s+start\b"),
     original.COMS),
    (re.compile(r"^\W*(?:\w+\s.*)?\b(?:galilsuite|galiltools|galil_public_key|gclib_\w+\.(?:deb|rpm))|install\s.*\bgclib\b"),
     original.GALILSUITE),
)  # fmt: skip
_NODE_START = re.compile(r"^[-*\s]*(?:\$\s+)?(?:yarn(?:\s+(?:install|start))?|npm\s+(?:install|run\s+start)|tsc)\s*$")
_PYTHON = re.compile(r"^\s*(?:\$\s+)?(?:exec\s+)?(?:/usr/bin/(?:env\s+)?)?(python(?:2(?:\.\d)?)?)\s+\S")
_ARGUMENT = re.compile(r"(-*)(\w+):=")


def starts_ros(text: str) -> bool:
    """Return whether a text begins with a command of ROS."""
    return _STARTS.match(text) is not None


def read_shell(text: str) -> Iterator[ScriptFinding]:
    """Yield the findings in a shell script, or in the commands of a page."""
    has_coms = "ros-coms" in text
    for line, command in _joined(text):
        yield from of_command(line, command)
        if has_coms and _NODE_START.match(command):
            yield finding(line, command, original.COMS)


def read_page(text: str) -> Iterator[ScriptFinding]:
    """Yield the findings in the commands of a page: in fenced blocks, and behind a dollar sign."""
    kept: list[str] = []
    fenced = False
    for line in text.splitlines():
        if line.lstrip().startswith("```"):
            fenced = not fenced
        kept.append(line if fenced or line.lstrip("-* \t").startswith("$ ") else "")
    yield from read_shell("\n".join(kept))


def _joined(text: str) -> Iterator[tuple[int, str]]:
    """Yield each command with its first line; a backslash continues a line. Comments are left out."""
    held, start = "", 0
    for number, line in enumerate(text.splitlines(), start=1):
        start = start if held else number
        held += line[:LONGEST_LINE]
        if held.endswith("\\") and len(held) < LONGEST_LINE:
            held = held[:-1] + " "
            continue
        if not held.lstrip().startswith("#"):
            yield start, held
        held = ""
    if held:
        yield start, held


def of_command(line: int, command: str) -> Iterator[ScriptFinding]:
    """Yield the findings in one command line."""
    for pattern, rule in _PATTERNS:
        if pattern.search(command):
            yield finding(line, command, rule)
    if named := _PYTHON.match(command):
        yield finding(line, command, original.PYTHON_COMMAND, name=named[1])
    for part in re.split(r"&&|\|\||;(?=\s)|(?<!\|)\|(?!\|)", command) if starts_ros_anywhere(command) else ():
        yield from _ros(line, part.strip().removeprefix("$").strip().removesuffix("&"))


def starts_ros_anywhere(command: str) -> bool:
    """Return whether a command line may hold a command of ROS."""
    return "ros" in command


def _ros(line: int, command: str) -> Iterator[ScriptFinding]:
    try:
        words = shlex.split(command, comments=True)
    except ValueError:
        words = [word.strip("\"'") for word in command.split()]  # a part of a text in quotes
    while words and (words[0] in {"sudo", "exec", "nohup", "time"} or re.fullmatch(r"\w+=\S*", words[0])):
        words = words[1:]
    reader = _READERS.get(words[0]) if words else None
    if reader is not None:
        yield from reader(line, command, words[1:])


def _roslaunch(line: int, command: str, words: Sequence[str]) -> Iterator[ScriptFinding]:
    arguments = [found for found in map(_ARGUMENT.match, words) if found]
    plain = [word for word in words if not word.startswith("-") and ":=" not in word]
    if len(plain) < 2 or plain[0] not in PACKAGES:
        return
    dashed = [word for word in words if word.startswith("-") and ":=" in word]
    for word in dashed:
        yield finding(line, command, original.LAUNCH_DASHES, new=word.lstrip("-"))
    yield from present.of_launch(line, command, f"{plain[0]}/{plain[1]}", [found[2] for found in arguments])


def _rosrun(line: int, command: str, words: Sequence[str]) -> Iterator[ScriptFinding]:
    if len(words) >= 2:
        yield from present.of_program(line, command, words[0], words[1])


def _rostopic(line: int, command: str, words: Sequence[str]) -> Iterator[ScriptFinding]:
    plain = [word for word in words if not re.fullmatch(r"-\w+|--\w+|-?\d+(?:\.\d+)?", word)]
    if len(plain) < 2:
        return
    yield from present.of_name(line, plain[1])
    row = present.row_of(plain[1])
    if plain[0] != "pub" or row is None or row.form is not Kind.TOPIC or len(plain) < 3:
        return
    if plain[2] != row.type:
        yield finding(line, command, original.TYPE, name=row.name, expected=row.type, given=plain[2])
    elif len(plain) == 4:
        yield from _message(line, command, row.name, row.type, plain[3])


def _rosservice(line: int, command: str, words: Sequence[str]) -> Iterator[ScriptFinding]:
    if len(words) < 2:
        return
    yield from present.of_name(line, words[1])
    row = present.row_of(words[1])
    if words[0] == "call" and row is not None and row.form is Kind.SERVICE and len(words) == 3:
        yield from _message(line, command, row.name, f"{row.type}Request", words[2])


def _message(line: int, command: str, name: str, kind: str, text: str) -> Iterator[ScriptFinding]:
    """Yield a finding for a message, written as YAML, that does not fit its type."""
    try:
        data = yaml.safe_load(text)
    except (yaml.YAMLError, RecursionError, ValueError):
        return
    own = [one.name for one in catalogue.spec(kind).fields]
    if not isinstance(data, dict):
        data = {} if data is None else dict(zip(own, data if isinstance(data, list) else [data], strict=False))
    try:
        types.conform(kind, data)
    except InvalidMessage as error:
        yield finding(line, command, original.MESSAGE, name=name, reason=str(error), known=listed(own))


_READERS: dict[str, Callable[[int, str, Sequence[str]], Iterator[ScriptFinding]]] = {
    "roslaunch": _roslaunch,
    "rosrun": _rosrun,
    "rostopic": _rostopic,
    "rosservice": _rosservice,
}


_LIMIT = re.compile(r"_L[FR][A-HW-Z]\b")
_REMARK = re.compile(r"^\s*(?:REM\b|'|NO\b)")
_DMC_RULES: dict[str, Rule] = {
    "CB": original.GRIPPER, "SB": original.GRIPPER, "MO": original.MOTORS_OFF, "AB": original.ABORT,
    "PA": original.MOTION, "PR": original.MOTION, "JG": original.MOTION,
}  # fmt: skip
_DYNAMICS = {"SP": "speed_counts", "AC": "acceleration_counts", "DC": "deceleration_counts"}
_ACTIVE = re.compile(r"(-?1)\b")


def read_dmc(text: str) -> Iterator[ScriptFinding]:
    """Yield the findings in a DMC program: one for each rule, at its first line."""
    said: set[tuple[str, str]] = set()
    for number, line in enumerate(text.splitlines(), start=1):
        if _REMARK.match(line) or len(line) > LONGEST_LINE:
            continue
        for one in of_dmc(number, line):
            key = (one.key, one.found if one.rule is original.DMC else "")
            if key not in said:
                said.add(key)
                yield one


def of_dmc(line: int, text: str, *, complete: bool = True) -> Iterator[ScriptFinding]:
    """Yield the findings in a line of DMC commands; one that a program completes later is not checked as a whole."""
    for command in split_line(text):
        if limit := _LIMIT.search(command):
            yield finding(line, command, original.SWITCH, name=limit[0])
        name = command[:2]
        if command.startswith("#") or not command or limit:
            continue
        try:
            parse(command)
        except InvalidCommand as error:
            if complete:
                reason = ERROR_TEXTS[error.code]
                yield finding(line, command, original.DMC, text=f"`{present.shown(command)}`", reason=reason)
            continue
        if name == "CN" and (level := _ACTIVE.search(command[2:])):
            yield finding(line, command, original.WIRING, level=level[1])
        elif name in _DYNAMICS and "?" not in command:
            yield finding(line, command, original.DYNAMICS, name=name, key=_DYNAMICS[name])
        elif name in _DMC_RULES and "?" not in command and not re.match(r"\w{3,}\s*=", command.replace(name, "", 1)):
            yield finding(line, command, _DMC_RULES[name])


_TYPE = re.compile(r"\b(maya_[a-z]+)/(?:msg/|srv/|action/)?([A-Z]\w*)")


def read_definition(text: str, name: str) -> Iterator[ScriptFinding]:
    """Yield the findings in a .msg, .srv or .action file whose name without its ending is `name`."""
    for number, line in enumerate(text.splitlines(), start=1):
        for found in _TYPE.finditer(line.partition("#")[0][:LONGEST_LINE]):
            yield from present.of_type(number, f"{found[1]}/{found[2]}")
    ours = next((kind for kind in present.types() if kind.partition("/")[2] == name), None)
    if ours is not None and _bare(text) != _bare(_definition(ours)):
        package = ours.partition("/")[0]
        yield finding(
            1, name, original.DEFINITION, type=ours, package=package, known=listed(present.fields(ours))
        )  # fmt: skip


def _definition(kind: str) -> str:
    """Return the definition of a message, service or action of Maya."""
    parts = [catalogue.spec(part) for part in present.types()[kind]]
    texts = [
        "".join(f"{one.type} {one.name}={one.value}\n" for one in spec.constants)
        + "".join(f"{one.written} {one.name}\n" for one in spec.fields)
        for spec in parts
    ]
    return "---\n".join(texts)


def _bare(text: str) -> list[str]:
    """Return the fields of a definition, without comments, blanks and packages; constants are sorted first."""
    found: list[str] = []
    for part in catalogue.parts(text):
        lines = [re.sub(r"\s*=\s*", "=", line.partition("#")[0]).split() for line in part.splitlines()]
        fields = [" ".join([words[0].rpartition("/")[2], *words[1:]]) for words in lines if words]
        found += [*sorted(one for one in fields if "=" in one), *(one for one in fields if "=" not in one), "---"]
    return found


_REQUIRED = re.compile(r"\bmaya_(?:controller|robot|process|ui)\b")


def read_cmake(text: str) -> Iterator[ScriptFinding]:
    """Yield the packages of Maya that a CMakeLists.txt needs."""
    for number, line in enumerate(text.splitlines(), start=1):
        for package in _REQUIRED.findall(line.partition("#")[0][:LONGEST_LINE]):
            yield ScriptFinding(number, package)
