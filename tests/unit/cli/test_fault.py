"""`maya dmc fault`: its output, and its effect on a virtual controller in this process."""

from __future__ import annotations

import asyncio
import json
import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.plant import BenchPlant
from dmc41x3.twin.wire.faults import TABLE
from dmc41x3.twin.wire.injection import FaultControlServer
from dmc41x3.twin.wire.server import VirtualController
from maya_un.cli.dmc_tools.fault import ServedTwin, published
from maya_un.cli.main import main


class _Host:
    """A thread with a loop and a served controller in it."""

    def __init__(self) -> None:
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever)
        self._thread.start()
        self.virtual, self._control, self.port = self._call(self._open())

    async def _open(self) -> tuple[VirtualController, FaultControlServer, int]:
        virtual = VirtualController(VirtualDmc(BenchPlant()))
        _, port = await virtual.serve()
        return virtual, await FaultControlServer.opened(virtual.faults), port

    async def _close(self) -> None:
        await self._control.close()
        await self.virtual.close()

    def _call(self, work: Any) -> Any:
        return asyncio.run_coroutine_threadsafe(work, self._loop).result(20.0)

    def close(self) -> None:
        self._call(self._close())
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    @property
    def twin(self) -> ServedTwin:
        return ServedTwin("127.0.0.1", self.port, self._control.port, os.getpid())


@contextmanager
def twin() -> Iterator[_Host]:
    host = _Host()
    try:
        with published(host.twin):
            yield host
    finally:
        host.close()


def test_without_a_name_faults_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["dmc", "fault"]) == 0
    said = capsys.readouterr().out
    assert [fault.name for fault in TABLE if f"{fault.name}\n  {fault.words}\n" not in said] == []
    assert "    jitter    0      s   largest" in said
    assert main(["dmc", "fault", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)["faults"]
    assert [fault["name"] for fault in data] == [fault.name for fault in TABLE]
    seconds = data[0]["parameters"][0]
    assert seconds.items() >= {"name": "seconds", "default": 0.05, "unit": "s", "words": "delay"}.items()
    assert {fault["name"] for fault in data if not fault["lasts"]} == {"cut", "reset"}


def test_fault_is_begun_shown_and_ended(capsys: pytest.CaptureFixture[str]) -> None:
    with twin() as host:
        assert main(["dmc", "fault", "latency", "seconds=0.25", "--for", "1000"]) == 0
        assert capsys.readouterr().out.startswith("latency seconds=0.25 jitter=0 for ")
        assert host.virtual.wire.latency == 0.25
        assert main(["dmc", "fault", "stuck_limit", "axis=B", "active=no", "--json"]) == 2
        assert json.loads(capsys.readouterr().out)["error"]["code"] == 4001
        assert main(["dmc", "fault", "stuck_limit", "axis=B", "active=off", "--twin", str(host.port), "--json"]) == 0
        answer = json.loads(capsys.readouterr().out)
        assert answer["address"] == f"127.0.0.1:{host.port}"
        assert answer["active"][1] == {
            "fault": "stuck_limit",
            "values": {"axis": "B", "side": "forward", "active": False},
            "seconds": None,
        }
        assert main(["dmc", "fault", "--clear", "latency"]) == 0
        assert capsys.readouterr().out == "stuck_limit axis=B side=forward active=false\n"
        assert main(["dmc", "fault", "--active"]) == 0
        assert "stuck_limit" in capsys.readouterr().out
        assert main(["dmc", "fault", "--clear", "--lang", "es"]) == 0
        assert capsys.readouterr().out == "Ningún fallo está activo.\n"
        assert host.virtual.wire.latency == 0.0


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("nope", 4003),
        ("--clear nope", 4003),
        ("drop speed=1", 4003),
        ("drop probability=2", 4001),
        ("drop probability", 4008),
        ("drop --for 0", 4005),
        ("drop --for x", 4008),
        ("drop probability=0.1 probability=0.2", 4008),
        ("drop probability=0.1 --clear", 4008),
        ("drop --clear --for 1", 4008),
        ("--for 1", 4008),
        ("--active --clear", 4008),
        ("drop --active", 4008),
        ("cut --for 1", 4008),
        ("encoder_loss axis=H", 4001),
        ("drop --twin 1", 1022),
    ],
)
def test_invalid_fault_has_its_code(line: str, code: int, capsys: pytest.CaptureFixture[str]) -> None:
    with twin() as host:
        assert main(["dmc", "fault", *line.split(), "--json"]) == (1 if code == 1022 else 2)
        assert json.loads(capsys.readouterr().out)["error"]["code"] == code
        assert host.virtual.faults.active == []


def test_missing_twin_is_reported_with_advice(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["dmc", "fault", "drop"]) == 1
    assert "maya: error 1022: Maya cannot tell which twin to use: none runs. Start `maya up` or `maya dmc serve`" in (
        capsys.readouterr().err
    )


def test_silent_twin_is_reported(capsys: pytest.CaptureFixture[str]) -> None:
    with published(ServedTwin("127.0.0.1", 5023, 1, os.getpid())):
        assert main(["dmc", "fault", "drop"]) == 1
    assert "does not answer" in capsys.readouterr().err


def test_options_of_serve_that_contradict_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["dmc", "serve", "--axes", "4"]) == 2
    assert "--axes is for --bench" in capsys.readouterr().err
    assert main(["dmc", "serve", "--memory", str(tmp_path / "nowhere" / "m.json")]) == 2
    assert "5002" in capsys.readouterr().err
    assert main(["dmc", "serve", "--memory", str(tmp_path)]) == 2
    assert "it is not a regular file" in capsys.readouterr().err
    assert main(["dmc", "serve", "--firmware", "DMC4133 ñ"]) == 2
    assert "4001" in capsys.readouterr().err
