"""Node ros_coms: the link to supervisors, which is `maya coms`; roslaunch's own arguments are not for it."""

import sys

from maya_un.cli.main import main

if __name__ == "__main__":
    raise SystemExit(main(["coms", *(word for word in sys.argv[1:] if ":=" not in word)]))
