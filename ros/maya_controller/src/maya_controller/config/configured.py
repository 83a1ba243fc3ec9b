"""The constants of the configuration that this machine has, for programs under any Python.

If Maya is not installed with these packages (a computer that has the messages alone), the constants are the defaults,
and a warning is given.
"""

from __future__ import annotations

import json
import subprocess
import warnings
from typing import Any

from maya_controller.config import defaults

_MODULE = "maya_ros.ros1.constants"


def constants() -> dict[str, Any]:
    """Return the constants by the manual's names, from the present configuration.

    maya_un may need a newer Python than the caller's, or other packages, so its Python prints the constants. Raises
    ImportError if the configuration is invalid.
    """
    try:
        from maya_controller import nodes_python  # noqa: PLC0415 - only a built workspace has it

        told = subprocess.run([nodes_python.PATH, "-m", _MODULE], capture_output=True, text=True, check=False)
    except (ImportError, OSError) as error:
        return _unconfigured(str(error))
    if told.returncode != 0 and "No module named 'maya_ros'" in told.stderr:
        return _unconfigured("its Python has no module maya_ros")
    if told.returncode != 0:
        raise ImportError(f"the constants cannot be read: {told.stderr.strip()}")
    return json.loads(told.stdout)


def _unconfigured(reason: str) -> dict[str, Any]:
    """Return the default constants, and warn of it."""
    warnings.warn(
        f"Maya is not installed here ({reason}). The constants are defaults, not those of the robot's configuration",
        stacklevel=4,
    )
    return dict(defaults.VALUES)
