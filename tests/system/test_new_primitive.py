"""A new primitive is one file and its name in the list: every edge has it, and what is generated is generated again.

The package is copied, the primitive is added to the copy, and real processes run from there. This is also the example
for those who add one: docs/how-to/add-a-primitive.md shows the file.
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

from dmc41x3.loops import run
from tests.rosbridge_clients import web
from tests.system.processes import CALM, done, running

pytestmark = [pytest.mark.system, pytest.mark.timeout(300)]

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "how-to" / "add-a-primitive.md"


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a copy of the project with the primitives `tap` and `rotate`, following the page."""
    copy = tmp_path_factory.mktemp("tree")
    for folder in ("src", "scripts"):
        shutil.copytree(ROOT / folder, copy / folder, ignore=shutil.ignore_patterns("__pycache__"))
    primitives = copy / "src" / "maya_un" / "robot" / "primitives"
    file, into, entry, rotate = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    (primitives / "tap.py").write_text(file, encoding="utf-8")
    listed = (primitives / "__init__.py").read_text(encoding="utf-8")
    before, after = entry.splitlines()
    assert before in listed
    last = "from maya_un.robot.primitives.primitive import Primitive\n"
    text = listed.replace(last, last + into).replace(before, after)
    (primitives / "rotate.py").write_text(rotate, encoding="utf-8")
    into = into.replace("tap", "rotate").replace("Tap", "Rotate")
    text = text.replace(last, last + into).replace("CanTeleop, Tap)", "CanTeleop, Tap, Rotate)")
    (primitives / "__init__.py").write_text(text, encoding="utf-8")
    return copy


@pytest.fixture(scope="module")
def environment(tree: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Return the environment of commands that run from the copy, with folders of their own."""
    own = tmp_path_factory.mktemp("own")
    return {
        "PYTHONPATH": str(tree / "src"),
        "MAYA_RUNTIME_DIR": str(own / "run"),
        "XDG_CONFIG_HOME": str(own),
        "XDG_STATE_HOME": str(own),
    }


@pytest.fixture(scope="module")
def rosbridge(environment: dict[str, str]) -> Iterator[str]:
    """Run a homed robot from the copy; return the address of its rosbridge."""
    with running(f"up --port 0 --rosbridge-port 0 --journal memory --speed 100 {CALM}", environment) as process:
        url = process.until("rosbridge: ").rpartition(" ")[2]
        process.until("Ctrl-C")
        assert done("home", env=environment)[0] == 0
        yield url


def python(program: str, tree: Path, environment: dict[str, str]) -> str:
    """Return what a program prints that runs from the copy."""
    paths = f"{environment['PYTHONPATH']}:{tree / 'scripts'}"
    known = {**os.environ, **environment, "PYTHONPATH": paths}
    ended = subprocess.run([sys.executable, "-c", program], env=known, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    return ended.stdout


@pytest.mark.waits("2.4 s of homing at a hundred times real speed, once for the file, through HTTP")
@pytest.mark.usefixtures("rosbridge")
def test_command_line_has_it(environment: dict[str, str]) -> None:
    code, said = done("tap --help", env=environment)
    assert (code, "Touch a taught place or x, y, z from above" in said) == (0, True)
    code, said = done("tap 0.5 1.1 0.5 --json", env=environment)
    assert code == 0, said
    assert done("tap 0.5", env=environment) == (2, "maya: error 4008: Y is missing. See `maya tap --help`.\n")


@pytest.mark.usefixtures("rosbridge")
def test_jobs_and_taught_places_have_it(environment: dict[str, str], tmp_path: Path) -> None:
    job = tmp_path / "job.json"
    job.write_text(json.dumps({"places": {"pad": [0.5, 1.1, 0.5]}, "steps": [{"tap": "pad"}, {"tap": [0.6, 1.1]}]}))
    code, said = done(f"run {job} --json", env=environment)
    assert code == 0, said


@pytest.mark.usefixtures("rosbridge")
def test_client_has_it_once_its_methods_are_generated(tree: Path, environment: dict[str, str]) -> None:
    generate = [sys.executable, str(tree / "scripts" / "gen_primitives.py")]
    known = {**os.environ, **environment}
    assert subprocess.run([*generate, "--check"], env=known, capture_output=True, check=False).returncode == 1
    assert subprocess.run(generate, env=known, capture_output=True, check=False).returncode == 0
    program = (
        "from maya_un import Client, JobBuilder; import client_page; "
        "print(Client().tap(0.5, 1.1, 0.5).state, JobBuilder().tap('pad').body()['steps']); print(client_page.page())"
    )
    said = python(program, tree, environment)
    assert said.startswith("done [{'tap': 'pad'}]\n")
    assert "Touch a taught place or x, y, z [m] from above" in said


def test_dashboard_has_its_blocks_and_asks_for_its_words(tree: Path, environment: dict[str, str]) -> None:
    generate = [sys.executable, str(tree / "scripts" / "gen_web.py")]
    assert subprocess.run(generate, env={**os.environ, **environment}, capture_output=True, check=False).returncode == 0
    said = (tree / "web" / "src" / "generated" / "primitives.ts").read_text(encoding="utf-8")
    assert 'tap: { kind: "target", key: "target", travels: true }' in said
    assert 'rotate: { kind: "switch", on: "on", off: "off", key: "on", travels: false }' in said


def test_http_describes_it(tree: Path, environment: dict[str, str]) -> None:
    said = python(
        "from maya_un.http.openapi import job_schema, task_schema; print(task_schema(), job_schema())",
        tree,
        environment,
    )
    assert said.count("'tap'") == 3  # as a task, as a step, and as the only key of a step


def test_supervisors_have_it(tree: Path, environment: dict[str, str]) -> None:
    said = python("from maya_un.coms.schemas import SCHEMAS; print(SCHEMAS['commands'])", tree, environment)
    assert said.count("'tap'") == 2


def test_graph_has_it(rosbridge: str) -> None:
    async def main() -> None:
        async with web(rosbridge) as client:
            task = {"command": "tap", "target": {"x": 0.5, "y": 1.1, "z": 0.5}}
            await client.say(
                "send_action_goal", action="/task", action_type="maya_robot/Task", id="t", args={"task": task},
                feedback=True,
            )  # fmt: skip
            phases = set()
            while (found := await client.hear())["op"] != "action_result":
                phases.add(found["values"]["phase"])
            assert found["result"], found
            assert phases <= {"approach", "down", "up"}

    run(main())


@pytest.fixture(scope="module")
def twin() -> Iterator[str]:
    """Run a twin behind a real wire; return its address."""
    with running("dmc serve --port 0") as process:
        yield process.until(":")


def output(twin: str) -> str:
    """Return what the controller says of output 2."""
    code, said = done(f"dmc send {twin} MG@OUT[2]")
    assert code == 0, said
    return said.split()[-1]


def test_rotate_switches_an_output_of_the_controller(twin: str, environment: dict[str, str], tmp_path: Path) -> None:
    config = tmp_path / "maya" / "config.toml"
    config.parent.mkdir()
    config.write_text("[controller]\noutputs = [2]\n")
    own = {**environment, "XDG_CONFIG_HOME": str(tmp_path), "MAYA_RUNTIME_DIR": str(tmp_path / "run")}
    job = tmp_path / "job.json"
    job.write_text(json.dumps({"steps": [{"rotate": "on"}, {"rotate": "off"}, {"rotate": "on"}]}))
    assert done(f"run {job} --dry-run", env=own)[0] == 0
    assert output(twin) == "0.0000"
    up = f"up --port 0 --rosbridge-port 0 --journal memory --address {twin}"
    with running(up, own) as process:
        url = process.until("rosbridge: ").rpartition(" ")[2]
        process.until("Ctrl-C")
        assert done("rotate on", env=own)[0] == 0
        assert output(twin) == "1.0000"
        task = {"command": "rotate", "open": False}
        with connect(url) as client:
            client.send(json.dumps({"op": "call_service", "service": "/maya_command", "args": {"task": task}}))
            assert json.loads(client.recv(30.0))["values"]["success"] is True
        assert output(twin) == "0.0000"
        with connect(url) as client:
            switch = {"op": "call_service", "service": "/controller/output", "args": {"number": 2, "on": True}}
            client.send(json.dumps(switch))
            assert json.loads(client.recv(30.0))["values"]["success"] is True
        assert output(twin) == "1.0000"
        called = 'call task primitive={"command":"rotate","on":false} wait=true'
        code, said = done(called, env=own)
        assert code == 0, said
        assert output(twin) == "0.0000"


def test_rotate_is_refused_where_the_configuration_lists_no_output(environment: dict[str, str], tmp_path: Path) -> None:
    job = tmp_path / "job.json"
    job.write_text(json.dumps({"steps": [{"rotate": "on"}]}))
    code, said = done(f"run {job} --dry-run", env=environment)
    assert code == 2
    assert "`controller.outputs` of the configuration lacks it" in said
