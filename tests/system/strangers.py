"""Strangers in a ROS 2 graph: programs with a DDS of their own (`ros2_peer`), which do what a test says."""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

LOOPBACK = """<CycloneDDS><Domain>
<General><Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces></General>
<Discovery><LeaseDuration>2s</LeaseDuration>
<ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers></Discovery>
</Domain></CycloneDDS>"""
"""Nothing leaves this machine."""

PEER = Path(__file__).with_name("ros2_peer.py")


class Stranger:
    """A program with a DDS of its own."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process

    def ask(self, do: str, **values: Any) -> Any:
        """Have it do something, and return what it says."""
        answer = self.begin(do, **values)
        return answer()

    def begin(self, do: str, **values: Any) -> Any:
        """Have it do something, and return what waits for the answer."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        out = self.process.stdout
        self.process.stdin.write(json.dumps({"do": do, **values}) + "\n")
        self.process.stdin.flush()

        def said() -> Any:
            answer = json.loads(out.readline())
            assert "error" not in answer, answer
            return answer

        return said

    def carry_out(self, command: str, **task: Any) -> Any:
        """Send a goal, and return its result."""
        sent = self.ask("send", task={"command": command, **task})
        assert sent["accepted"]
        return self.ask("result", id=sent["id"])


@contextmanager
def stranger(domain: int, namespace: str = "") -> Iterator[Stranger]:
    process = subprocess.Popen(
        [sys.executable, str(PEER), *([namespace] if namespace else [])],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "ROS_DOMAIN_ID": str(domain)},
    )
    with process:
        try:
            yield Stranger(process)
        finally:
            assert process.stdin is not None
            process.stdin.close()
            process.wait(30.0)


def own_domain() -> int:
    """Return a domain that other processes of the tests do not use."""
    return random.Random(os.getpid()).randrange(100, 230)
