"""The source tree, parsed once, for the tests of conventions."""

from __future__ import annotations

import ast
import functools
import gc
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = [ROOT / "src" / name for name in ("dmc41x3", "maya_ros", "maya_un")]

Function = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True, slots=True)
class Module:
    """One file: its dotted name, its text, its tree."""

    name: str
    path: Path
    text: str
    tree: ast.Module

    @property
    def lines(self) -> int:
        """Number of lines."""
        return self.text.count("\n")

    def imports(self) -> set[str]:
        """Dotted names of everything imported anywhere in the file; `from a import b` gives a and a.b."""
        found: set[str] = set()
        for node in ast.walk(self.tree):
            if isinstance(node, ast.Import):
                found.update(alias.name for alias in node.names)
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                found.add(node.module)
                found.update(f"{node.module}.{alias.name}" for alias in node.names)
        return found

    def functions(self) -> Iterator[Function]:
        """Every function and method, nested ones included."""
        return (node for node in ast.walk(self.tree) if isinstance(node, Function))

    def calls(self) -> Iterator[tuple[int, str]]:
        """Line and last name of everything called: `asyncio.sleep(1)` gives `sleep`."""
        for node in ast.walk(self.tree):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute | ast.Name):
                called = node.func
                yield node.lineno, called.attr if isinstance(called, ast.Attribute) else called.id


def _parse(path: Path, base: Path) -> Module:
    parts = list(path.relative_to(base).with_suffix("").parts)
    if parts[-1] == "__init__":
        parts.pop()
    text = path.read_text(encoding="utf-8")
    return Module(".".join(parts), path, text, ast.parse(text, str(path)))


def _parsed(paths: Iterable[Path], base: Path) -> tuple[Module, ...]:
    """Parse files. The garbage collector never looks at their trees: that takes four times as long as to parse."""
    gc.disable()
    try:
        return tuple(_parse(path, base) for path in paths)
    finally:
        gc.freeze()
        gc.enable()


@functools.cache
def modules() -> tuple[Module, ...]:
    """Return every module of the packages."""
    return _parsed((path for package in PACKAGES for path in sorted(package.rglob("*.py"))), ROOT / "src")


@functools.cache
def test_modules() -> tuple[Module, ...]:
    """Return every module of the tests."""
    found = sorted((ROOT / "tests").rglob("*.py"))
    return _parsed((path for path in found if "node_modules" not in path.parts), ROOT)


test_modules.__test__ = False  # type: ignore[attr-defined]


def layer(module: Module) -> str:
    """Return the layer (or leaf) a module belongs to; empty for a package itself."""
    return [*module.name.split("."), ""][1]
