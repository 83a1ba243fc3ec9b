"""Software of others that talks to Galil controllers, unmodified, on the twin by its own sockets.

QCoDeS's driver of the DMC-41x3 through our gclib, the Simons Observatory's Galil driver and agent over plain TCP, and a
script for gclib. They run in `.venv-clients`, which `./test` sets up from requirements-clients.lock; the tests check
the state of the twin.
"""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import pytest

from dmc41x3.cli.gclib import SHIM
from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.network import HandleProtocol
from tests.served_twin import ServedTwin, served
from tests.system.processes import running

ROOT = Path(__file__).resolve().parents[2]
PYTHON = ROOT / ".venv-clients" / "bin" / "python"
FOREIGN = Path(__file__).with_name("foreign")
EXAMPLE = ROOT / "examples" / "04_gclib.py"
PATIENCE = 50.0

pytestmark = pytest.mark.system


def output_of(script: str, twin: ServedTwin, home: Path, *arguments: str) -> dict[str, Any]:
    """Return a client's output, once it has gone through everything it has."""
    if not PYTHON.exists():
        pytest.fail("there is no .venv-clients: `./test` sets it up")
    done = subprocess.run(
        [PYTHON, FOREIGN / script, twin.address, *arguments],
        env={**os.environ, "PYTHONPATH": str(SHIM), "HOME": str(home)},
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def positions(machine: VirtualDmc) -> list[int]:
    """Return where the motors are [counts]."""
    return [round(machine.unit.core.position(axis)) for axis in machine.unit.axes]


def udp_handles(machine: VirtualDmc) -> int:
    """Return how many handles datagrams hold; nobody but their owner can give them back."""
    return sum(handle is not None and handle.kind is HandleProtocol.UDP for handle in machine.unit.handles)


@pytest.mark.waits("about 4 s of motion of a twin at real speed, for a program that knows no other")
def test_qcodes_drives_motors_planes_and_the_probe_arm(tmp_path: Path) -> None:
    with served() as twin:
        said = output_of("qcodes_client.py", twin, tmp_path)
        registers = twin.look(lambda machine: [dict(axis.registers) for axis in machine.unit.axes])
        on = twin.look(lambda machine: [axis.on for axis in machine.unit.axes])
        by_udp = twin.look(udp_handles)
        refused, commands = twin.refused, [command for command, _ in twin.said]
    assert said["missing"] == []
    assert said["idn"] == {
        "vendor": "Galil Motion Control, Inc.",
        "model": "DMC4133",
        "serial": "41330,",
        "firmware": "1.3k",
    }
    assert said["settings"] == 3 * [
        {
            "relative_position": 2000,
            "speed": 30000,
            "acceleration": 512000,
            "deceleration": 256000,
            "off_when_error_occurs": "enable for position, amp error or abort",
            "reverse_sw_limit": -1000000,
            "forward_sw_limit": 1000000,
        }
    ]
    once = {"off": "off", "on": "on", "moving": "1", "over": "0", "error": "0.0", "off again": "off"}
    assert said["single"] == 3 * [once]
    together = said["together"]
    assert together["reached"] == {"A": 1000, "B": -500, "C": 250}
    # At 30 000 counts/s and 256 000 counts/s² an axis needs 1758 counts to stop.
    assert 3000 <= together["stopped"]["A"] < 200_000
    assert together["stopped"] == {"A": together["stopped"]["A"], "B": -500, "C": 250}
    assert (together["moving"], together["off"]) == (0, "off")  # AB, and OE 1 switches off
    for plane in said["vector"]:
        assert plane["length"] == 10_000.0  # 3000, 4000 and back
        assert plane["came back"]
        assert plane["vector_speed"] == 20_000
        assert "question mark returned by controller" in plane["after, from a host"]
    assert said["told"] == "2 Command only valid from program"
    assert said["arm"]["corners"] == [[0, 0, 0], [1600, 0, 0], [1600, 1200, 0]]
    assert said["arm"]["at"] == [1, 3]
    assert said["off"] == ["off", "off", "off"]
    assert on == [False, False, False]
    assert [axis["OE"] for axis in registers] == [1.0, 1.0, 1.0]
    assert refused == ["AM S", "WT 2", "EN"]
    assert "TM 1000" in commands
    assert by_udp == 0


@pytest.mark.waits("about 9 s: the foreign driver waits up to 0.2 s before each command")
def test_the_observatorys_driver_sets_up_gears_and_moves_axes(tmp_path: Path) -> None:
    with served(4) as twin:
        twin.do(lambda controller: controller.machine.unit.analog.__setitem__(0, 1.25))
        said = output_of("socs_driver.py", twin, tmp_path)
        at = twin.look(positions)
        on = twin.look(lambda machine: [axis.on for axis in machine.unit.axes])
        outputs = twin.look(lambda machine: machine.unit.outputs[0])
        refused = twin.refused
    assert said["missing"] == []
    assert said["amplifier"] == {
        "type": 1.0,
        "off on error": [1, "enabled"],
        "gain": 2.0,
        "torque limit": 5.0,
        "loop gain": 9.0,
    }
    wired = said["wired"]
    assert wired["volts"] == pytest.approx(1.25, abs=0.01)
    assert wired["released"] == [1, "Brake Released"]
    assert wired["engaged"] == [0, "Brake Engaged"]
    assert [wired[f"limits {state}"][0] for state in range(4)] == [0, 1, 2, 3]
    assert (wired["high"][0], wired["low"][0]) == (1, -1)
    assert not outputs
    assert said["geared"]["ratios"] == [0.0, 1.0, 0.0, 1.0]
    moved = said["moved"]
    assert moved["rates"] == [20000.0, 409600.0, 409600.0]
    assert moved["begun"] == [True, "Axis A is in motion."]
    assert moved["absolute"]["A"]["position"] == 4000.0
    assert moved["absolute"]["B"]["position"] == 4000.0  # geared 1:1
    assert moved["distance"] == [-1500.0, [-1.5, "mm"], [-3.0, "deg"]]
    assert [axis["position"] for axis in moved["relative"].values()] == [2500.0, 2500.0, 0.0, 0.0]
    assert moved["jogged"] > 2500.0
    assert at == [moved["jogged"], moved["jogged"], 0, 0]
    assert said["off"] == [1, "off"]
    assert on == [True, True, False, True]
    assert refused == []


@pytest.mark.waits("about 10 s: the foreign driver waits up to 0.2 s before each command, its agent 1 s twice")
def test_the_observatorys_agent_runs_its_tasks_and_publishes(tmp_path: Path) -> None:
    with served() as twin:
        said = output_of("socs_agent.py", twin, tmp_path, str(tmp_path))
        at = twin.look(positions)
        refused = twin.refused
    assert said.pop("missing") == []
    assert said.pop("flushed") == 2
    at_first, published = said.pop("published")
    assert {name: ok for name, (ok, _) in said.items() if not ok} == {}
    assert said["get_speed A"][1] == "Speed for axis A:  40000.0000"
    assert said["get_gearing_ratio B"][1] == "Gearing ratio for axis B is: 2.0."
    # From 100: to 0.5 mm of 4000 counts, then 0.5 degrees of 2000 on, then a jog.
    assert at[0] > 3000
    assert at[1:] == [0, 0]
    assert at_first["data"]["A_position"] == 0.0
    assert published["block_name"] == "axes"
    assert published["data"]["A_position"] == at[0]
    assert published["data"]["B_position"] == 0.0
    assert refused == []


def test_the_gclib_example_runs_through_the_command() -> None:
    with served() as twin:
        with running(f"dmc gclib run {EXAMPLE} {twin.address}") as script:
            code, said = script.end()
        assert twin.look(positions) == [5000, 2000, 0]
        by_udp = twin.look(udp_handles)
    assert code == 0, said
    assert said.splitlines() == [
        "127.0.0.1, DMC4133 Rev 1.3k, 41330, IHA IHB",
        "after a move: 3000, 0, 0",
        "refused: question mark returned by controller - 90 Only A B C D valid operand",
        "corner 1",
        "corner 2",
        "an array: [2.5, -3.0]",
        "a record: 5000 2000",
    ]
    assert by_udp == 0


def test_a_script_has_its_own_arguments_exit_code_and_gclib(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text("import gclib, sys\nprint(gclib.__file__, *sys.argv[1:])\nsys.exit(7)\n", encoding="utf-8")
    with running(f"dmc gclib run {script} --speed 3") as process:
        code, said = process.end()
    assert code == 7
    assert said.split() == [str(SHIM / "gclib.py"), "--speed", "3"]
