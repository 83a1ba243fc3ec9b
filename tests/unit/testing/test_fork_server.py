"""The process that forks the programs of the tests."""

from __future__ import annotations

import json
import os
import socket
from pathlib import Path

from tests.fork_server import WarmPopen

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


def _said(script: Path) -> str:
    program = WarmPopen([str(script)])
    with program.stdout:
        said = program.stdout.readall()
    assert program.wait(30.0) == 0
    return said.decode().strip()
