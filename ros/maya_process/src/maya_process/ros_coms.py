"""ros_coms: start `maya coms`, the link to supervisors, without the arguments that roslaunch adds."""

from __future__ import annotations

import sys

from maya_ros.ros1.nodes.rosbridge import settle_environment
from maya_un.cli.main import main
from maya_un.errors import MayaError


def serve(arguments: list[str]) -> int:
    """Serve until the program must end; return the exit code."""
    if not {"--rosbridge", "--help", "-h"} & set(arguments):
        try:
            settle_environment()
        except MayaError as error:
            print(f"maya: error {error.code}: {error}", file=sys.stderr)
            return 2
    return main(["coms", *arguments])


if __name__ == "__main__":
    raise SystemExit(serve([word for word in sys.argv[1:] if ":=" not in word]))
