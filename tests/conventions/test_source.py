"""What holds for every file of the source, looked up in its syntax."""

from __future__ import annotations

import ast
import importlib
import inspect
from collections.abc import Iterator

from tests.conventions import source
from tests.conventions.source import Function, Module

MAX_LINES = 600

IO = {"asyncio", "selectors", "socket", "ssl", "subprocess", "threading"}
IO_MODULES = {
    "maya_un.galil.driver",
    "maya_un.galil.emergency",
    "maya_un.galil.gclib.api",
    "maya_un.galil.gclib.connection",
    "maya_un.galil.gclib.session",
    "maya_un.galil.gclib.shim.gclib",
    "maya_un.galil.stream",
    "maya_un.galil.transport",
    "maya_un.virtual.wire.control",
    "maya_un.virtual.wire.dialing",
    "maya_un.virtual.wire.link",
    "maya_un.virtual.wire.listening",
    "maya_un.virtual.wire.server",
    "maya_un.virtual.wire.udp",
}
"""The modules of `galil` and `virtual` that carry bytes; all others are functions of bytes and time."""

CLOCKS = {"time", "datetime", "sched", "timeit"}
MAY_LOOK_AT_THE_CLOCK = {"cli", "client", "server", "supervisor", "loops"}
"""Edges live in real time, and `loops` is where time comes from."""

COMPARES_DATES = {"maya_un.graph.step"}
"""They read dates that a command carries, and are given the present one."""


def public_definitions(body: list[ast.stmt], prefix: str) -> Iterator[tuple[str, Function | ast.ClassDef]]:
    for node in body:
        if isinstance(node, Function | ast.ClassDef) and not node.name.startswith("_"):
            yield prefix + node.name, node
            if isinstance(node, ast.ClassDef):
                yield from public_definitions(node.body, f"{prefix}{node.name}.")


def inherits_docstring(module: Module, dotted: str) -> bool:
    *owner, _ = dotted.split(".")
    if not owner:
        return False
    found: object = importlib.import_module(module.name)
    for part in dotted.split("."):
        found = getattr(found, part)
    return not isinstance(found, type) and bool(inspect.getdoc(found))


def is_overload(node: Function | ast.ClassDef) -> bool:
    return any(isinstance(item, ast.Name) and item.id == "overload" for item in node.decorator_list)


def test_every_module_is_documented() -> None:
    assert [module.name for module in source.modules() if not ast.get_docstring(module.tree)] == []


def test_every_public_name_is_documented() -> None:
    bare = [
        f"{module.name}: {name}"
        for module in source.modules()
        for name, node in public_definitions(module.tree.body, "")
        if not ast.get_docstring(node) and not is_overload(node) and not inherits_docstring(module, name)
    ]
    assert not bare, f"public names without a docstring: {bare}"


def unannotated(function: Function, *, method: bool) -> Iterator[str]:
    arguments = function.args
    positional = [*arguments.posonlyargs, *arguments.args]
    static = any(isinstance(item, ast.Name) and item.id == "staticmethod" for item in function.decorator_list)
    if method and not static:
        positional = positional[1:]
    others = [arguments.vararg, arguments.kwarg]
    for argument in (*positional, *arguments.kwonlyargs, *(item for item in others if item)):
        if argument.annotation is None:
            yield f"{function.name}({argument.arg})"
    if function.returns is None:
        yield f"{function.name} ->"


def methods(tree: ast.Module) -> set[ast.AST]:
    classes = (node for node in ast.walk(tree) if isinstance(node, ast.ClassDef))
    return {node for owner in classes for node in owner.body}


def without_annotation(module: Module) -> list[str]:
    inside = methods(module.tree)
    bare = [name for node in module.functions() for name in unannotated(node, method=node in inside)]
    return [f"{module.name}: {name}" for name in bare]


def test_everything_is_annotated() -> None:
    bare = [name for module in (*source.modules(), *source.test_modules()) for name in without_annotation(module)]
    assert not bare, f"without annotation: {bare}"


def test_a_module_stays_readable_in_one_sitting() -> None:
    assert [module.name for module in source.modules() if module.lines > MAX_LINES] == []


def test_exported_names_exist() -> None:
    missing: list[str] = []
    for module in source.modules():
        if source.floor(module) == "ros":
            continue  # nodes are loaded by a Python that has ROS, and export nothing
        loaded = importlib.import_module(module.name)
        exported: list[str] = getattr(loaded, "__all__", [])
        missing += [f"{module.name}: {name}" for name in exported if not hasattr(loaded, name)]
    assert not missing


def test_nothing_below_the_edges_looks_at_a_clock() -> None:
    below = [module for module in source.modules() if source.floor(module) not in MAY_LOOK_AT_THE_CLOCK]
    assert below
    looking = [module for module in below if module.imports() & CLOCKS]
    assert {module.name for module in looking} == COMPARES_DATES
    assert not {called for module in looking for _, called in module.calls()} & {"now", "utcnow", "today"}


def test_bytes_are_carried_only_by_the_modules_named_for_it() -> None:
    forbidden = IO | IO_MODULES | {"maya_un.events", "maya_un.loops"}
    silent = [
        module
        for module in source.modules()
        if source.floor(module) in {"galil", "virtual"} and module.name not in IO_MODULES
    ]
    assert silent
    assert [module.name for module in silent if module.imports() & forbidden] == []


def test_tests_do_not_sleep() -> None:
    sleeps = [
        f"{module.path}:{line}"
        for module in source.test_modules()
        for line, called in module.calls()
        if called == "sleep" and "sleep(0)" not in module.text.splitlines()[line - 1]  # a turn, not a time
    ]
    assert not sleeps, f"a test waits for something to settle (tests/virtual_time.py lets time pass): {sleeps}"


def test_test_functions_return_nothing() -> None:
    tests = [
        (module, node)
        for module in source.test_modules()
        if module.path.stem.startswith("test_")
        for node in module.functions()
        if node.name.startswith("test_")
    ]
    assert tests
    nothing = {node for _, node in tests if isinstance(node.returns, ast.Constant) and node.returns.value is None}
    assert [f"{module.name}: {node.name}" for module, node in tests if node not in nothing] == []


WRITES_BY_ITSELF = {
    "maya_un.cli.queueing.jobs": "a job for the editor, in a temporary folder of its own",
    "maya_un.client.twin": "the twin's table, in a temporary folder of its own",
    "maya_un.config.edit": "a draft in the place that `files.writable_place` names",
    "maya_un.graph.description": "the robot's dimensions, in a copy of its own",
    "maya_un.recorder.shelf": "a draft that nobody else has",
    "maya_un.runtime": "the runtime file, opened by `files.open_own`",
}
"""The modules that write files other than by `maya_un.files`, and why."""


def writes_a_file(node: ast.AST) -> bool:
    """Tell whether a node calls `write_text` or `write_bytes`, or `open` with a mode that writes."""
    match node:
        case ast.Call(func=ast.Attribute(value=ast.Name(id="files"))):
            return False
        case ast.Call(func=ast.Attribute(attr="write_text" | "write_bytes")):
            return True
        case ast.Call(func=ast.Attribute(attr="open") | ast.Name(id="open"), args=arguments, keywords=keywords):
            values = (*arguments, *(keyword.value for keyword in keywords if keyword.arg == "mode"))
            modes = [value.value for value in values if isinstance(value, ast.Constant)]
            return any(isinstance(mode, str) and bool(set(mode) & set("wxa+")) for mode in modes)
        case _:
            return False


def test_files_are_written_by_the_one_module_for_it() -> None:
    writers = {
        module.name for module in source.modules() if any(writes_a_file(node) for node in ast.walk(module.tree))
    } - {"maya_un.files"}
    assert writers == set(WRITES_BY_ITSELF)
