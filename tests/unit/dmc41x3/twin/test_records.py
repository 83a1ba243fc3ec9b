"""DR: records by themselves, at their instants and of their instants."""

from __future__ import annotations

import itertools

import pytest

from dmc41x3.language.record import DataRecord, decode
from dmc41x3.twin.commands.system import BURN_TIME
from dmc41x3.twin.network import Handle, HandleProtocol
from tests.unit.dmc41x3.twin.bench import Bench

SAMPLE = 1.0 / 1024.0


class Stage:
    """A bench with a UDP handle B, and what arrives there."""

    def __init__(self) -> None:
        self.bench = Bench()
        handle = self.bench.machine.connect(("10.0.0.9", 60_007), HandleProtocol.UDP, 5023)
        assert handle is not None
        self.udp: Handle = handle

    def arrived(self) -> list[DataRecord]:
        return [decode(data) for handle, data in self.bench.machine.take_messages() if handle is self.udp]

    def samples(self) -> list[int]:
        return [record.sample for record in self.arrived()]


def test_a_record_every_n_samples_without_a_colon() -> None:
    stage = Stage()
    stage.bench.do("DR 8,1")
    stage.bench.at(1.0)
    messages = stage.bench.machine.take_messages()
    assert len(messages) == 128
    assert {(handle, len(data)) for handle, data in messages} == {(stage.udp, 190)}
    assert [decode(data).sample for _, data in messages] == list(range(8, 1025, 8))


@pytest.mark.parametrize(("text", "period"), [("DR 8,1", 8), ("DR 101,1", 100), ("DR 30000,1", 30_000), ("DR 9,1", 8)])
def test_period_is_even_and_printed(text: str, period: int) -> None:
    stage = Stage()
    stage.bench.do(text)
    assert (stage.bench.say("DR ?"), stage.bench.value("_DR0"), stage.bench.value("_DR1")) == (
        f" {period}\r\n:",
        period,
        1.0,
    )
    stage.bench.do("DR 0")
    assert (stage.bench.value("_DR0"), stage.bench.value("_DR1")) == (0.0, 0.0)
    stage.bench.at(100.0)
    assert stage.samples() == []


def test_records_are_of_their_instant_however_late_they_are_taken() -> None:
    stage = Stage()
    stage.bench.do("SHA;SPA=10240;ACA=1024000;DCA=1024000;JGA=10240;BGA", "DR 128,1")
    stage.bench.at(1.0)
    positions = [record.axes[0].reference for record in stage.arrived()]
    steps = [late - early for early, late in itertools.pairwise(positions)]
    assert steps == [1280] * 7


def test_the_stream_does_not_drift_over_an_hour() -> None:
    stage = Stage()
    stage.bench.do("DR 1000,1")
    stage.bench.at(3600.0)
    assert stage.samples() == [count % 65536 for count in range(1000, 3600 * 1024 + 1, 1000)]


def test_without_a_handle_records_follow_cf() -> None:
    stage = Stage()
    stage.bench.do("CF B", "DR 64")
    assert stage.bench.value("_DR1") == 1.0
    stage.bench.at(0.5)
    assert stage.samples() == list(range(64, 513, 64))
    stage.bench.do("CF S")
    stage.bench.at(1.0)
    assert stage.samples() == []
    assert stage.bench.value("_DR0") == 64.0


def test_the_stream_ends_with_its_handle() -> None:
    stage = Stage()
    stage.bench.do("DR 64,1", "IHB=>-1")
    stage.bench.at(0.5)
    assert (stage.samples(), stage.bench.value("_DR0")) == ([], 0.0)


def test_records_pause_while_a_program_is_downloaded() -> None:
    stage = Stage()
    stage.bench.do("DR 64,1")
    stage.bench.at(0.25)
    assert stage.samples() == [64, 128, 192, 256]
    assert stage.bench.raw("DL\r") == b""
    stage.bench.at(0.5)
    assert stage.samples() == []
    assert stage.bench.raw("\\") == b"::"
    stage.bench.at(0.75)
    assert stage.samples() == [576, 640, 704, 768]


@pytest.mark.parametrize("command", ["BN", "BP", "BV"])
def test_records_pause_while_memory_is_burned(command: str) -> None:
    stage = Stage()
    stage.bench.do("DR 1024,1", command)
    stage.bench.at(BURN_TIME + 2.5)
    first = int(BURN_TIME) * 1024
    assert stage.samples() == [first, first + 1024, first + 2048]


def test_a_reset_ends_the_stream() -> None:
    stage = Stage()
    stage.bench.do("DR 8,1", "RS")
    stage.bench.at(1.0)
    assert (stage.arrived(), stage.bench.value("_DR0")) == ([], 0.0)


def test_the_machine_is_woken_for_the_next_record() -> None:
    stage = Stage()
    stage.bench.do("DR 100,1")
    assert stage.bench.machine.wake() == pytest.approx(100 * SAMPLE, abs=1e-12)
    stage.bench.at(0.2)
    assert stage.bench.machine.wake() == pytest.approx(300 * SAMPLE, abs=1e-12)
