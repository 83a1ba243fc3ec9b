"""Reads Python source, of version 2 or 3, and finds what to change in it.

parso reads every source: it has no grammar of Python 2, but where a text does not fit, it goes on behind that place and
keeps the calls, names and comparisons around it. Types are followed through plain assignments and callbacks.
"""

from __future__ import annotations

import ast
import re
import warnings
from collections.abc import Iterator, Mapping, Sequence
from math import pi
from typing import Any

from dmc41x3.gclib import api
from maya_ros.graph import catalogue
from maya_ros.graph.table import Kind
from maya_ros.migration import commands as lines
from maya_ros.migration import finding as present
from maya_ros.migration import original, syntax
from maya_ros.migration.finding import ScriptFinding, finding, listed
from maya_ros.migration.original import EVENT_TOPIC, MODULES, NODE_PYTHON, PACKAGES
from maya_un.errors import UnknownInterface

_CONFIG = "maya_controller.config"
_EVENTS = "maya_controller.config.events"
_CONSTANTS = "maya_controller.config.constants"
_MOVE = "maya_controller/MoveGoal"
_PRIMITIVE = "maya_robot/MayaPrimitive"

_TEXT, _PROXY, _CLIENT, _GCLIB = "text of an event", "proxy ", "client ", "gclib"
"""Types that are no messages: `msg.data` of /maya_event, ServiceProxy, SimpleActionClient, gclib.py()."""

_OLD_NAMES = {"raw_input", "xrange", "unicode", "basestring", "unichr", "execfile", "reduce"} | {"long", "cmp"}
_OLD_METHODS = {"iteritems", "itervalues", "iterkeys", "has_key"}
_OLD_MODULES = {"Queue", "ConfigParser", "Tkinter", "urllib2", "StringIO", "cPickle", "httplib", "commands"}

_TO_RADIANS = re.compile(r"(?:^|\.)(?:radians|deg2rad)$")
_TO_DEGREES = re.compile(r"(?:^|\.)(?:degrees|rad2deg)$")
_SHEBANG = re.compile(r"#!.*\b(python(?:2(?:\.\d)?)?)\s*$")


def read(text: str) -> Iterator[ScriptFinding]:
    """Yield the findings in a Python source."""
    versions = [*_version(text)]
    is_old = any(one.rule is original.PYTHON_2 for one in versions)
    source = _Source(syntax.modern(text) if is_old else text)
    yield from versions
    yield from source.findings()
    yield from () if is_old else source.old_names()


def _version(text: str) -> Iterator[ScriptFinding]:
    """Yield at most one finding for a shebang, and one for Python 2."""
    first = text.partition("\n")[0]
    if shebang := _SHEBANG.match(first):
        yield finding(1, first, original.SHEBANG, name=shebang[1])
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            ast.parse(text)
    except SyntaxError as error:
        line = error.lineno or 1
        held = (text.splitlines() or [""])[min(line, len(text.splitlines()) or 1) - 1]
        yield finding(line, held, original.PYTHON_2, at=str(line), reason=error.msg.partition(". Did you mean")[0])
    except (ValueError, RecursionError, MemoryError) as error:
        yield finding(1, first, original.PYTHON_2, at="1", reason=str(error) or type(error).__name__)


class _Source:
    """A source as a tree, with the meaning of its names."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._nodes = syntax.parse(text)
        self._imported: dict[str, str] = {}
        self._types: dict[tuple[int, str], str] = {}
        self._functions = {node.name.value: node for node in self._nodes if node.type == "funcdef"}
        self._imports: list[tuple[int, str, str]] = []
        for node in self._nodes:
            if node.type in {"import_name", "import_from"}:
                self._read_import(node)
        expressions = [node for node in self._nodes if node.type in {"atom_expr", "power"}]
        self._calls = [call for node in expressions for call in syntax.calls(node)]
        self._hears_events = EVENT_TOPIC[1:] in text
        for call in self._calls:
            self._learn_callback(call)
        for _ in range(2):  # a name may take its type from a name that stands behind it
            for node in self._nodes:
                self._learn(node)

    def findings(self) -> Iterator[ScriptFinding]:
        """Yield the findings, of every part of the source."""
        for line, module, name in self._imports:
            yield from self._import(line, module, name)
        for node in self._nodes:
            if node.type == "string":
                yield from self._string(node)
            elif node.type == "comparison":
                yield from self._comparison(node)
            elif node.type in {"atom_expr", "power"}:
                yield from self._attributes(node)
            elif node.type == "expr_stmt":
                yield from self._assignment(node)
        for call in self._calls:
            yield from self._call(call)

    # The meaning of names

    def _read_import(self, node: Any) -> None:
        line = node.start_pos[0]
        if node.type == "import_from" and (node.level or node.is_star_import()):
            module = ".".join(name.value for name in node.get_paths()[0])
            self._imports.append((line, module, ""))
            if not node.level:
                self._imported |= {name: f"{module}.{name}" for name in _members(module)}
            return
        for path, defined in zip(node.get_paths(), node.get_defined_names(), strict=False):
            names = [name.value for name in path]
            full = ".".join(names)
            whole = node.type == "import_from" or defined.value != names[0]
            self._imported[defined.value] = full if whole else names[0]
            if node.type == "import_from":
                self._imports.append((line, ".".join(names[:-1]), names[-1]))
            else:
                self._imports.append((line, full, ""))

    def _full(self, dotted: str) -> str:
        """Return a dotted name with the import of its first part filled in."""
        first, dot, rest = dotted.partition(".")
        return f"{self._imported.get(first, first)}{dot}{rest}"

    def _kind(self, node: Any) -> str:
        """Return the type that a class of messages has ("package/Name"), "" for anything else."""
        return "" if node is None else self._kind_of_name(syntax.dotted(node))

    def _kind_of_name(self, dotted: str) -> str:
        parts = self._full(dotted).split(".")
        return f"{parts[0]}/{parts[2]}" if len(parts) == 3 and parts[1] in {"msg", "srv"} else ""

    def _type(self, node: Any) -> str:
        """Return the type of an expression, "" if it is not known."""
        dotted = syntax.dotted(node)
        if dotted:
            return self._type_of_name(node, dotted)
        calls = syntax.calls(node) if node.type in {"atom_expr", "power"} else []
        if not calls:
            return ""
        made, last = self._type_of_call(calls[-1]), node.children[-1]
        if calls[-1].node is node:
            return made
        is_attribute = calls[-1].node is node.children[-2] and last.type == "trailer" and last.children[0] == "."
        return _attribute_type(made, last.children[1].value) if is_attribute else ""

    def _type_of_name(self, node: Any, dotted: str) -> str:
        found = self._types.get((syntax.scope(node), dotted)) or self._types.get((0, dotted), "")
        if found or "." not in dotted:
            return found
        before, _, name = dotted.rpartition(".")
        whole = self._types.get((syntax.scope(node), before)) or self._types.get((0, before), "")
        return _attribute_type(whole, name)

    def _type_of_call(self, call: syntax.PythonCall) -> str:
        full, (before, _, method) = self._full(call.called), call.called.rpartition(".")
        match full:
            case "gclib.py":
                return _GCLIB
            case "rospy.wait_for_message":
                heard = self._kind(call.argument("topic_type", 1))
                return EVENT_TOPIC if _is_event(call.argument("topic", 0)) else heard
            case "rospy.ServiceProxy":
                return _PROXY + self._kind(call.argument("service_class", 1))
            case "actionlib.SimpleActionClient" | "actionlib.ActionClient":
                return _CLIENT + self._kind(call.argument("ActionSpec", 1)).removesuffix("Action")
            case _:
                return self._kind_of_name(call.called) or self._type_of_answer(call, before, method)

    def _type_of_answer(self, call: syntax.PythonCall, before: str, method: str) -> str:
        """Return the type of the result of an action, or of the response of a service."""
        owner = self._type_of_name(call.node, before) if before else ""
        if owner.startswith(_CLIENT) and method == "get_result":
            return f"{owner.removeprefix(_CLIENT)}Result"
        own = self._type_of_name(call.node, call.called)
        return f"{own.removeprefix(_PROXY)}Response" if own.startswith(_PROXY) else ""

    def _learn(self, node: Any) -> None:
        if node.type != "expr_stmt" or len(node.children) != 3 or node.children[1] != "=":
            return
        name, kind = syntax.dotted(node.children[0]), self._type(node.children[2])
        if name and kind:
            self._types[(0 if "." in name else syntax.scope(node), name)] = kind

    def _learn_callback(self, call: syntax.PythonCall) -> None:
        if self._full(call.called) != "rospy.Subscriber":
            return
        callback = call.argument("callback", 2)
        function = self._functions.get(syntax.dotted(callback).rpartition(".")[2]) if callback is not None else None
        if function is None:
            return
        kind = EVENT_TOPIC if _is_event(call.argument("name", 0)) else self._kind(call.argument("data_class", 1))
        parameters = [one.name.value for one in function.get_params() if one.name.value != "self"]
        if parameters and kind:
            self._types[(id(function), parameters[0])] = kind

    # The findings

    def _import(self, line: int, module: str, name: str) -> Iterator[ScriptFinding]:
        package = module.partition(".")[0]
        text = f"from {module} import {name}" if name else f"import {module}"
        if package == "gclib":
            yield finding(line, text, original.GCLIB)
        if package not in PACKAGES:
            return
        whole = f"{module}.{name}" if name else module
        if module.endswith((".msg", ".srv")):
            yield from present.of_type(line, f"{package}/{name}") if name not in {"", "*"} else ()
        elif whole in MODULES or whole in {package, f"{package}.msg", f"{package}.srv", _CONSTANTS}:
            yield from self._module(line, text, whole)
        elif module == _CONSTANTS:
            yield from self._constant(line, text, name)
        elif module == _EVENTS and name != "read":
            yield from self._word(line, text, name)
        elif module == _CONFIG and name in present.constants():
            yield finding(line, text, original.CONSTANT_PLACE, name=name)
        elif module in MODULES and name in MODULES[module]:
            yield from self._module(line, text, module)
        elif module in MODULES and module != _CONFIG:
            known = listed(sorted(MODULES[module]))
            yield finding(line, text, original.FUNCTION, module=module, name=name, known=known)
        else:
            known = listed(sorted(MODULES))
            yield finding(line, text, original.MODULE, name=whole, known=known)

    def _module(self, line: int, text: str, module: str) -> Iterator[ScriptFinding]:
        if module in NODE_PYTHON:
            yield finding(line, text, original.NODES_ONLY, module=module)
        else:
            yield ScriptFinding(line, module)

    def _constant(self, line: int, text: str, name: str) -> Iterator[ScriptFinding]:
        if name not in present.constants():
            yield finding(line, text, original.CONSTANT, name=name, known=listed(present.constants()))
        else:
            yield ScriptFinding(line, name)

    def _word(self, line: int, text: str, name: str) -> Iterator[ScriptFinding]:
        if name not in present.words():
            yield finding(line, text, original.EVENT_WORD, name=name, known=listed(present.words()))
        else:
            yield ScriptFinding(line, f"events.{name}")

    def _string(self, node: Any) -> Iterator[ScriptFinding]:
        value = syntax.value(node)
        line = node.start_pos[0]
        if "\n" not in value:
            yield from present.of_name(line, value) if value.startswith("/") else ()
            yield from lines.of_command(line, value) if lines.starts_ros(value) else ()

    def _comparison(self, node: Any) -> Iterator[ScriptFinding]:
        sides = [child for child in node.children if child.type not in {"operator", "keyword", "comp_op"}]
        event = next((side for side in sides if self._is_event_text(side)), None)
        if event is None:
            return
        for side in sides:
            literals = [one for one in syntax.walk(side) if one.type == "string"]
            for literal in (one for one in literals if syntax.value(one) in present.words().values()):
                word = syntax.value(literal)
                line = literal.start_pos[0]
                yield finding(line, syntax.code(node), original.EVENT_TEXT, constant=word.upper(), word=word)
            if not literals and syntax.code(side).startswith("{"):
                yield finding(side.start_pos[0], syntax.code(node), original.EVENT_KEY)

    def _is_event_text(self, node: Any) -> bool:
        dotted = syntax.dotted(node)
        if self._type(node) == _TEXT:
            return True
        return self._hears_events and dotted.endswith(".data") and not self._type_of_name(node, dotted[:-5])

    def _attributes(self, node: Any) -> Iterator[ScriptFinding]:
        """Yield the findings in the attributes and keys of an expression like a.b(c).d[e]."""
        line = node.start_pos[0]
        names = [node.children[0].value] if node.children[0].type == "name" else []
        calls = iter(syntax.calls(node))
        made = ""
        for trailer in node.children[1:]:
            opening = trailer.children[0] if trailer.type == "trailer" else None
            if opening == "(" and (call := next(calls, None)) is not None:
                made, names = self._type_of_call(call), []
            elif opening == "." and names:
                yield from self._attribute(node, ".".join(names), trailer.children[1].value)
                names.append(trailer.children[1].value)
            elif opening == "." and made:
                yield from _field(line, syntax.code(node), made, trailer.children[1].value)
                made = _field_type(made, trailer.children[1].value)
            else:
                if opening == "[" and self._is_event_text(trailer.children[1]):
                    yield finding(line, syntax.code(node), original.EVENT_KEY)
                return

    def _attribute(self, node: Any, before: str, name: str) -> Iterator[ScriptFinding]:
        line, module = node.start_pos[0], self._full(before)
        if module == _CONSTANTS:
            yield from self._constant(line, f"{before}.{name}", name)
        elif module == _EVENTS and name != "read":
            yield from self._word(line, f"{before}.{name}", name)
        elif module == _CONFIG and name in present.constants():
            yield finding(line, f"{before}.{name}", original.CONSTANT_PLACE, name=name)
        elif module in MODULES and module != _CONFIG and name not in MODULES[module]:
            known = listed(sorted(MODULES[module]))
            yield finding(line, f"{before}.{name}", original.FUNCTION, module=module, name=name, known=known)
        kind = self._type_of_name(node, before)
        if kind == _GCLIB:
            yield from _gclib_method(line, f"{before}.{name}", name)
        else:
            yield from _field(line, f"{before}.{name}", kind, name)

    def _assignment(self, node: Any) -> Iterator[ScriptFinding]:
        target, name = node.children[0], syntax.dotted(node.children[0])
        before, _, field = name.rpartition(".")
        line = node.start_pos[0]
        if len(node.children) < 3 or not before:
            return
        if self._full(before) == _CONSTANTS and field in present.constants():
            yield finding(line, syntax.code(node), original.CONSTANT_SET, key=present.constants()[field])
            return
        kind = self._type_of_name(target, before)
        if node.children[1] == "=":
            yield from self._value(kind, field, node.children[2], syntax.code(node))

    def _value(self, kind: str, field: str, value: Any, text: str) -> Iterator[ScriptFinding]:
        """Yield what a value for a field means."""
        if kind == _MOVE and field == "a":
            yield from self._angle(value, text)
        if kind == _PRIMITIVE and field == "command" and value.type == "string":
            name = syntax.value(value)
            if name not in present.commands():
                known = listed(present.commands())
                yield finding(value.start_pos[0], text, original.PRIMITIVE, name=name, known=known)

    def _angle(self, value: Any, text: str) -> Iterator[ScriptFinding]:
        line, code = value.start_pos[0], syntax.code(value)
        calls = syntax.calls(value) if value.type in {"atom_expr", "power"} else []
        called = calls[-1] if calls and calls[-1].node is value else None
        number = syntax.number(code)
        if called is not None and _TO_DEGREES.search(called.called) and called.arguments:
            yield finding(line, text, original.DEGREES, new=f"`{syntax.code(called.arguments[0][1])}`")
        elif number is not None and abs(number) > 2 * pi:
            yield finding(line, text, original.DEGREES, new=f"`math.radians({code})`")
        elif number == 0.0 or (called is not None and _TO_RADIANS.search(called.called)):
            return
        elif self._full(syntax.dotted(value)) not in {f"{_CONSTANTS}.{name}" for name in ("A_0", "A_MAX")}:
            yield finding(line, text, original.DEGREES_MAYBE, value=present.shown(code))

    def _call(self, call: syntax.PythonCall) -> Iterator[ScriptFinding]:
        full = self._full(call.called)
        kind = self._kind_of_name(call.called)
        if kind:
            yield from self._made(kind, call)
        elif full.startswith(("rospy.", "actionlib.")):
            yield from self._connected(full, call)
        elif self._type_of_name(call.node, call.called).startswith(_PROXY):
            service = self._type_of_name(call.node, call.called).removeprefix(_PROXY)
            if call.arguments and not (len(call.arguments) == 1 and self._type(call.arguments[0][1])):
                yield from self._made(f"{service}Request", call)
        else:
            yield from self._galil(call)

    def _made(self, kind: str, call: syntax.PythonCall) -> Iterator[ScriptFinding]:
        """Yield the findings in a call that makes a message."""
        if kind.partition("/")[0] not in PACKAGES or not _is_message(kind):
            return
        line, text, known = call.node.start_pos[0], syntax.code(call.node), present.fields(kind)
        plain = [value for name, value in call.arguments if not name]
        if plain and not call.arguments[0][0] and len(plain) != len(known):
            count = {"expected": str(len(known)), "given": str(len(plain))}
            yield finding(line, text, original.ARGUMENTS, type=kind, known=listed(known), **count)
            return
        named = [(name, value) for name, value in call.arguments if name]
        for name, value in [*zip(known, plain, strict=False), *named]:
            if name not in known and not name.startswith("*"):
                yield finding(line, text, original.FIELD, type=kind, name=name, known=listed(known))
            yield from self._value(kind, name, value, text)

    def _connected(self, full: str, call: syntax.PythonCall) -> Iterator[ScriptFinding]:
        """Yield the findings in a call that connects to a name of the graph."""
        role = full.rpartition(".")[2]
        place = call.argument("ns" if full.startswith("actionlib") else "name", 0)
        row = present.row_of(syntax.value(place)) if place is not None and place.type == "string" else None
        if row is None:
            return
        line, text = call.node.start_pos[0], syntax.code(call.node)
        given = call.argument("ActionSpec" if row.form is Kind.ACTION else "data_class", 1)
        name = self._full(syntax.dotted(given) if given is not None else "")
        own = name.rpartition(".")[2].removesuffix("Action" if row.form is Kind.ACTION else "")
        package, _, expected = row.type.partition("/")
        if own and role != "wait_for_service" and (own != expected or not name.startswith((package, own))):
            kind = f"{row.type}Action" if row.form is Kind.ACTION else row.type
            yield finding(line, text, original.TYPE, name=row.name, expected=kind, given=syntax.dotted(given))
        publishes = role == "Publisher" and not row.heard
        if publishes or role in {"Service", "SimpleActionServer", "ActionServer"}:
            yield finding(line, text, original.OWN_NAME, name=row.name, node=" / ".join(row.sources))

    def _galil(self, call: syntax.PythonCall) -> Iterator[ScriptFinding]:
        """Yield the findings in the commands that a call sends to the controller."""
        method = call.called.rpartition(".")[2]
        owner = self._type_of_name(call.node, call.called.rpartition(".")[0]) if "." in call.called else ""
        if owner != _GCLIB and method != "GCommand":
            return
        strings = [one for _, value in call.arguments[:1] for one in syntax.walk(value) if one.type == "string"]
        for one in strings if method in {"GCommand", "GProgramDownload"} else ():
            whole = syntax.code(one) == syntax.code(call.arguments[0][1])
            for number, line in enumerate(syntax.value(one).splitlines()):
                yield from lines.of_dmc(one.start_pos[0] + number, line, complete=whole)

    def old_names(self) -> Iterator[ScriptFinding]:
        """Yield one finding for the names that Python 3 lacks."""
        found: dict[str, int] = {}
        names = [node for node in self._nodes if node.type == "name"]
        old = [node for node in names if node.value in _OLD_NAMES | _OLD_METHODS]
        defined = {*self._imported, *(node.value for node in old if node.is_definition())}
        for node in old:
            before = node.get_previous_leaf()
            after_dot = before is not None and before == "."
            if node.value in (_OLD_METHODS if after_dot else _OLD_NAMES - defined):
                found.setdefault(f".{node.value}()" if after_dot else node.value, node.start_pos[0])
        for line, module, _ in self._imports:
            if module.partition(".")[0] in _OLD_MODULES:
                found.setdefault(module, line)
        if found:
            first = min(found.values())
            yield finding(first, listed(found), original.PYTHON_2_NAMES, names=listed(found))


def _field(line: int, text: str, kind: str, name: str) -> Iterator[ScriptFinding]:
    """Yield a finding for an attribute that a message type of Maya does not have."""
    if "/" in kind and " " not in kind and not _has(kind, name):
        yield finding(line, text, original.FIELD, type=kind, name=name, known=_known(kind))


def _gclib_method(line: int, text: str, name: str) -> Iterator[ScriptFinding]:
    if name in _NOT_OFFERED or (name.startswith("G") and not hasattr(api.py, name)):
        yield finding(line, text, original.GCLIB_MISSING, name=name)


_NOT_OFFERED = {"GAssign", "GIpRequests", "GFirmwareDownload", "GSetupDownloadFile"}
"""Methods that exist in Maya's gclib and raise an error (docs/how-to/run-gclib-scripts.md)."""


def _members(module: str) -> Sequence[str]:
    """Return the names that `from module import *` brings."""
    package, _, form = module.partition(".")
    if form in {"msg", "srv"} and package in PACKAGES:
        return [kind.partition("/")[2] for kind in catalogue.kinds() if kind.startswith(f"{package}/")]
    own: Mapping[str, Sequence[str]] = {_CONSTANTS: [*present.constants()], _EVENTS: [*present.words()]}
    return own.get(module, ())


def _is_event(node: Any) -> bool:
    name = f"/{syntax.value(node).removeprefix('/')}" if node is not None and node.type == "string" else ""
    return original.RENAMED.get(name, name) == EVENT_TOPIC


def _is_message(kind: str) -> bool:
    return kind in catalogue.kinds()


def _has(kind: str, name: str) -> bool:
    """Return whether a message type of Maya has an attribute; other types have every one."""
    if kind.partition("/")[0] not in PACKAGES or not _is_message(kind):
        return True
    spec = catalogue.spec(kind)
    own = {*(one.name for one in spec.fields), *(one.name for one in spec.constants)}
    return name in own or name.startswith(("_", "serialize", "deserialize"))


def _known(kind: str) -> str:
    return listed(one.name for one in catalogue.spec(kind).fields)


def _attribute_type(kind: str, name: str) -> str:
    return _TEXT if (kind, name) == (EVENT_TOPIC, "data") else _field_type(kind, name)


def _field_type(kind: str, name: str) -> str:
    try:
        fields = catalogue.spec(kind).fields if "/" in kind and " " not in kind and kind != EVENT_TOPIC else ()
    except UnknownInterface:
        return ""
    return next((one.type for one in fields if one.name == name and "/" in one.type), "")
