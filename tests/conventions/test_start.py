"""The command line starts fast: what is typed most often imports next to nothing."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

HEAVY = [
    "asyncio",
    "fastapi",
    "httpx",
    "matplotlib",
    "maya_un.controller",
    "maya_un.kinematics",
    "maya_un.virtual",
    "numpy",
    "pydantic",
    "rich",
    "scipy",
    "uvicorn",
    "yaml",
]
PROGRAM = """
import json, sys
from maya_un.cli.main import main
sys.argv[0] = "maya"
try:
    main()
except SystemExit:
    pass
print(json.dumps(sorted(sys.modules)), file=sys.stderr)
"""


@pytest.mark.parametrize("word", ["--help", "--version", "status", "stop"])
def test_a_frequent_word_imports_nothing_heavy(word: str, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, word],
        env={**os.environ, "MAYA_RUNTIME_DIR": str(tmp_path), "XDG_RUNTIME_DIR": str(tmp_path)},
        capture_output=True,
        text=True,
        check=True,
    )
    imported: list[str] = json.loads(done.stderr.splitlines()[-1])
    assert [name for name in HEAVY if name in imported] == []
