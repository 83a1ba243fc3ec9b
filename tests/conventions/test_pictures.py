"""The pictures of the documentation are what the code draws, and the check of it sees what matters."""

from __future__ import annotations

import os
import runpy
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.conventions.source import ROOT

IMAGES = ROOT / "docs" / "images"
PROFILES = ("clients", "coms-mqtt", "coms-rtdb", "dry-run", "long-job", "ros2-service", "viewer")
OTHERS = {"terminal.svg", *(f"flame-{name}.svg" for name in PROFILES)}
"""Drawn by scripts that need a terminal, or a profile."""

SVG = (
    '<svg><text x="10.5">axis a</text><path id="m1f" d="M 1 2.25 L 3 4"/><use href="#m1f" clip-path="url(#p0)"/></svg>'
)


@pytest.fixture(scope="module")
def script() -> dict[str, Any]:
    sys.path.insert(0, str(ROOT / "scripts"))
    try:
        return runpy.run_path(str(ROOT / "scripts" / "draw_docs.py"))
    finally:
        sys.path.remove(str(ROOT / "scripts"))


def test_the_pictures_are_current_in_whatever_order_sets_are() -> None:
    command = [sys.executable, str(ROOT / "scripts" / "draw_docs.py"), "--check"]
    environment = os.environ | {"PYTHONHASHSEED": "1"}  # that of the other tests is 0
    check = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert check.returncode == 0, check.stdout + check.stderr


def test_every_picture_is_drawn_by_the_script_and_shown_on_a_page(script: dict[str, Any]) -> None:
    pictures = {path.name for path in IMAGES.glob("*.svg")}
    assert pictures == set(script["PICTURES"]) | OTHERS
    pages = [*(ROOT / "docs").rglob("*.md"), ROOT / "README.md"]
    text = "".join(page.read_text(encoding="utf-8") for page in pages)
    assert [name for name in pictures if f"images/{name}" not in text] == []


@pytest.mark.parametrize(
    ("change", "equal"),
    [
        (("2.25", "2.255"), True),
        (("m1f", "m77"), True),
        (("2.25", "2.5"), False),
        (("axis a", "axis b"), False),
        ((" L 3 4", ""), False),
        ((" L 3 4", " L 3 4 L 5 6"), False),
    ],
)
def test_only_rounding_is_no_difference(script: dict[str, Any], change: tuple[str, str], equal: bool) -> None:
    assert script["same"](SVG, SVG)
    assert script["same"](SVG, SVG.replace(*change)) is equal


def test_stale_picture_is_named_and_drawn_again(
    script: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    name = "mechanism-forces.svg"
    monkeypatch.setitem(script["main"].__globals__, "IMAGES", tmp_path)
    assert script["main"]([name, "--check"]) == 1
    assert capsys.readouterr().out == f"docs/images/{name} is not current: run scripts/docs\n"
    assert script["main"]([name]) == 0
    assert (tmp_path / name).read_text(encoding="utf-8") == (IMAGES / name).read_text(encoding="utf-8")
    assert script["main"]([name, "--check"]) == 0
