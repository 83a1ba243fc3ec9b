"""The constants of the configuration that this machine has, for programs under any Python."""

from __future__ import annotations

import json
import subprocess
from typing import Any

from maya_controller import nodes_python

_MODULE = "maya_un.ros.constants"


def constants() -> dict[str, Any]:
    """Return the constants by the manual's names, as the configuration has them now.

    maya_un may need a newer Python than the caller's, or one with other packages; so its own is asked. Raises
    ImportError where that Python, or the configuration, is no good.
    """
    try:
        told = subprocess.run([nodes_python.PATH, "-m", _MODULE], capture_output=True, text=True, check=True)
    except subprocess.CalledProcessError as error:
        raise ImportError(f"the constants cannot be read: {error.stderr.strip()}") from error
    except OSError as error:
        raise ImportError(f"the Python of Maya's nodes does not run: {error}") from error
    return json.loads(told.stdout)
