"""A controller is asked on a handle of its own; the twin plays it."""

from __future__ import annotations

import asyncio
import socket
import threading

import pytest

from dmc41x3.driver import Driver
from dmc41x3.twin.wire.server import VirtualController
from dmc41x3.wire.transport import TcpTransport
from maya_un.cli.doctor import controller
from maya_un.config import Config
from maya_un.controller import registers
from maya_un.controller.registers import Torque
from maya_un.http.doctor.finding import Finding
from maya_un.schema.diagnosis import FindingOutcome
from tests.ports import free_port
from tests.served_twin import ServedTwin, served


def findings(address: str, config: Config | None = None) -> dict[str, Finding]:
    found = asyncio.run(controller.findings(address, config or Config(), "en"))
    return {finding.key: finding for finding in found}


def send(twin: ServedTwin, *commands: str) -> None:
    """Say commands to a controller by a handle of one's own."""

    async def say() -> None:
        driver = await Driver.open(await TcpTransport.connect(twin.host, twin.port, 5.0), timeout=5.0)
        for command in commands:
            await driver.send(command)
        await driver.close()

    asyncio.run(say())


def test_one_that_is_well_is_well_in_everything_but_its_motors() -> None:
    with served() as twin:
        send(twin, "TM 1000", "CN -1")
        found = findings(twin.address)
    assert found["firmware"].details["firmware"].startswith("DMC4133")
    assert {key for key, finding in found.items() if finding.outcome is not FindingOutcome.OK} == {"motors_off"}
    assert {"handles_free", "limits_quiet", "level_same", "program_none", "memory_sound", "controller_clock"} <= set(
        found
    )


def test_only_queries_are_sent() -> None:
    with served() as twin:
        findings(twin.address)
        commands = {command for command, _ in twin.said}
    assert {command.split()[0] for command in commands if command[:1].isalpha()} <= {"MG", "TH", "WH", "QR"}
    assert twin.refused == []


def test_changed_settings_are_reported() -> None:
    with served() as twin:
        send(twin, "CN 1", "TM 500", "SHABC")
        found = findings(twin.address)
    assert (found["level_differs"].details["found"], found["level_differs"].details["wanted"]) == ("1", -1)
    assert found["controller_clock_off"].details["period"] == 500.0
    assert "motors_on" in found


def test_torque_limit_left_by_a_killed_program_is_reported() -> None:
    """It left its token too, which beats no more."""
    with served() as twin:
        send(twin, "ZAB=77", *registers.commands(Torque(Config()).rest))
        found = findings(twin.address)
        assert (found["torque_low"].outcome, found["torque_low"].details["found"]) == (
            FindingOutcome.WARN,
            "TLB=0.12, TLC=0.12",
        )
        send(twin, *registers.commands(Torque(Config()).most))
        assert "torque_low" not in findings(twin.address)


def test_running_program_is_reported_by_its_thread() -> None:
    async def download(twin: ServedTwin) -> None:
        driver = await Driver.open(await TcpTransport.connect(twin.host, twin.port, 5.0), timeout=5.0)
        await driver.download("#LOOP\nWT 10\nJP #LOOP\nEN\n")
        await driver.send("XQ #LOOP,2")
        await driver.close()

    with served() as twin:
        asyncio.run(download(twin))
        assert findings(twin.address)["program_runs"].details == {"threads": "2"}


def test_scarce_handles_are_reported_with_their_holders() -> None:
    async def with_many(twin: ServedTwin) -> list[Finding]:
        others = [await TcpTransport.connect(twin.host, twin.port, 5.0) for _ in range(6)]
        try:
            return await controller.findings(twin.address, Config(), "en")
        finally:
            for other in others:
                await other.close()

    with served(udp=False) as twin:
        found = {finding.key: finding for finding in asyncio.run(with_many(twin))}
    short = found["handles_short"].details
    assert (short["free"], short["all"], short["own"]) == (1, 8, "IHG")
    assert "IHA TCP 127.0.0.1:" in short["others"]


def test_silent_or_other_device_is_reported() -> None:
    assert findings(f"127.0.0.1:{free_port()}").keys() == {"controller_silent"}
    with served(axes=2) as twin:
        assert findings(twin.address).keys() == {"controller_wrong"}


def test_device_that_ends_the_connection_is_no_lost_controller() -> None:
    with socket.create_server(("127.0.0.1", 0)) as device:
        thread = threading.Thread(target=hang_up, args=(device,))
        thread.start()
        found = findings(f"127.0.0.1:{device.getsockname()[1]}")
        thread.join()
    assert found.keys() == {"controller_silent"}
    assert "before it answered" in found["controller_silent"].details["error"]


def hang_up(device: socket.socket) -> None:
    connection, _ = device.accept()
    with connection:
        connection.recv(100)


@pytest.mark.waits("2.75 s: each of eleven looks observes a controller's clock in real time for 0.25 s")
def test_its_handle_is_given_back() -> None:
    with served() as twin:
        findings(twin.address)

        def handles(host: VirtualController) -> int:
            return len(asyncio.all_tasks())

        before = twin.do(handles)
        for _ in range(10):
            assert "handles_free" in findings(twin.address)
        assert twin.do(handles) <= before + 1
