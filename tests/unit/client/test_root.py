"""The package's root has the client without loading it."""

from __future__ import annotations

import subprocess
import sys

import pytest

import maya_un


def test_root_stays_light_until_the_client_is_used() -> None:
    program = (
        "import sys, maya_un; "
        "heavy = {'httpx', 'numpy', 'pydantic', 'asyncio', 'websockets', 'matplotlib'}; "
        "print(sorted(heavy & set(sys.modules))); maya_un.Client; "
        "print('httpx' in sys.modules, 'matplotlib' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\nTrue False\n"


def test_root_lists_its_names() -> None:
    assert {"AsyncClient", "Client", "JobBuilder", "__version__"} <= set(dir(maya_un))
    assert maya_un.Client.__name__ == "Client"
    with pytest.raises(AttributeError, match="no attribute 'Nothing'"):
        maya_un.__getattr__("Nothing")  # type: ignore[attr-defined]
