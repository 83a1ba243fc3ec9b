"""Reach a controller as a person does: by a serial port, by a search, with an address by BOOTP, and with a new one."""

from __future__ import annotations

import asyncio
import json
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from dmc41x3.address import parse
from dmc41x3.errors import LinkLost
from dmc41x3.twin.wire.server import VirtualController, bench
from dmc41x3.wire.transport import connect
from maya_un.config import Config
from maya_un.controller.controller import GalilController
from tests.ports import free_port
from tests.system.processes import Process, Wire, done, running
from tests.waiting import eventually

pytestmark = pytest.mark.system

MAC = "00:50:4C:08:01:1F"
"""The hardware address of the twin."""

FOREIGN = """
import gclib
g = gclib.py()
g.GOpen("COM3 --baud 115200 -s MG")
print(g.GInfo().partition(", ")[2])
g.GProgramDownload('#A\\nMG "moved",_RPA\\nEN\\n')
g.GCommand("SH A;PRA=500;BGA")
while float(g.GCommand("MG _BGA")):
    pass
g.GCommand("XQ #A")
print(g.GMessage().strip())
g.GClose()
"""


@contextmanager
def served(options: str) -> Iterator[tuple[Process, str, str]]:
    """Serve a twin with a serial port; yields the process, its address and the path of its port."""
    with running(f"dmc serve --port 0 --serial {options}") as twin:
        address = twin.until("127.0.0.1:")
        yield twin, address, twin.until("/dev/")


def answer(line: str) -> dict[str, Any]:
    """Run a command with --json to its end and return its answer."""
    code, text = done(f"{line} --json")
    assert code == 0, text
    return json.loads(text)


def is_usable() -> bool:
    """Return whether the robot is connected and has no fault; clear a fault.

    On a busy machine `maya stop` may go past the service, directly to the controller: its answers on the shared port
    are a fault for the service. Or the service loses the connection, and restores it.
    """
    mode = answer("status")["state"]["mode"]
    if mode == "fault":
        done("recover")
    return mode not in {"disconnected", "fault"}


def wait_for_motion(wire: Wire, *, moving: bool, within: float) -> None:
    """Ask until an axis moves, or none does; fails after `within` seconds of the controller's clock."""
    latest = wire.time + within
    while any(wire.numbers("_BGA,_BGB,_BGC")) is not moving:
        assert wire.time < latest, f"still not {'moving' if moving else 'at rest'}"


def test_tools_by_a_serial_port(tmp_path: Path) -> None:
    with served("--bench") as (_, _, port):
        assert answer(f"dmc send {port} SH TP")["replies"][1]["reply"] == "0, 0, 0"
        program = tmp_path / "x.dmc"
        program.write_text("#X\nMG 1\nEN\n")
        assert done(f"dmc download {port} {program}")[0] == 0
        assert done(f"dmc upload {port}")[1].strip().splitlines()[-1].endswith("EN")
        assert "_TPA" in done(f"dmc watch {port} _TPA --for 0.1")[1]
        code, text = done(f"dmc conform {port}")
        assert (code, "needs a network address" in text) == (2, True), text
        code, text = done("dmc send /dev/no-such-port TP")
        assert (code, "error 1012" in text) == (1, True), text
        code, text = done("dmc send /dev/ttyS0@12 TP")
        assert (code, "error 4001" in text) == (2, True), text


def test_foreign_gclib_script_by_a_serial_port(tmp_path: Path) -> None:
    script = tmp_path / "foreign.py"
    script.write_text(FOREIGN)
    with served("--bench") as (_, _, port):
        code, text = done(f"dmc gclib run {script}", env={"DMC_COM3": port})
        assert (code, text.splitlines()) == (0, ["DMC4133 Rev 1.3k, 41330, USB", "moved 500.0000"])


def test_robot_by_a_serial_port() -> None:
    """Home, be refused a second program on the port, stop by the service, and stop past a service that hangs."""
    with (
        served("--seed 5") as (_, address, port),
        running(f"up --port 0 --address {port}") as up,
        Wire(address) as wire,
    ):
        up.until("maya home")
        code, text = done(f"dmc send {port} TP")
        assert (code, "another program uses it" in text) == (1, True), text
        with running("home") as home:
            home.until("running")
            wait_for_motion(wire, moving=True, within=20.0)
            assert done("stop")[0] == 0
            wait_for_motion(wire, moving=False, within=5.0)
            assert home.end()[0] == 1
        eventually(is_usable, "a connection without a fault", told=lambda: str(answer("status")["state"]))
        with running("home") as home:
            home.until("running")
            wait_for_motion(wire, moving=True, within=20.0)
            up.send(signal.SIGSTOP)
            code, text = done("stop", cold=True)
            assert (code, f"directly to the controller at {port}" in text) == (0, True), text
            wait_for_motion(wire, moving=False, within=5.0)
            home.kill()
        up.kill()
        assert done(f"stop --address {port}", cold=True)[0] == 0


def test_unplugged_robot_stops_and_is_reported() -> None:
    with served("--seed 5") as (twin, _, port), running(f"up --port 0 --address {port}") as up:
        up.until("maya home")
        assert json.loads(done("status --json")[1])["state"]["mode"] != "disconnected"
        twin.kill()
        code, text = done("home")
        assert (code, "100" in text or "1010" in text) == (1, True), text


async def until(controller: GalilController, mode: str) -> None:
    """Wait until a controller is in a mode."""
    async with asyncio.timeout(30.0):
        async for state in controller.watch():
            if state.mode == mode:
                return


def test_cable_that_is_plugged_in_again_is_found_and_moves_nothing(tmp_path: Path) -> None:
    path = tmp_path / "tty"

    def plug(twin: VirtualController) -> None:
        path.unlink(missing_ok=True)
        path.symlink_to(twin.serve_serial())

    async def run() -> None:
        twin = bench(3)
        plug(twin)
        controller = GalilController(lambda: connect(parse(str(path)), 2.0), str(path), Config(), live=True)
        try:
            await controller.open()
            assert controller.state.mode == "not_homed"
            twin.unplug()
            await until(controller, "disconnected")
            plug(twin)
            await until(controller, "fault")
            assert controller.state.fault is not None
            assert controller.state.fault.code == LinkLost.code
            assert not any(axis.moving for axis in twin.machine.unit.axes)
            await controller.recover()
            assert controller.state.mode == "not_homed"
        finally:
            await controller.close()
            await twin.close()

    asyncio.run(run())


def test_search_finds_the_twin_and_sends_it_nothing_but_its_question() -> None:
    with served("--bench") as (_, address, port):
        number = address.rpartition(":")[2]
        found = answer(f"dmc find 127.0.0.0/29 --port {number}")
        assert found["controllers"] == [{"address": address, "firmware": "DMC4133 Rev 1.3k", "mac": None}]
        with Wire(address) as wire:
            assert wire.numbers("_IA2,_TC,_EO") == [7.0, 0.0, 1.0]  # each handle is free again
        assert done(f"dmc find 127.0.0.8/29 --port {number}")[1].startswith("No controller answers in 127.0.0.8/29.")
        assert port.startswith("/dev/")
        code, text = done("dmc find 10.0.0.0/8")
        assert (code, "error 4001" in text) == (2, True), text


@pytest.mark.parametrize("dhcp", [False, True])
def test_controller_without_an_address_gets_one_and_keeps_it(dhcp: bool, tmp_path: Path) -> None:
    memory, server = tmp_path / "memory.json", free_port()
    if not dhcp:
        with running(f"dmc serve --bench --port 0 --memory {memory}") as twin:
            assert done(f"dmc ip {twin.until(':')} --no-dhcp --burn --yes")[0] == 0
    options = f"--bench --memory {memory} --bootp 127.0.0.1:{server}"
    with served(options) as (_, address, port):
        place = f"127.0.0.5:{address.rpartition(':')[2]}"
        code, text = done(f"dmc assign 00:50:4C:00:00:01 {place} --port {server} --for 0.3")
        assert (code, "error 1014" in text) == (1, True), text
        given = answer(f"dmc assign {MAC} {place} --mask 255.0.0.0 --port {server} --burn")
        assert given == {"mac": MAC.lower(), "address": place, "firmware": "DMC4133 Rev 1.3k", "burned": True}
        done(f"dmc send {port} RS")
        found = answer(f"dmc ip {place}")
        assert (found["address"], found["mask"], found["mac"], found["dhcp"]) == (
            "127.0.0.5",
            "255.0.0.0",
            MAC.lower(),
            False,
        )


@pytest.mark.waits("3 s in which controllers may ask, once a second at first")
def test_askers_are_listed() -> None:
    server = free_port()
    with running(f"dmc serve --bench --port 0 --bootp 127.0.0.1:{server}") as twin:
        twin.until(":")
        assert answer(f"dmc assign --port {server} --for 3") == {"asking": [MAC.lower()]}


def test_address_changes_and_is_burned_after_the_controller_was_reached_there() -> None:
    with served("--bench") as (_, address, port):
        there = f"127.0.0.2:{address.rpartition(':')[2]}"
        code, text = done(f"dmc ip {address} --set 127.0.0.2")
        assert (code, "--yes" in text) == (2, True), text
        changed = answer(f"dmc ip {address} --set 127.0.0.2 --mask 255.0.0.0 --yes")
        assert (changed["reached"], changed["address"], changed["burned"]) == (there, "127.0.0.2", False)
        assert done(f"dmc send {address} TP")[0] == 1
        done(f"dmc send {port} RS")
        assert answer(f"dmc ip {address}")["dhcp"] is True  # nothing was burned
        assert answer(f"dmc ip {address} --set 127.0.0.2 --burn --yes")["reached"] == there
        done(f"dmc send {port} RS")
        assert answer(f"dmc ip {there}")["address"] == "127.0.0.2"
        by_cable = answer(f"dmc ip {port} --set 127.0.0.3 --yes")
        assert (by_cable["reached"], by_cable["address"]) == (port, "127.0.0.3")


@pytest.mark.waits("up to 10 s in which a controller may come up at its new address")
def test_unreachable_address_is_not_burned() -> None:
    with served("--bench") as (_, address, port):
        # An address of a network for documentation (RFC 5737), which no computer has.
        code, text = done(f"dmc ip {address} --set 192.0.2.7 --burn --yes")
        assert (code, "error 1013" in text) == (1, True), text
        done(f"dmc send {port} RS")
        assert answer(f"dmc ip {port}")["address"] != "192.0.2.7"
