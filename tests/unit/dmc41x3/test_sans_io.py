"""The protocol can be loaded, and so used, without anything that could do I/O or wait."""

from __future__ import annotations

import subprocess
import sys

import pytest

MODULES = [
    *(f"language.{name}" for name in ("arrays", "burned", "codes", "commands", "numbers", "program", "record")),
    "wire.framing",
]


@pytest.mark.parametrize("module", MODULES)
def test_a_protocol_module_brings_no_io(module: str) -> None:
    code = f"import dmc41x3.{module}, sys; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert not {"asyncio", "socket", "selectors", "numpy", "pydantic"} & set(loaded)
