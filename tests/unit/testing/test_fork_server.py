"""The process that forks the programs of the tests."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
from pathlib import Path

import pytest

from tests.fork_server import ROOT, WarmPopen
from tests.ros.warm_nodes import FORKER

SAYS_ADDRESS = """
from tests import fork_server
print(fork_server._address.hex())
"""


def test_a_program_that_is_killed_while_it_asks_for_a_worker_ends_no_other(tmp_path: Path) -> None:
    script = tmp_path / "says_address.py"
    script.write_text(SAYS_ADDRESS)
    address = bytes.fromhex(_said(script))
    order = json.dumps({"command": [str(script)], "env": {}, "folder": str(tmp_path)}).encode()
    for answers in range(20):
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as asking, Path(os.devnull).open("r+b") as nothing:
            asking.connect(address)
            for _ in range(2):
                socket.send_fds(asking, [order], [nothing.fileno()] * 4)
            if answers % 2:
                asking.recv(16)  # and the second answer stays unread
    assert bytes.fromhex(_said(script)) == address


WAITS = """
import os, signal, sys
signal.signal(signal.SIGTERM, lambda *_: sys.exit(7))
print(os.getpid(), flush=True)
signal.pause()
"""


@pytest.mark.parametrize(("sent", "code"), [(signal.SIGTERM, 7), (signal.SIGKILL, -signal.SIGKILL)])
@pytest.mark.parametrize("to_the_program", [True, False])
def test_a_node_ends_with_its_python_and_its_python_as_the_node(
    tmp_path: Path, sent: signal.Signals, code: int, *, to_the_program: bool
) -> None:
    says, waits = tmp_path / "says_address.py", tmp_path / "waits.py"
    says.write_text(SAYS_ADDRESS)
    waits.write_text(WAITS)
    started = [ROOT / "tests" / "ros" / "warm_python", waits]
    with subprocess.Popen(started, env={**os.environ, FORKER: _said(says)}, stdout=subprocess.PIPE) as python:
        assert python.stdout is not None
        node = int(python.stdout.readline())
        assert node != python.pid
        os.kill(node if to_the_program else python.pid, sent)
        assert python.stdout.read() == b""  # the node has closed it
        assert python.wait(30.0) == code


def _said(script: Path) -> str:
    program = WarmPopen([str(script)])
    with program.stdout:
        said = program.stdout.readall()
    assert program.wait(30.0) == 0
    return said.decode().strip()
