"""Runs the notebooks of docs/ and stores what they show.

With --check it stores nothing and says where a notebook shows something else than is stored, numbers aside: some of
them are measured.
"""

from __future__ import annotations

import difflib
import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import nbformat
from nbclient import NotebookClient

DOCS = Path(__file__).resolve().parent.parent / "docs"

OWN_PLACES = ("XDG_CONFIG_HOME", "XDG_STATE_HOME", "XDG_RUNTIME_DIR")
"""Variables that name the folders of a user's files."""

PATIENCE = 120
"""Longest wait for one cell [s]."""

_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")
_PLACE = re.compile(r"(?<![\w.<:/])/(?:home|root|tmp|usr|var|work|opt|Users)/\S*")


def main(arguments: list[str]) -> int:
    """Run all notebooks and store or check what they show; return 1 where a check found a difference."""
    stale = False
    for path in sorted(DOCS.rglob("*.ipynb")):
        stored = nbformat.read(path, as_version=4)
        executed = run(path)
        if "--check" in arguments:
            found = [
                *differences(stored, executed),
                *(f"names a place of this computer: {at}" for at in places(stored)),
            ]
            for line in found:
                print(f"{path.relative_to(DOCS.parent)}: {line}")
            stale = stale or bool(found)
        else:
            nbformat.write(executed, path)
            print(path.relative_to(DOCS.parent))
    if stale:
        print("run scripts/notebooks.py")
    return 1 if stale else 0


def run(path: Path) -> Any:
    """Return a notebook as it is after all its cells have been run, without what depends on when that was."""
    notebook = nbformat.read(path, as_version=4)
    client = NotebookClient(notebook, timeout=PATIENCE, kernel_name="python3", coalesce_streams=True)
    with TemporaryDirectory() as folder:  # the user's poses and configuration would change what is shown
        client.execute(cwd=str(path.parent), env={**os.environ, **dict.fromkeys(OWN_PLACES, folder), "MAYA_CONFIG": ""})
    for cell in notebook.cells:
        cell.metadata.clear()
        for output in cell.get("outputs", ()):
            _keep_the_richest(output)
    notebook.metadata = {"kernelspec": notebook.metadata["kernelspec"], "language_info": {"name": "python"}}
    return notebook


def _keep_the_richest(output: Any) -> None:
    """Leave out what a message is as text where it is shown as a table or a picture."""
    if len(output.get("data", ())) > 1:
        output.data.pop("text/plain", None)


def differences(stored: Any, executed: Any) -> Iterator[str]:
    """Yield where two runs of a notebook show something else, numbers and pictures aside."""
    for one, other in zip(stored.cells, executed.cells, strict=True):
        before, after = shown(one), shown(other)
        if before != after:
            yield f"{one.id} shows something else than is stored"
            yield from difflib.unified_diff(before, after, "stored", "now", lineterm="")


def shown(cell: Any) -> list[str]:
    """Return what a cell shows as lines: text with # for each number, and that there is a picture."""
    lines: list[str] = []
    for output in cell.get("outputs", ()):
        if output.output_type == "stream":
            lines += output.text.splitlines()
        elif output.output_type == "error":
            lines.append(f"{output.ename}: {output.evalue}")
        else:
            lines += _data(output.data)
    return [_NUMBER.sub("#", line) for line in lines]


def _data(data: Any) -> Iterator[str]:
    if "image/svg+xml" in data:
        yield "a picture"
    elif "text/html" in data:
        yield from data["text/html"].replace("<tr>", "\n").splitlines()
    else:
        yield from data["text/plain"].splitlines()


def places(notebook: Any) -> Iterator[str]:
    """Yield where a notebook shows an absolute path, which means something on one computer only."""
    for cell in notebook.cells:
        for output in cell.get("outputs", ()):
            yield from (f"{cell.id} names a place of one computer: {place}" for place in _PLACE.findall(str(output)))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
