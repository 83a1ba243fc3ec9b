"""`maya` tied to its parent process: at the end of standard input, it ends as after SIGTERM.

For programs that start a robot and may be killed: `python -m maya_un.cli.parent_watch up`.
"""

from __future__ import annotations

import os
import signal
import sys
import threading

from maya_un.cli.main import program


def _end_with_the_other_side() -> None:
    while sys.stdin.buffer.read(4096):
        pass
    os.kill(os.getpid(), signal.SIGTERM)


def attended() -> int:
    """Carry out the command line until it ends, or until standard input ends."""
    threading.Thread(target=_end_with_the_other_side, name="attendance", daemon=True).start()
    return program()


if __name__ == "__main__":
    sys.exit(attended())
