"""The notebook that a student starts from: run from its first cell to its last, it shows what is stored in it."""

from __future__ import annotations

import subprocess
import sys

import nbformat
import pytest

from tests.conventions.source import ROOT

NOTEBOOKS = sorted((ROOT / "docs").rglob("*.ipynb"))


@pytest.mark.waits("2.4 s of homing at a hundred times real speed at least, as a kernel of Jupyter lives in real time")
@pytest.mark.system
@pytest.mark.timeout(300)
def test_notebooks_show_their_stored_output() -> None:
    check = subprocess.run(
        [sys.executable, ROOT / "scripts" / "notebooks.py", "--check"], capture_output=True, text=True, check=False
    )
    assert check.returncode == 0, check.stdout + check.stderr


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_was_stored_after_a_whole_run_without_an_error(path: str) -> None:
    cells = [cell for cell in nbformat.read(path, as_version=4).cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in cells] == list(range(1, len(cells) + 1))
    assert not [output for cell in cells for output in cell.outputs if output.output_type == "error"]
    assert any("image/svg+xml" in output.get("data", ()) for cell in cells for output in cell.outputs)
