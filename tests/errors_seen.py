"""Which errors the code under test has made, in which test, and with which sentence: a table, code by code.

The sentences of `docs/reference/errors.md` are templates. Here each stands with the details of a situation, so that a
person can read whether the advice fits. `./test --errors=FILE` writes the table.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import wraps
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from dmc41x3.errors import CodedError, by_code

_PRINTED = re.compile(r"^(?:maya|dmc): error (\d{4}): (.*)", re.MULTILINE)

_OURS = ("dmc41x3", "maya_un", "maya_ros")

Seen = tuple[int, str, str]
"""How often an error was made, in which test first, and its sentence there."""


@dataclass(slots=True)
class SeenErrors:
    """The errors that were made, by their codes."""

    by_code: dict[int, Seen] = field(default_factory=dict[int, Seen])

    def note(self, code: int, sentence: str) -> None:
        """Count an error, and keep the first one of its code."""
        test = os.environ.get("PYTEST_CURRENT_TEST", "").partition(" ")[0]
        self.add(code, (1, test, sentence))

    def note_printed(self, output: str) -> None:
        """Count the errors in the output of a command that ran as a process of its own."""
        for code, sentence in _PRINTED.findall(output):
            self.note(int(code), sentence)

    def add(self, code: int, seen: Seen) -> None:
        """Add what another process has counted."""
        known = self.by_code.get(code)
        self.by_code[code] = seen if known is None else (known[0] + seen[0], *known[1:])

    def unseen(self) -> list[type[CodedError]]:
        """Return the declared errors that no test has brought about in this process or a worker."""
        return [kind for code, kind in sorted(by_code().items()) if code not in self.by_code]

    def write(self, path: Path) -> None:
        """Write the table."""
        known = by_code()
        rows = [
            (str(code), known[code].__name__, str(count), f"`{test}`", sentence)
            for code, (count, test, sentence) in sorted(self.by_code.items())
            if code in known
        ]
        head = ("code", "name", "times", "first seen in", "sentence")
        lines = [*map(_row, (head, ("---",) * len(head), *rows)), "", *self._lacking()]
        path.write_text("\n".join(lines), encoding="utf-8")

    def _lacking(self) -> Iterable[str]:
        return (f"Not seen: {kind.code} {kind.__name__}." for kind in self.unseen())


SEEN = SeenErrors()
"""The errors of this process."""


def _row(cells: Iterable[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in cells) + " |"


def _watch() -> None:
    """Note every error from now on that code of this project makes, other than tests and copies of earlier errors."""
    make = CodedError.__init__

    @wraps(make)
    def noting(self: CodedError, **details: object) -> None:
        make(self, **details)
        if sys._getframe(1).f_globals.get("__name__", "").partition(".")[0] in _OURS:
            SEEN.note(self.code, str(self))

    CodedError.__init__ = noting


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that writes the table."""
    parser.addoption("--errors", metavar="FILE", help="write the errors that the tests saw, code by code, as Markdown")


def pytest_configure() -> None:
    """Begin to note the errors of this process."""
    for package in ("maya_un.errors", "maya_ros.graph.outcome"):  # they declare the errors
        import_module(package)
    _watch()


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Send what a worker has noted to the process that sums up."""
    output: dict[str, Any] | None = getattr(session.config, "workeroutput", None)
    if output is not None:
        output["errors"] = SEEN.by_code


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    """Take what a worker has noted."""
    for code, seen in getattr(node, "workeroutput", {}).get("errors", {}).items():
        SEEN.add(code, tuple(seen))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Write the table, if it is wanted, and say how much of it there is."""
    if config.option.errors is not None:
        SEEN.write(Path(config.option.errors))
    terminalreporter.line(f"errors: {len(SEEN.by_code)} codes seen, {len(SEEN.unseen())} not seen")
