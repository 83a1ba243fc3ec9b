"""The protocol can be loaded, and so used, without anything that could do I/O or wait."""

from __future__ import annotations

import subprocess
import sys
from pkgutil import iter_modules

import pytest

from dmc41x3 import language

MODULES = [*(f"language.{module.name}" for module in iter_modules(language.__path__)), "wire.framing"]


@pytest.mark.parametrize("module", MODULES)
def test_a_protocol_module_brings_no_io(module: str) -> None:
    code = f"import dmc41x3.{module}, sys; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert not {"asyncio", "socket", "selectors", "numpy", "pydantic"} & set(loaded)
