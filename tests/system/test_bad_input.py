"""Bad input, everywhere a person can put it: a sentence with a code, and not one byte to the controller."""

from __future__ import annotations

import asyncio
import json
import os
import re
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from http.client import HTTPConnection
from pathlib import Path
from queue import SimpleQueue
from typing import NamedTuple

import pytest

from dmc41x3.loops import JumpingLoop, run_virtual
from maya_un import runtime
from maya_un.assembly.stack import stack
from maya_un.cli.main import main
from maya_un.config import Config
from maya_un.http.app import create_app
from maya_un.http.bridge import Bridge
from maya_un.http.sockets import bound_socket
from maya_un.http.thread import served

pytestmark = pytest.mark.system


class Robot(NamedTuple):
    """A homed robot on the twin with its HTTP interface, and all commands to its controller."""

    url: str
    wire: list[bytes]


class _Ready(NamedTuple):
    robot: Robot
    loop: asyncio.AbstractEventLoop
    end: asyncio.Event


async def _live(ready: SimpleQueue[_Ready]) -> None:
    """Home in virtual time, then serve with the clock at rest: refusals need no time."""
    loop, end, wire = asyncio.get_running_loop(), asyncio.Event(), list[bytes]()
    assert isinstance(loop, JumpingLoop)
    async with stack(Config(), live=False) as running:
        assert running.twin is not None
        await running.service.command({"command": "gripper", "open": True})
        await running.service.command({"command": "home"})
        running.twin.controller.tap = lambda _, way, data: wire.append(data) if way == "rx" else None
        with loop.external(), bound_socket(0) as listener:
            async with served(create_app(Bridge(loop, running.service)), listener) as url:
                ready.put(_Ready(Robot(url, wire), loop, end))
                await end.wait()


@pytest.fixture(scope="module")
def robot() -> Iterator[Robot]:
    ready: SimpleQueue[_Ready] = SimpleQueue()
    thread = threading.Thread(target=lambda: run_virtual(_live(ready)))
    thread.start()
    found = ready.get(timeout=30.0)
    yield found.robot
    found.loop.call_soon_threadsafe(found.end.set)
    thread.join()


@pytest.fixture
def found(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> Robot:
    """Have commands find the robot."""
    monkeypatch.setattr(runtime, "find", lambda: runtime.Running(robot.url, os.getpid(), None))
    monkeypatch.setattr(runtime, "claimant", os.getpid)
    return robot


def refused(line: list[str], code: int, capsys: pytest.CaptureFixture[str]) -> None:
    """Run a command line and check that it ends as bad input must."""
    assert main(line) != 0
    captured = capsys.readouterr()
    last = captured.err.strip().splitlines()[-1]
    assert last.startswith(f"maya: error {code}: ")
    assert last.endswith((".", "`"))
    assert "Traceback" not in captured.err + captured.out


REQUESTS = [
    ("pick nan 1.2", 4001),
    ("pick 0.5 inf", 4001),
    ("pick 0.5 1e999", 4001),
    ("pick 0.5 12parsec", 4001),
    ("pick 0.5 30deg", 4001),
    ("pick 0.5 1,2", 4001),
    ("pick x y z", 4001),
    ("pick 0.5", 4008),
    ("pick 0.5 1.2 0.4 0.1", 4008),
    ("pick 0 5 1", 2101),
    ("pick 0.5 1.2 -3", 2101),
    ("pick 500 1200 400", 4001),
    ("pick 0.5 1.2 2.2", 2101),
    ("pick -0.5 1.2", 2101),
    ("pick 0 0", 2101),
    ("place 0.5 1.2", 3002),
    ("place 1e300 1 1", 4001),
    ("approach 0.5 1.2", 4008),
    ("approach 0.5 1.2 3", 2101),
    ("approach 0.5 1.2 --", 4008),
    ("move 0.5 1.5", 4008),
    ("move 30mm 1.5 1.5", 4001),
    ("move 400deg 1.5 1.5", 2101),
    ("move 0.5 5 5", 2101),
    ("move 0.5 0.6 0.6", 2101),
    ("move 30 1.5 1.5", 4001),
    ("jog x 0.5", 4001),
    ("jog a 5", 4001),
    ("jog d 1", 4003),
    ("jog a 10mm", 4001),
    ("jog b 5deg", 4001),
    ("jog b nan", 4001),
    ("jog z 5deg", 4001),
    ("line 0.5 1.2", 4008),
    ("line 5 5 0.4", 2101),
    ("speed 0", 4001),
    ("speed 150%", 4001),
    ("gripper ajar", 4008),
    ("gripper", 4008),
    ("home now", 4008),
    ("home --fast", 4008),
    ("dance", 4008),
    ("recover", 2108),
    ("recover me", 4008),
    ("stop all", 4008),
    ("status --verbose", 4008),
    ("--lang fr status", 4001),
    ("status --lang", 4008),
]


@pytest.mark.parametrize(("line", "code"), REQUESTS, ids=[line for line, _ in REQUESTS])
def test_commands(line: str, code: int, found: Robot, capsys: pytest.CaptureFixture[str]) -> None:
    before = len(found.wire)
    refused(line.split(), code, capsys)
    assert found.wire[before:] == []


JOBS = {
    "not a mapping": ("- home", 4002),
    "not YAML": ("steps: [", 4007),
    "no steps": ("name: x", 4002),
    "empty steps": ("steps: []", 4002),
    "unknown key": ("steps: [home]\nspeed: 3", 4002),
    "unknown step": ("steps: [dance]", 4002),
    "unknown command": ("steps: [{fetch: cube}]", 4002),
    "two commands in a step": ("steps: [{pick: [1, 1], place: [1, 1]}]", 4002),
    "unknown name": ("steps: [{pick: cube}]", 4003),
    "place with four numbers": ("parts: {cube: [1, 2, 3, 4]}\nsteps: [home]", 4002),
    "place of words": ("places: {tray: [here, there]}\nsteps: [home]", 4002),
    "not a number": ("steps: [{pick: [.nan, 1]}]", 4002),
    "endless": ("steps: [{approach: [.inf, 1, 1]}]", 4002),
    "no repeat": ("steps: [home]\nrepeat: 0", 4002),
    "repeat by half": ("steps: [home]\nrepeat: 1.5", 4002),
    "repeat for ever": ("steps: [home]\nrepeat: 1000000", 4002),
    "gripper ajar": ("steps: [{gripper: ajar}]", 4002),
    "move without c": ("steps: [{move: {a: 1, b: 1}}]", 4002),
    "key twice": ("steps: [home]\nsteps: [home]", 4007),
    "part and place of one name": ("parts: {x: [1, 1]}\nplaces: {x: [1, 1]}\nsteps: [home]", 4002),
    "code in YAML": ("steps: !!python/object/apply:os.getcwd []", 4007),
}


@pytest.mark.parametrize(("text", "code"), JOBS.values(), ids=JOBS)
def test_jobs(text: str, code: int, found: Robot, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "job.yaml").write_text(text)
    before = len(found.wire)
    refused(["run", "job.yaml"], code, capsys)
    assert found.wire[before:] == []


CONFIGS = {
    "not TOML": ("[cell", 4007),
    "unknown section": ("[tower]\nheight = 1", 5001),
    "unknown key": ("[cell]\nclearence = 0.1", 5001),
    "millimetres": ("[geometry]\nheight = 2350", 5001),
    "degrees": ("[axes.a]\nmaximum = 120", 5001),
    "not finite": ("[geometry]\ndelta = nan", 5001),
    "a word": ('[geometry]\ndelta = "far"', 5001),
    "impossible geometry": ("[geometry]\ndelta = 2.4", 5001),
    "one letter twice": ('[axes.a]\nletter = "B"', 5001),
    "dropping the load": ("[safety]\nself_locking = false\noff_on_error = 1", 5001),
}


@pytest.mark.parametrize(("text", "code"), CONFIGS.values(), ids=CONFIGS)
@pytest.mark.parametrize("line", ["config check c.toml", "ik 0.5 1.2 0.4 --config c.toml"])
def test_configurations(line: str, text: str, code: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "c.toml").write_text(text)
    refused(line.split(), code, capsys)


MISTAKES = [
    ("pick 500 1200 400", "for mm write 500 mm"),
    ("place 500mm 1200mm 400", "z = 400 .* write 400 mm"),
    ("approach 0.5 1.2 400", "write 400 mm"),
    ("line 500 300 400", "write 500 mm"),
    ("reach 500 300 400", "write 500 mm"),
    ("ik 0.5 1200 0.4", "y = 1200 .* write 1200 mm"),
    ("pick 1e3 1.2", "write 1e3 mm"),
    ("move 120 1.5 1.5", "for deg write 120 deg"),
    ("fk 120 1.5 1.5", "write 120 deg"),
    ("fk 0.5 1500 1.5", "b = 1500 .* write 1500 mm"),
    ("move 30mm 1.5 1.5", "a number in rad, or with rad, mrad or deg"),
    ("move 0.5 1.5rad 1.5", "a number in m, or with m, cm, mm or um"),
    ("line 0.5 1.2 0.4rad", "a number in m, or with"),
    ("pick 0.5 30deg", "y = '30deg' .* a length"),
    ("pick 0,5 1.2", "a decimal number has a point: write 0.5"),
    ("pick 0.5 1,25m", "write 1.25m"),
    ("speed 0,5", "write 0.5"),
    ("pick 1/2 1.2", "a length is a number"),
    ("pick 0.5 1.2in", "m, cm, mm or um"),
    ("pick 0.5 1.2 −0.4", "a length is a number"),
    ("pick x=0.5 y=1.2", "x = 'x=0.5'"),
    ("pick cube", "There is no 'cube'"),
    ("pick 0.5 1.2 0.4 foot", "extra argument.*foot"),
    ("jog x 0.5", "write 0.5 m or 0.5 mm"),
    ("jog x 100", "write 100 mm"),
    ("jog a 5", "write 5 rad or 5 deg"),
    ("jog a 30", "write 30 deg"),
    ("jog a 10mm", "an angle is a number"),
    ("jog b 5deg", "a length is a number"),
    ("jog q 10mm", "a, b, c, x, y, z, r"),
    ("jog 10mm x", "a, b, c, x, y, z, r"),
    ("jog x", "DISTANCE is missing"),
    ("speed 50", "for percent write 50%"),
    ("speed 150%", "at most 1"),
    ("speed 0", "at least 0.01"),
    ("speed half", "or with % behind it"),
    ("gripper opened", "'open', 'close'"),
    ("gripper 50%", "'open', 'close'"),
    ("home --speed 50", "No such option: --speed"),
    ("run job.yaml --dryrun", "--dry-run"),
    ("run job.yaml --speed 50%", "'50%' is not a number"),
    ("run job.yaml --seed one", "'one' is not a whole number"),
    ("job cancel 1st", "'1st' is not a whole number"),
    ("job show", "Missing argument 'JOB'"),
    ("stauts", "'status'"),
    ("sotp", "'stop'"),
    ("hmoe", "'home'"),
    ("zone add", "'zones'"),
    ("run nowhere.yaml", "No such file"),
    ("run .", "Is a directory"),
    ("config check nowhere.toml", "No such file"),
    ("up --address 192.168.1", "like 192.168.1.20"),
    ("up --address http://192.168.1.20", "without http://"),
    ("up --address 192.168.1.20:http", "1 to 65535"),
    ("up --port 0 --address /dev/nothing", "`dmc find` lists the ports"),
    ("up --port 70000", "0<=x<=65535"),
    ("up --port http", "not a whole number"),
    ("up --speed 0", "above 0 and at most 1000"),
    ("up --speed 20 --address 192.168.1.20", "Omit `--speed`"),
    ("up --listen 0.0.0.0", "--tls-cert and --tls-key"),
    ("up --truth nowhere.toml", "No such file"),
    ("dmc send 192.168.1 TP", "like 192.168.1.20"),
    ("dmc fault lattency", "Known: latency"),
    ("dmc fault latency seconds=fast", "a number from 0 to 60 s"),
    ("dmc fault latency delay=1", "jitter, seconds"),
    ("dmc assign 192.168.1 192.168.1.20", "like 00:50:4C"),
    ("replay nowhere.db", "no recording"),
    ("user add ana --role boss", "'student', 'operator', 'admin'"),
    ("--lang fr status", "one of en, es"),
    ("--units inch status", "one of mm, si"),
    ("datum give 500 1.2 1.2", "write 500 deg"),
    ("datum move a 5", "5 rad or 5 deg"),
    ("logs --since yesterday", "like 10m or 2h"),
]
"""Command lines with a mistake, and what the answer must name: mostly the right form."""

JOB_MISTAKES = [
    ("steps: [{pick: [500, 1200, 400]}]", "line 1, column 10.*write 500 mm"),
    ("places: {tray: [500, 300, 400]}\nsteps: [{line: tray}]", "places.tray.*write 500 mm"),
    ("steps: [{move: {a: 30, b: 1.5, c: 1.5}}]", "write 30 deg"),
    ("steps: [{move: {a: 0.5, b: 1500, c: 1500}}]", "write 1500 mm"),
    ("steps: [{move: {a: 0.5, b: 1.5 rad, c: 1.5}}]", "a length is a number in m"),
    ("steps: [{pick: ['0,5', 1.2]}]", "write 0.5"),
    ("steps: [{pick: [0,5, 1,2]}]", r"\[x, y\] or \[x, y, z\]"),
    ("steps: [{pick: [20 in, 1.2]}]", "m, cm, mm or um"),
    ("steps: [{line: [0.5, 1.2, 0.4], speed: 50}]", "write 50%"),
    ("steps: [{line: [0.5, 1.2, 0.4], speed: slow}]", "or with % behind it"),
    ("steps: [{wait: 500 ms}]", "s, min, h or d"),
    ("steps: [{wait: -1 s}]", "more than 0 s"),
    ("steps: [{set: {output: 99, on: true}}]", "between 1 and 8"),
    ("steps: [{if: {input: 1}}]", "like {input: 3, is: on}"),
    ("steps: [{home: {speed: 50}}]", "write `- home`"),
    ("steps: [{pik: [0.5, 1.2]}]", "known are home, pick"),
    ("step: [home]", "error at step .*known are .*steps"),
    ("parts: {cube: [0.5, 1.2]}\nsteps: [{pick: cubo}]", "Known: cube"),
    ("steps: [{gripper: opened}]", "'open', 'close'"),
    ("steps: [home]\nrepeat: -1", "line 2.*between 1 and 10000"),
    ("steps:\n\t- home", "line begins with a tab"),
    ("steps: home", "must be a list"),
    ('{"steps": ["home"', "line 1"),
    ("steps: [{pick: 2026-11-27}]", r"\[x, y\]"),
    ("steps: [{wait_for: 1}]", "a mapping with input, is, within"),
    ("steps: [{set: 3}]", "a mapping with output, to"),
    ("pallets: {tray: 3}\nsteps: [home]", "a mapping with corners, rows, columns"),
]
"""Jobs with a mistake, and what the answer must name."""

CONFIG_MISTAKES = [
    ("[geometry]\nheight = 2350", "line 2.*write 2350 mm"),
    ('[geometry]\nheight = "2350"', "a text like 30 mm"),
    ("[geometry]\nheight = 2350 mm", 'line 2: write height = "2350 mm"'),
    ("[safety]\noff_on_error = 0xFF\n[cell", "not TOML"),
    ("[geometry]\nheight = 2,35", r"line 2: write height = 2\.35\."),
    ('[geometry]\nheight = "2,35 m"', "write 2.35 m"),
    ("[axes.a]\nmaximum = 120", "write 120 deg"),
    ('[axes.a]\nmaximum = "120 mm"', "an angle is a number"),
    ('[axes.b]\nmaximum = "120 deg"', "a length is a number"),
    ("[axes.b]\nmaximum = 2400", "write 2400 mm"),
    ("[geometry]\nheigth = 2.35", "perhaps height"),
    ("[geometri]\nheight = 2.35", "perhaps geometry"),
    ('[axes.a]\nletter = "X"', "'A', 'B', 'C'"),
    ('[axes.a]\nswitches = "left"', "'both', 'minimum', 'maximum', 'none'"),
    ('[safety]\nself_locking = "yes"', "true or false"),
    ("[axes.b]\nminimum = 2.0\nmaximum = 0.5", "smaller than maximum"),
    ('[controller]\naddress = "http://192.168.1.20"', "without http://"),
    ('[[zones]]\nname = "wall"\nkind = "wall"', "box, cylinder, half_space"),
    ("[[zones]]\nname = 'w'\nkind = 'box'\nlow = [0, 0, 0]\nhigh = [500, 1, 1]", "write 500 mm"),
]
"""Configurations with a mistake, and what the answer must name."""


def test_mistakes_are_answered_with_the_right_form(
    found: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "job.yaml").write_text("steps: [home]")
    cases = [(line, None, "", form) for line, form in MISTAKES]
    cases += [("run bad.yaml", "bad.yaml", text, form) for text, form in JOB_MISTAKES]
    cases += [("config check bad.toml", "bad.toml", text, form) for text, form in CONFIG_MISTAKES]
    assert len(cases) >= 100
    wrong: list[str] = []
    before = len(found.wire)
    for line, file, text, form in cases:
        if file is not None:
            (tmp_path / file).write_text(text)
        code = main(line.split())
        answer = capsys.readouterr()
        if code == 0 or re.search(form, answer.err) is None or "Traceback" in answer.out + answer.err:
            wrong.append(f"{line} {text!r}: {code} {answer.err.strip()}, not {form!r}")
    assert not wrong, "\n".join(wrong)
    assert found.wire[before:] == []


BODIES = [
    ("POST", "/v1/jobs", "{", 4005),
    ("POST", "/v1/jobs", "[]", 4005),
    ("POST", "/v1/jobs", '{"steps": ["home"], "repeat": NaN}', 4005),
    ("POST", "/v1/jobs", '{"steps": "home"}', 4002),
    ("POST", "/v1/jobs", '{"steps": ["home"], "speed": 2}', 4002),
    ("POST", "/v1/jobs", '{"steps": [{"pick": [1e999, 1]}]}', 4002),
    ("POST", "/v1/jobs", '{"steps": [{"line": [1, 1, 1e308]}]}', 4002),
    ("POST", "/v1/jobs", '{"places": {"far": [1e308, 1]}, "steps": [{"line": "far"}]}', 4002),
    ("POST", "/v1/jobs", '{"steps": [{"pick": "ghost"}]}', 4003),
    ("POST", "/v1/preview", "{}", 4002),
    ("POST", "/v1/tasks", "{}", 4005),
    ("POST", "/v1/tasks", '{"command": "dance"}', 4003),
    ("POST", "/v1/tasks", '{"command": ["home"]}', 4003),
    ("POST", "/v1/tasks", '{"command": "home", "speed": 2}', 4005),
    ("POST", "/v1/tasks", '{"command": "pick"}', 4005),
    ("POST", "/v1/tasks", '{"command": "pick", "target": [1]}', 4001),
    ("POST", "/v1/tasks", '{"command": "line", "target": [1, 1, 1e308]}', 4001),
    ("POST", "/v1/tasks", '{"command": "move", "joints": [1e308, 1, 1]}', 4001),
    ("PUT", "/v1/zones/far", '{"kind": "box", "low": [0, 0, 0], "high": [1, 1, 1e308]}', 4005),
    ("PUT", "/v1/pallets/far", '{"corners": [[1e308, 1]], "rows": 1, "columns": 1}', 4005),
    ("POST", "/v1/tasks", '{"command": "pick", "target": [true, 1]}', 4001),
    ("POST", "/v1/tasks", '{"command": "pick", "target": {"x": 1, "u": 2}}', 4001),
    ("POST", "/v1/tasks", '{"command": "gripper", "open": "yes"}', 4001),
    ("POST", "/v1/jog", '{"axis": "q", "distance": 0.1}', 4003),
    ("POST", "/v1/jog", '{"axis": "b", "distance": 1e999}', 4001),
    ("POST", "/v1/jog", '{"axis": "b", "distance": 1e308}', 4001),
    ("POST", "/v1/jog", '{"axis": "b", "distance": 5, "clip": false}', 2101),
    ("POST", "/v1/jog", '{"axis": "b"}', 4005),
    ("GET", "/v1/jobs/99999", None, 4004),
    ("DELETE", "/v1/jobs/99999", None, 4004),
    ("GET", "/v1/jobs/all", None, 4005),
    ("GET", "/v1/events?since=soon", None, 4005),
    ("POST", "/v1/dance", None, 4005),
]


@pytest.mark.parametrize(("method", "path", "body", "code"), BODIES)
def test_requests(method: str, path: str, body: str | None, code: int, robot: Robot) -> None:
    before = len(robot.wire)
    connection = HTTPConnection(robot.url.removeprefix("http://"), timeout=10.0)
    connection.request(method, path, body)
    response = connection.getresponse()
    problem = json.loads(response.read())
    connection.close()
    assert (response.status >= 400, problem["code"]) == (True, code)
    assert problem["detail"].endswith((".", "`"))
    assert robot.wire[before:] == []


TWINS = ["run job.yaml --seed 2", "run job.yaml --dry-run --seed 2", "up --seed 0 --port 0", "up --table job.yaml"]


@pytest.mark.parametrize("line", TWINS)
def test_a_real_machine_has_no_seed_and_no_table_and_is_not_even_called(
    line: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "job.yaml").write_text("steps: [home]")
    with socket.create_server(("127.0.0.1", 0)) as machine:
        machine.setblocking(False)
        refused([*line.split(), "--address", f"127.0.0.1:{machine.getsockname()[1]}"], 4008, capsys)
        with pytest.raises(BlockingIOError):
            machine.accept()


def test_the_configured_machine_is_a_real_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "job.yaml").write_text("steps: [home]")
    assert main(["run", "job.yaml", "--speed", "2", "--address", "real"]) == 2
    assert (
        "error 4006: `--speed` scales the twin's time, but 192.168.1.156 is a real machine" in capsys.readouterr().err
    )


SPEEDS = ["run job.yaml --speed 2", "run job.yaml --dry-run --speed 2", "up --speed 2 --port 0", "up --speed=1"]


@pytest.mark.parametrize("line", SPEEDS)
def test_a_real_machine_has_no_speed_and_is_not_even_called(
    line: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "job.yaml").write_text("steps: [home]")
    with socket.create_server(("127.0.0.1", 0)) as machine:
        machine.setblocking(False)
        refused([*line.split(), "--address", f"127.0.0.1:{machine.getsockname()[1]}"], 4006, capsys)
        with pytest.raises(BlockingIOError):
            machine.accept()


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("up --speed 0", 4001),
        ("up --speed nan", 4001),
        ("up --speed 1001", 4001),
        ("up --speed fast", 4008),
        ("up --address a:b", 4001),
        ("stop --address sim", 4001),
        ("dmc send sim TP", 4001),
        ("up --port 70000", 4008),
        ("up --table nowhere.yaml", 4007),
        ("run nowhere.yaml", 4007),
        ("run .", 4007),
        ("run", 4008),
        ("run nowhere.yaml --seed x", 4008),
        ("dmc serve --speed -1", 4001),
        ("dmc send", 4008),
        ("dmc send :x TP", 4001),
        ("dmc sing", 4008),
        ("fk 1 2", 4008),
        ("fk 1 0.5 0.5", 2101),
        ("ik 1 2 nan", 4001),
        ("reach 1 2 1e308", 4001),
        ("fk 0 1e308 1", 4001),
        ("ik 10001 2 1", 4001),
        ("jog x 1e308", 4001),
        ("config check nowhere.toml", 4007),
        ("config show --config nowhere.toml", 4007),
        ("config init /dev/null/maya.toml", 5002),
    ],
)
def test_command_lines(line: str, code: int, capsys: pytest.CaptureFixture[str]) -> None:
    refused(line.split(), code, capsys)


@pytest.mark.parametrize("line", ["pick 0.5 nan", "run nowhere.yaml", "up --speed 2 --address 127.0.0.1:1"])
def test_the_installed_command_does_the_same(line: str) -> None:
    command = [str(Path(sys.executable).with_name("maya")), *line.split()]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=30)
    assert done.returncode == 2
    assert done.stderr.startswith("maya: error 4")
    assert "Traceback" not in done.stderr + done.stdout
