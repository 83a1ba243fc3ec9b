"""A pytest plugin that searches all that the tests wrote for the secrets that they used.

A test makes its passwords and keys with `secret`. After the last test, no file in the folders of the tests (logs,
recordings, histories, databases) may hold one, except the files that exist to keep it. `tests.system.processes` looks
at command lines, and at all that a command printed.
"""

from __future__ import annotations

import mmap
from collections.abc import Iterator
from pathlib import Path

import pytest

MARK = "tell-nobody"
"""Is in every secret, as it is, so that a search finds it."""

KEEPERS = {".secret", "flows_cred.json"}
"""Ends the name of a file that exists to keep a secret; `flows_cred.json` is Node-RED's."""

FOUND = pytest.StashKey[list[str]]()


def secret(name: str) -> str:
    """Return a secret that only its user and the server may know."""
    return f"{name}-{MARK}"


def files_with_secrets(folder: Path) -> Iterator[Path]:
    """Find the regular files below a folder that hold a secret and do not exist to keep it."""
    for path in sorted(folder.rglob("*")):
        if path.is_symlink() or not path.is_file() or path.name.endswith(tuple(KEEPERS)) or path.stat().st_size == 0:
            continue
        with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
            if content.find(MARK.encode()) >= 0:
                yield path


@pytest.hookimpl(tryfirst=True)
def pytest_sessionfinish(session: pytest.Session) -> None:
    """Search, in the process that sums up, before pytest removes a folder."""
    config = session.config
    if hasattr(config, "workerinput") or config.option.collectonly:
        return
    folder: Path = config._tmp_path_factory.getbasetemp()  # type: ignore[attr-defined]
    config.stash[FOUND] = [str(path.relative_to(folder)) for path in files_with_secrets(folder)]
    if config.stash[FOUND]:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Name the files that hold a secret."""
    if found := config.stash.get(FOUND, []):
        terminalreporter.section("secrets found in what the tests wrote")
        for path in found:
            terminalreporter.line(path)
