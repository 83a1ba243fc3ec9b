"""The constants of the configuration that this machine has, for programs under Python 2.7 and 3.

If Maya is not installed with these packages (a computer that has the messages alone), the constants are the defaults,
and a warning is given.
"""

import json
import subprocess
import warnings

from maya_controller.config import defaults

_MODULE = "maya_ros.ros1.constants"


def constants():
    """Return the constants by the manual's names, from the present configuration.

    maya_un may need a newer Python than the caller's, or other packages, so its Python prints the constants. Raises
    ImportError if the configuration is invalid.
    """
    try:
        from maya_controller import nodes_python  # only a built workspace has it

        process = subprocess.Popen(
            [nodes_python.PATH, "-m", _MODULE],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            universal_newlines=True,
        )
    except (ImportError, OSError) as error:
        return _unconfigured(str(error))
    values, reason = process.communicate()
    if process.returncode != 0 and "No module named 'maya_ros'" in reason:
        return _unconfigured("its Python has no module maya_ros")
    if process.returncode != 0:
        raise ImportError("the constants cannot be read: {}".format(reason.strip()))
    return json.loads(values)


def _unconfigured(reason):
    """Return the default constants, and warn of it."""
    message = "Maya is not installed here ({}). The constants are defaults, not those of the robot's configuration"
    warnings.warn(message.format(reason), stacklevel=4)
    return dict(defaults.VALUES)
