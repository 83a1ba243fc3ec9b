"""A pytest plugin that searches all that the tests wrote for the secrets that they used.

A test makes its passwords and keys with `secret`. After the last test, no file in the folders of the tests (logs,
recordings, histories, databases) may hold one, except the files that exist to keep it. `tests.system.processes` looks
at command lines, and at all that a command printed.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

MARK = "tell-nobody"
"""Is in every secret, as it is, so that a search finds it."""

KEEPERS = {".secret", "flows_cred.json"}
"""Ends the name of a file that exists to keep a secret; `flows_cred.json` is Node-RED's."""

PIECE = 1 << 20
"""Size of a piece of a file that is read at once [bytes]."""

FOUND = pytest.StashKey[list[str]]()


def secret(name: str) -> str:
    """Return a secret that only its user and the server may know."""
    return f"{name}-{MARK}"


def files_with_secrets(folder: Path) -> Iterator[Path]:
    """Find the regular files below a folder that hold a secret and do not exist to keep it."""
    for path in sorted(folder.rglob("*")):
        if path.is_symlink() or not path.is_file() or path.name.endswith(tuple(KEEPERS)):
            continue
        with suppress(FileNotFoundError):  # a program that a test ended may remove its files until now
            if _holds(path, MARK.encode()):
                yield path


def _holds(path: Path, mark: bytes) -> bool:
    """Return whether a file holds some bytes. It is read: a mapped file that a program cuts short ends the process."""
    before = b""
    with path.open("rb") as file:
        while piece := file.read(PIECE):
            if mark in before + piece:
                return True
            before = (before + piece)[-len(mark) :]
    return False


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
