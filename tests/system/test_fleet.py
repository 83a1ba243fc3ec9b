"""Several robots on one broker, each `maya up --coms` with a twin; supervisors by `maya fleet` and in Python."""

from __future__ import annotations

import json
import os
import pty
import signal
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import pytest

from tests.calm import CALM_FILE
from tests.ports import free_port
from tests.system.brokers import Broker, broker
from tests.system.observing import Observer, observing
from tests.system.processes import MAYA, Process, done

pytestmark = [pytest.mark.system, pytest.mark.timeout(600)]

NAMES = ("ANA", "BETO", "CARLA")
PLACES = ({"x": 0.5, "y": 1.1, "z": 0.5}, {"x": 0.4, "y": 1.0, "z": 0.5})


class Robot:
    """`maya up --coms` with a folder and ports of its own, which it keeps when it starts again."""

    def __init__(self, name: str, folder: Path, broker: Broker) -> None:
        self.name = name
        folder.mkdir()
        config = folder / "maya.toml"
        config.write_text(
            f'{CALM_FILE.read_text()}[coms]\nname = "{name}"\nserver_address = "http://localhost:{free_port()}"\n'
        )
        where = f"--port 0 --rosbridge-port {free_port()} --journal {folder}/maya.db"
        self._line = f"up --coms {where} --speed 100 --config {config}"
        self._env = {
            "MAYA_COMS_URL": broker.url,
            "MAYA_RUNTIME_DIR": str(folder / "run"),
            "MAYA_STATE_DIR": str(folder / "state"),
        }
        self._process: Process | None = None

    def start(self) -> None:
        self._process = Process(self._line, env=self._env)

    def kill(self) -> None:
        """Kill it with -9; its `maya coms` ends with it."""
        if self._process is not None:
            self._process.kill()
            self._process = None


@contextmanager
def robots(broker: Broker, folder: Path, *names: str) -> Iterator[dict[str, Robot]]:
    with ExitStack() as running:
        found = {name: Robot(name, folder / name, broker) for name in names}
        for robot in found.values():
            running.callback(robot.kill)
            robot.start()
        yield found


def online(observer: Observer, *names: str) -> None:
    """Wait until the last word of each robot is that it is connected."""

    def holds(_: object) -> bool:
        last = {seen.robot: seen.data["connection"] for seen in observer.seen if seen.kind == "connection"}
        return all(last.get(name) == "ONLINE" for name in names)

    observer.until(holds)


def fleet(line: str, broker: Broker) -> tuple[int, dict[str, Any]]:
    """Run `maya fleet` to its end; return its exit code and its answer."""
    code, said = done(f"fleet {line} --url {broker.url} --json", within=300.0)
    return code, json.loads(said)


def process_of_thirty(path: Path) -> None:
    """Write a process: ten rounds of the three robots, each step after that of the robot before it."""
    steps: list[dict[str, Any]] = []
    for number in range(30):
        robot = NAMES[number % 3]
        step = {"id": f"s{number}", "robot": robot, "command": "approach", "args": PLACES[number // 3 % 2]}
        steps.append(step | ({"after": [f"s{number - 1}"]} if number else {}))
    path.write_text(json.dumps({"deadline": 300, "steps": steps}))


class Person:
    """Runs a process until it is done: homes a robot whose step was interrupted, and has that step sent again."""

    def __init__(self, file: Path, broker: Broker) -> None:
        self._file = file
        self._broker = broker

    def begin(self, decision: str = "") -> Process:
        return Process(f"fleet run {self._file} --url {self._broker.url} --json {decision}")

    def decided(self, report: dict[str, Any]) -> Process:
        """Look after the failed step of a report and go on."""
        (failed,) = [step for step in report["steps"] if step["state"] == "failed"]
        assert failed["code"] in {"INTERRUPTED", "2103"}, failed
        code, answer = fleet(f"send {failed['robot']} home --deadline 5min", self._broker)
        assert code == 0, answer
        return self.begin(f"--retry {failed['id']}")


def begun(observer: Observer, step: str, state: Path) -> None:
    """Wait until the robot has begun a step of the process."""

    def holds(_: object) -> bool:
        lines = [json.loads(line) for line in state.read_text().splitlines()] if state.exists() else []
        ids = {line["sent"] for line in lines if line.get("step") == step and "sent" in line}
        return bool(ids & set(observer.executions()))

    observer.until(holds)


@pytest.mark.waits("about 13 s of four homings and thirty motions at a hundred times real speed, between processes")
def test_process_of_thirty_steps_survives_the_death_of_every_program(tmp_path: Path) -> None:
    file = tmp_path / "thirty.json"
    state = tmp_path / "thirty.json.state"
    process_of_thirty(file)
    with broker(tmp_path) as one, observing(one) as observer, robots(one, tmp_path, *NAMES) as found:
        online(observer, *NAMES)
        home = [{"id": name, "robot": name, "command": "home"} for name in NAMES]
        (tmp_path / "home.json").write_text(json.dumps({"steps": home}))
        assert fleet(f"run {tmp_path}/home.json", one)[0] == 0
        person = Person(file, one)
        running = person.begin()
        try:
            for step, victim in (("s4", "BETO"), ("s9", None), ("s15", "ANA"), ("s20", "CARLA"), ("s25", None)):
                begun(observer, step, state)
                if victim is None:
                    running.kill()
                    running = person.begin()
                    continue
                found[victim].kill()
                found[victim].start()
                code, said = running.end(within=300.0)
                assert code == 1
                running = person.decided(json.loads(said))
            code, said = running.end(within=300.0)
        finally:
            running.kill()
        assert code == 0
        report = json.loads(said)
        assert report["state"] == "done"
        assert {step["state"] for step in report["steps"]} == {"done"}
        judge(observer, state)


def judge(observer: Observer, state: Path) -> None:
    """Every step has exactly one success, after that of the step before it; no command began twice.

    The last command and its result may reach the observer a little later than the supervisor.
    """
    of = {line["sent"]: line["step"] for line in map(json.loads, state.read_text().splitlines()) if "sent" in line}
    observer.until(lambda _: set(of) <= set(observer.commands()) == set(observer.results()))
    assert {id_: dates for id_, dates in observer.executions().items() if len(dates) != 1} == {}
    results = observer.results()
    order = [of[id_] for id_, result in results.items() if result["success"] and id_ in of]
    assert order == [f"s{number}" for number in range(30)]


SHORT = {
    "steps": [
        {"id": "home", "robot": "ANA", "command": "home"},
        {"id": "far", "robot": "ANA", "command": "approach", "args": {"x": 9, "y": 9, "z": 0.5}, "after": ["home"]},
        {"id": "near", "robot": "ANA", "command": "approach", "args": PLACES[0], "after": ["far"]},
    ]
}


@pytest.mark.waits("2.4 s of homing at a hundred times real speed, as the broker lives in real time")
def test_interrupted_run_continues_and_asks_about_a_failed_step(tmp_path: Path) -> None:
    file = tmp_path / "short.json"
    file.write_text(json.dumps(SHORT))
    with broker(tmp_path) as one, observing(one) as observer:
        line = f"fleet run {file} --url {one.url}"
        waiting = Process(line)
        try:
            assert waiting.until("ANA").endswith("3 steps for ANA.")
            assert "unknown" in waiting.until("ANA is")
            observer.until(lambda _: len(observer.commands()) == 1)
            waiting.send(signal.SIGINT)
            code, said = waiting.end()
            assert (code, "Interrupted" in said) == (130, True)
        finally:
            waiting.kill()
        with robots(one, tmp_path, "ANA"):
            online(observer, "ANA")
            said = answered([MAYA, *line.split(), "--lang", "es"], "perhaps\nretry\nskip\n")
        assert said.count("Elija qué hacer con el paso far") == 3
        assert said.count("Uno de: retry, skip, abort") == 1
        assert "Han terminado los 3 pasos: 2 hechos, 1 omitidos." in said
        results = [result["code"] for result in observer.results().values()]
        assert results == [None, "2101", "2101", None]
        assert {id_: dates for id_, dates in observer.executions().items() if len(dates) != 1} == {}


def answered(line: list[str], answers: str) -> str:
    """Run a command with a terminal as its input, on which a person types; return its output when it succeeds."""
    ours, its = pty.openpty()
    try:
        os.write(ours, answers.encode())
        found = subprocess.run(line, stdin=its, stdout=subprocess.PIPE, timeout=120.0, check=True, text=True)
        return found.stdout
    finally:
        os.close(ours)
        os.close(its)


@pytest.mark.parametrize(
    ("words", "code", "error"),
    [
        ("send MAYA pick 0.5 1.1", 2, 4008),
        ("send MAYA dance", 2, 4003),
        ("send MAYA gripper ajar", 2, 4008),
        ("send MAYA pick 0.5 1.1 high", 2, 4001),
        ("run {folder}/none.yaml", 2, 4007),
        ("run {folder}/circle.yaml", 2, 4045),
        ("run {folder}/good.yaml --retry home", 2, 4003),
        ("list", 1, 1051),
    ],
)
def test_a_wrong_command_line_is_refused_before_anything_is_sent(
    tmp_path: Path, words: str, code: int, error: int
) -> None:
    (tmp_path / "good.yaml").write_text(json.dumps({"steps": [SHORT["steps"][0]]}))
    (tmp_path / "circle.yaml").write_text(json.dumps({"steps": [SHORT["steps"][0] | {"after": ["home"]}]}))
    found, said = done(f"fleet {words.format(folder=tmp_path)} --url mqtt://127.0.0.1:{free_port()} --json")
    assert (found, json.loads(said)["error"]["code"]) == (code, error)
