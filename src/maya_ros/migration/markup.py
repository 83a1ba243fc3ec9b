"""Reads XML: launch files and the manifests of packages."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import NamedTuple
from xml.parsers import expat

from maya_ros.migration import finding as present
from maya_ros.migration import original
from maya_ros.migration.finding import ScriptFinding, finding
from maya_ros.migration.original import PACKAGES

_INCLUDED = re.compile(r"\$\(find\s+(\w+)\)/(?:launch/)?([\w.-]+\.launch)")
_REPLACED = re.compile(r"\$\((?:arg|eval|optenv)\b")


class _Element(NamedTuple):
    line: int
    name: str
    attributes: Mapping[str, str]
    inside: tuple[str, int]


class _Reader:
    """Collects the elements of a document with their lines, and the text in them."""

    def __init__(self) -> None:
        self.elements: list[_Element] = []
        self.texts: list[tuple[int, str, str]] = []
        self._open: list[int] = []
        self._parser = expat.ParserCreate("utf-8")
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.CharacterDataHandler = self._text

    def read(self, text: str) -> str:
        """Read a document and return why it is not well-formed, "" if it is."""
        try:
            self._parser.Parse(text.encode(), True)
        except expat.ExpatError as error:
            return f"{expat.ErrorString(error.code)}, line {error.lineno}"
        return ""

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        parent = self._open[-1] if self._open else -1
        outer = self.elements[parent].name if parent >= 0 else ""
        self._open.append(len(self.elements))
        self.elements.append(_Element(self._parser.CurrentLineNumber, name, attributes, (outer, parent)))

    def _end(self, _: str) -> None:
        self._open.pop()

    def _text(self, text: str) -> None:
        if self._open and text.strip():
            self.texts.append((self._parser.CurrentLineNumber, self.elements[self._open[-1]].name, text.strip()))


def read_launch(text: str) -> Iterator[ScriptFinding]:
    """Yield the findings in a launch file."""
    reader = _Reader()
    if reason := reader.read(text):
        yield finding(1, reason, original.BROKEN_XML, reason=reason)
    for number, element in enumerate(reader.elements):
        if element.name == "include":
            yield from _include(reader, number, element)
        elif element.name == "node":
            yield from _node(element)
        elif element.name == "remap":
            for key in ("from", "to"):
                yield from present.of_name(element.line, element.attributes.get(key, ""))
        if "xacro.py" in " ".join(element.attributes.values()):
            yield finding(element.line, _written(element), original.XACRO)
        elif "use_gui" in (element.attributes.get("name"), element.attributes.get("param")):
            yield finding(element.line, _written(element), original.USE_GUI)


def _include(reader: _Reader, number: int, element: _Element) -> Iterator[ScriptFinding]:
    included = _INCLUDED.search(element.attributes.get("file", ""))
    if included:
        inner = [one for one in reader.elements if one.inside[1] == number and one.name == "arg"]
        names = [one.attributes.get("name", "") for one in inner]
        yield from present.of_launch(element.line, _written(element), f"{included[1]}/{included[2]}", names)


def _node(element: _Element) -> Iterator[ScriptFinding]:
    package, program = element.attributes.get("pkg", ""), element.attributes.get("type", "")
    text = _written(element)
    if (package, program) == ("robot_state_publisher", "state_publisher"):
        yield finding(element.line, text, original.STATE_PUBLISHER)
    elif package == "rosbridge_server":
        yield finding(element.line, text, original.ROSBRIDGE)
    elif not _REPLACED.search(program):
        yield from present.of_program(element.line, text, package, program)
    for word in element.attributes.get("args", "").split():
        yield from present.of_name(element.line, word) if word.startswith("/") else ()


def _written(element: _Element) -> str:
    attributes = "".join(f' {name}="{value}"' for name, value in element.attributes.items())
    return f"<{element.name}{attributes}>"


_DEPENDS = frozenset({"depend", "build_depend", "build_export_depend", "exec_depend", "run_depend", "test_depend"})


def read_package(text: str) -> Iterator[ScriptFinding]:
    """Yield the findings in a package.xml."""
    reader = _Reader()
    if reason := reader.read(text):
        yield finding(1, reason, original.BROKEN_XML, reason=reason)
    for line, name, package in reader.texts:
        if name == "name" and package in PACKAGES:
            yield finding(line, f"<name>{package}</name>", original.OLD_PACKAGE, name=package)
        if name not in _DEPENDS:
            continue
        if package == "rosbridge_server":
            yield finding(line, f"<{name}>{package}</{name}>", original.ROSBRIDGE)
        elif package == "xacro":
            yield finding(line, f"<{name}>{package}</{name}>", original.XACRO)
        yield from present.of_package_name(line, package)


def read_rosbuild(text: str) -> Iterator[ScriptFinding]:
    """Yield the finding that a stack.xml or manifest.xml is."""
    yield finding(1, text.strip().partition("\n")[0] or "-", original.ROSBUILD)
