"""`maya down`: end the running `maya up`, and wait for its end."""

from __future__ import annotations

import os
import select
import signal

from dmc41x3.i18n import translate
from maya_un import runtime
from maya_un.cli import output
from maya_un.cli.settings import OutputSettings
from maya_un.errors import ServiceNotRunning


def down(settings: OutputSettings, *, finish: bool) -> int:
    """End it as Ctrl-C would, or with `finish` after the running step; return when it has ended.

    Raises `ServiceNotRunning`.
    """
    pid = runtime.claimant()
    if pid is None:
        raise ServiceNotRunning
    try:
        process = os.pidfd_open(pid)  # refers to this process only, even if its pid is reused
    except ProcessLookupError:
        raise ServiceNotRunning from None
    try:
        signal.pidfd_send_signal(process, signal.SIGUSR1 if finish else signal.SIGTERM)
        if not settings.json:
            output.say(translate("Asked `maya up` to end; waiting for it.", settings.language))
        select.select([process], [], [])
    except ProcessLookupError:
        pass
    finally:
        os.close(process)
    return output.answer({"pid": pid, "ended": True}, translate("`maya up` has ended.", settings.language), settings)
