"""A new operation is a method and a route: OpenAPI, the Python client, `maya call` and rosbridge follow.

The package is copied, the operation is added to the copy, and real processes run from there. This is also the example
for those who add one: docs/how-to/add-an-operation.md shows both pieces.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from websockets.sync.client import connect

from tests.system.processes import CALM, done, running

pytestmark = [pytest.mark.system, pytest.mark.timeout(300)]

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "how-to" / "add-an-operation.md"
END_OF_CLASS = "    def proposes("
END_OF_ROUTES = "\n\ndef add_recovery("


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a copy of the project with the operation `hold_queue`, following the page."""
    copy = tmp_path_factory.mktemp("tree")
    for folder in ("src", "scripts"):
        shutil.copytree(ROOT / folder, copy / folder, ignore=shutil.ignore_patterns("__pycache__"))
    method, route = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    for name, before, text in (
        ("service/queueing.py", END_OF_CLASS, f"{method}\n"),
        ("http/routes/queue.py", END_OF_ROUTES, f"\n{route}"),
    ):
        file = copy / "src" / "maya_un" / name
        source = file.read_text(encoding="utf-8")
        assert source.count(before) == 1
        file.write_text(source.replace(before, text + before), encoding="utf-8")
    return copy


@pytest.fixture(scope="module")
def environment(tree: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Return the environment of commands that run from the copy, with folders of their own and the client generated."""
    own = tmp_path_factory.mktemp("own")
    known = {
        "PYTHONPATH": str(tree / "src"),
        "MAYA_RUNTIME_DIR": str(own / "run"),
        "XDG_CONFIG_HOME": str(own),
        "XDG_STATE_HOME": str(own),
    }
    generate = [sys.executable, str(tree / "scripts" / "gen_client.py")]
    everything = {**os.environ, **known}
    assert subprocess.run([*generate, "--check"], env=everything, capture_output=True, check=False).returncode == 1
    assert subprocess.run(generate, env=everything, capture_output=True, check=False).returncode == 0
    return known


@pytest.fixture(scope="module", autouse=True)
def rosbridge(environment: dict[str, str]) -> Iterator[str]:
    """Run a robot from the copy, with its queue paused; return the address of its rosbridge."""
    with running(f"up --port 0 --rosbridge-port 0 --journal memory --speed 100 {CALM}", environment) as process:
        address = process.until("rosbridge: ").split()[-1]
        process.until("Ctrl-C")
        assert done("call pause_queue", env=environment)[0] == 0
        yield address


def test_command_line_has_it(environment: dict[str, str]) -> None:
    job = '{"name":"home","steps":["home"]}'
    assert done(f"call submit job={job}", env=environment)[0] == 0
    code, said = done("call hold_queue", env=environment)
    assert code == 0, said
    assert json.loads(said)["counts"] == {"held": 1}
    code, said = done("call", env=environment)
    assert (code, "hold_queue\n    Hold all waiting jobs.\n" in said) == (0, True)


def test_python_client_has_it(environment: dict[str, str]) -> None:
    program = "from maya_un import Client; client = Client(); print(type(client.queue.hold_all()).__name__)"
    known = {**os.environ, **environment}
    ended = subprocess.run([sys.executable, "-c", program], env=known, capture_output=True, text=True, check=False)
    assert (ended.stdout, ended.stderr) == ("QueueView\n", "")


def test_rosbridge_has_it(rosbridge: str) -> None:
    called = {"operation": "hold_queue", "arguments": ""}
    with connect(rosbridge) as client:
        client.send(json.dumps({"op": "call_service", "service": "/call_operation", "args": called}))
        answer = json.loads(client.recv(30.0))
    assert (answer["result"], answer["values"]["success"]) == (True, True)
    assert json.loads(answer["values"]["result"])["mode"] == "paused"


def test_openapi_describes_it(environment: dict[str, str]) -> None:
    code, said = done("call openapi", env=environment)
    described = json.loads(said)["paths"]["/v1/queue/hold"]["post"]
    assert (code, described["operationId"], described["summary"]) == (0, "hold_queue", "Hold all waiting jobs")
