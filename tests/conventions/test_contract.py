"""The import contract, and the page that shows it."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

from tests.conventions.source import ROOT


def test_imports_keep_the_contract() -> None:
    # In a separate process: import-linter configures logging again, which disables every logger there is.
    command = [Path(sys.executable).with_name("lint-imports"), "--no-cache", "--no-logo"]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stdout + ended.stderr


def test_the_page_shows_the_list_that_is_enforced() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = settings["tool"]["importlinter"]["contracts"]
    page = (ROOT / "docs" / "explanation" / "architecture.md").read_text(encoding="utf-8")
    shown = dict(re.findall(r"^## (\w+)$.*?```(?:text)?\n(.*?)```", page, re.DOTALL | re.MULTILINE))
    for contract, package in (("dmc41x3-layers", "dmc41x3"), ("layers", "maya_un"), ("maya-ros-layers", "maya_ros")):
        (layers,) = [one["layers"] for one in contracts if one["id"] == contract]
        assert shown[package].splitlines() == layers
