"""Faults on demand: the table, what each fault does to a controller, and that it ends."""

from __future__ import annotations

import asyncio
from math import inf

import pytest

from dmc41x3.driver import Driver
from dmc41x3.errors import InvalidValue, UnknownName
from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.plant import BenchPlant
from dmc41x3.twin.wire.faults import TABLE, Disturbance, Value, find
from dmc41x3.twin.wire.server import VirtualController
from dmc41x3.wire.transport import LoopbackTransport
from tests.virtual_time import elapse


def made(seed: int = 0) -> VirtualController:
    return VirtualController(VirtualDmc(BenchPlant()), seed=seed)


async def received(host: LoopbackTransport) -> bytes:
    """Return what has arrived by now, nothing where nothing has."""
    reading = asyncio.ensure_future(host.read())
    await elapse(0.0)
    if reading.done():
        return reading.result()
    reading.cancel()
    return b""


def test_every_fault_is_described_and_its_defaults_are_good() -> None:
    assert len({fault.name for fault in TABLE}) == len(TABLE)
    for fault in TABLE:
        assert fault.words.endswith(".")
        values = fault.read({})
        assert list(values) == [parameter.name for parameter in fault.parameters]
        assert fault.read({name: str(value) for name, value in values.items()}) == values
        assert not fault.duration or fault.duration in values


@pytest.mark.parametrize(
    ("name", "given", "read"),
    [
        ("latency", {"seconds": "0.2"}, {"seconds": 0.2, "jitter": 0.0}),
        ("garbage", {"bytes": "3"}, {"probability": 0.1, "bytes": 3}),
        ("stuck_limit", {"active": "off", "axis": "C"}, {"axis": "C", "side": "forward", "active": False}),
        ("stuck_limit", {"active": False}, {"axis": "A", "side": "forward", "active": False}),
        ("cut", {"handles": "BD"}, {"handles": "BD"}),
    ],
)
def test_parameters_are_read_from_text_too(name: str, given: dict[str, Value], read: dict[str, Value]) -> None:
    assert find(name).read(given) == read


@pytest.mark.parametrize(
    ("name", "given"),
    [
        ("latency", {"seconds": -1.0}),
        ("latency", {"seconds": "nan"}),
        ("latency", {"seconds": "x"}),
        ("drop", {"probability": 1.1}),
        ("garbage", {"bytes": 2.5}),
        ("garbage", {"bytes": 451}),
        ("stuck_limit", {"side": "left"}),
        ("stuck_limit", {"axis": "a"}),
        ("stuck_limit", {"active": "perhaps"}),
        ("cut", {"handles": ""}),
        ("cut", {"handles": "AZ"}),
    ],
)
def test_bad_values_are_refused_by_name(name: str, given: dict[str, Value]) -> None:
    with pytest.raises(InvalidValue) as caught:
        find(name).read(given)
    assert caught.value.details["key"] in given


def test_unknown_names_are_refused() -> None:
    with pytest.raises(UnknownName, match="latency"):
        find("nope")
    with pytest.raises(UnknownName, match="jitter"):
        find("latency").read({"speed": 1.0})
    with pytest.raises(UnknownName, match="no parameters"):
        find("reset").read({"speed": 1.0})


async def test_latency_delays_and_keeps_the_order() -> None:
    virtual = made()
    host = virtual.loopback()
    virtual.faults.inject("latency", {"seconds": 0.5, "jitter": 0.4})
    for number in range(10):
        host.write(f"MG {number}\r".encode())
        await elapse(0.01)
    await elapse(0.3)
    assert await received(host) == b""
    await elapse(1.0)
    assert await received(host) == b"".join(f" {number}.0000\r\n:".encode() for number in range(10))
    virtual.faults.clear()
    host.write(b"MG 1\r")
    assert await received(host) == b" 1.0000\r\n:"
    await virtual.close()


async def test_a_reply_after_the_fault_does_not_overtake_one_of_before() -> None:
    virtual = made()
    host = virtual.loopback()
    virtual.faults.inject("latency", {"seconds": 1.0})
    host.write(b"MG 1\r")
    await elapse(0.5)
    virtual.faults.clear()
    host.write(b"MG 2\r")
    await elapse(0.1)
    assert await received(host) == b""
    await elapse(1.0)
    assert await received(host) == b" 1.0000\r\n: 2.0000\r\n:"
    await virtual.close()


@pytest.mark.parametrize(
    ("name", "reply"), [("drop", b""), ("duplicate", b" 1.0000\r\n: 1.0000\r\n:"), ("refuse_commands", b"?")]
)
async def test_reply_faults(name: str, reply: bytes) -> None:
    virtual = made()
    host = virtual.loopback()
    virtual.faults.inject(name, {"probability": 1.0}, seconds=2.0)
    host.write(b"MG 1\r")
    assert await received(host) == reply
    await elapse(2.5)
    assert virtual.faults.active == []
    host.write(b"MG 2\r")
    assert await received(host) == b" 2.0000\r\n:"
    await virtual.close()


async def test_a_refused_command_is_not_carried_out() -> None:
    virtual = made()
    host = virtual.loopback()
    virtual.faults.inject("refuse_commands", {"probability": 1.0})
    host.write(b"x=5;SPA=2000\r")
    assert await received(host) == b"??"
    virtual.faults.clear("refuse_commands")
    host.write(b"TC;MG _SPA;MG x\r")
    assert await received(host) == b" 1\r\n: 25000.0000\r\n:?"
    await virtual.close()


async def test_garbage_precedes_a_reply_and_the_seed_repeats_it() -> None:
    heards: list[bytes] = []
    for seed in (1, 1, 2):
        virtual = made(seed)
        host = virtual.loopback()
        virtual.faults.inject("garbage", {"probability": 1.0, "bytes": 20})
        host.write(b"MG 1\r")
        data = await received(host)
        assert (len(data), data[20:]) == (20 + 10, b" 1.0000\r\n:")
        heards.append(data[:20])
        await virtual.close()
    assert heards[0] == heards[1] != heards[2]


def test_probabilities_follow_the_settings() -> None:
    wire = Disturbance(3)
    wire.drop = 0.25
    lost = sum(not wire.outgoing(b":") for _ in range(4000))
    assert 900 < lost < 1100
    wire.drop, wire.balk = 0.0, 0.1
    assert 300 < sum(wire.balks() for _ in range(4000)) < 500
    wire.latency, wire.jitter = 1.0, 0.5
    delays = [wire.delay() for _ in range(4000)]
    assert (1.0 <= min(delays) < 1.01, 1.49 < max(delays) <= 1.5) == (True, True)


async def test_half_open_connection_is_silent_and_returns() -> None:
    virtual = made()
    silent, lively = virtual.loopback(), virtual.loopback()
    virtual.faults.inject("half_open", {"handles": "A"})
    silent.write(b"x=1\rMG 1\r")
    lively.write(b"WH;MG x\r")
    assert (await received(silent), await received(lively)) == (b"", b"IHB\r\n:?")
    virtual.faults.clear()
    silent.write(b"WH\r")
    assert await received(silent) == b"IHA\r\n:"
    await virtual.close()


async def test_a_peer_that_leaves_half_open_keeps_its_handle_until_the_fault_ends() -> None:
    virtual = made()
    silent = virtual.loopback()
    virtual.faults.inject("half_open")
    await silent.close()
    await elapse(1.0)
    assert virtual.connections == "A"
    virtual.faults.clear()
    assert virtual.connections == ""
    await virtual.close()


async def test_sending_on_a_half_open_handle_gives_it_up_after_the_retries() -> None:
    virtual = made()
    silent, lively = virtual.loopback(), virtual.loopback()
    lively.write(b"IA<1024\r")
    assert await received(lively) == b":"
    virtual.faults.inject("half_open", {"handles": "A"})
    lively.write(b'MG {EA}"are you there"\r')
    await elapse(4.9)
    assert virtual.connections == "AB"
    await elapse(0.2)
    assert virtual.connections == "B"
    assert await received(lively) == b":"
    lively.write(b"MG _TC,_IA4,_IHA2\r")
    assert await received(lively) == b" 123.0000 0.0000 0.0000\r\n:"
    virtual.faults.clear()
    assert await silent.read() == b""
    await virtual.close()


async def test_cut_severs_the_named_peers_and_ends_at_once() -> None:
    virtual = made()
    hosts = [virtual.loopback() for _ in range(3)]
    virtual.faults.inject("cut", {"handles": "AC"})
    assert (virtual.connections, virtual.faults.active) == ("B", [])
    assert [await hosts[place].read() for place in (0, 2)] == [b"", b""]
    await virtual.close()


async def test_refused_connections() -> None:
    virtual = made()
    stays = virtual.loopback()
    virtual.faults.inject("refuse_connections", seconds=1.0)
    assert await virtual.loopback().read() == b""
    stays.write(b"MG 1\r")
    assert await received(stays) == b" 1.0000\r\n:"
    await elapse(1.1)
    virtual.loopback()
    assert virtual.connections == "AB"
    await virtual.close()


async def test_reset_forgets_unburned_settings_and_kills_every_link() -> None:
    virtual = made()
    driver = await Driver.open(virtual.loopback(), timeout=1.0)
    await driver.batch(["SPA=2000", "BN", "SPA=4000", "x=1", "SH", "JGA=1000", "BGA"])
    await elapse(2.0)
    virtual.faults.inject("reset")
    await asyncio.wait([driver.lost])
    again = await Driver.open(virtual.loopback(), timeout=1.0)
    assert [await again.value(name) for name in ("_SPA", "_TPA", "_BGA", "_MOA")] == [2000.0, 0.0, 0.0, 1.0]
    await driver.close()
    await again.close()
    await virtual.close()


async def test_a_power_cycle_is_dark_for_its_outage() -> None:
    virtual = made()
    driver = await Driver.open(virtual.loopback(), timeout=1.0)
    await driver.batch(["SH", "SB 1", "JGA=1000", "BGA"])
    await elapse(2.0)
    virtual.faults.inject("power_cycle", {"outage": 3.0})
    await asyncio.wait([driver.lost])
    assert await virtual.loopback().read() == b""
    assert not any(axis.on or axis.moving for axis in virtual.machine.unit.axes)
    await elapse(3.5)
    again = await Driver.open(virtual.loopback(), timeout=1.0)
    assert await again.value("TIME") == pytest.approx(0.5 * 1024, abs=1.0)
    assert await again.value("_OP0") == 0.0
    await driver.close()
    await again.close()
    await virtual.close()


async def test_a_power_cycle_without_an_outage_is_over_in_an_instant() -> None:
    virtual = made()
    virtual.loopback()
    virtual.faults.inject("power_cycle")
    await elapse(0.001)
    assert (virtual.connections, virtual.faults.active) == ("", [])
    host = virtual.loopback()
    host.write(b"WH\r")
    assert await received(host) == b"IHA\r\n:"
    await virtual.close()


async def test_stuck_limit_reads_the_same_for_any_polarity() -> None:
    virtual = made()
    driver = await Driver.open(virtual.loopback(), timeout=1.0)
    for polarity in (-1, 1):
        await driver.send(f"CN {polarity}")
        virtual.faults.inject("stuck_limit", {"axis": "B", "side": "reverse"})
        virtual.faults.inject("stuck_limit", {"axis": "B", "active": False})
        assert [await driver.value(name) for name in ("_LFB", "_LRB")] == [1.0, 0.0]
        assert len(virtual.faults.active) == 2
        virtual.faults.clear()
        assert [await driver.value(name) for name in ("_LFB", "_LRB")] == [float(polarity == -1)] * 2
    await driver.close()
    await virtual.close()


async def test_a_limit_that_sticks_stops_the_axis_there_and_then() -> None:
    virtual = made()
    driver = await Driver.open(virtual.loopback(), timeout=1.0)
    await driver.batch(["SH", "JGA=10000", "BGA"])
    await elapse(1.0)
    virtual.faults.inject("stuck_limit", {"axis": "A"}, seconds=1.0)
    await elapse(0.5)
    assert [await driver.value(name) for name in ("_BGA", "_SCA")] == [0.0, 2.0]
    await elapse(1.0)
    assert await driver.value("_LFA") == 1.0
    await driver.close()
    await virtual.close()


async def test_encoder_that_stops_counting() -> None:
    virtual = made()
    driver = await Driver.open(virtual.loopback(), timeout=1.0)
    await driver.batch(["SH", "ERA=1000", "OEA=1", "JGA=10000", "BGA"])
    await elapse(1.0)
    virtual.faults.inject("encoder_loss", {"axis": "A"})
    await elapse(1.0)
    assert [await driver.value(name) for name in ("_BGA", "_MOA", "_SCA")] == [0.0, 1.0, 8.0]
    await driver.close()
    await virtual.close()


async def test_the_emergency_stop_and_the_amplifiers() -> None:
    virtual = made()
    driver = await Driver.open(virtual.loopback(), timeout=1.0)
    await driver.batch(["SH", "OE*=1", "JGA=1000", "BGA"])
    virtual.faults.inject("abort_input")
    assert [await driver.value(name) for name in ("_AB", "_SCA", "_MOA")] == [0.0, 6.0, 1.0]
    virtual.faults.clear("abort_input")
    assert await driver.value("_AB") == 1.0
    virtual.faults.inject("amplifier_fault", {"status": 1 << 25})
    assert await driver.value("_TA0") == 2.0
    virtual.faults.clear()
    assert await driver.value("_TA0") == 0.0
    await driver.close()
    await virtual.close()


async def test_an_axis_that_there_is_not_is_refused() -> None:
    virtual = made()
    with pytest.raises(InvalidValue, match="ABC"):
        virtual.faults.inject("encoder_loss", {"axis": "D"})
    assert virtual.faults.active == []
    await virtual.close()


async def test_one_like_it_replaces_a_fault_and_its_end() -> None:
    virtual = made()
    virtual.faults.inject("drop", {"probability": 0.5}, seconds=1.0)
    virtual.faults.inject("drop", {"probability": 0.7}, seconds=inf)
    virtual.faults.inject("latency", seconds=5.0)
    await elapse(2.0)
    assert [(one.fault.name, one.until) for one in virtual.faults.active] == [("drop", None), ("latency", 5.0)]
    assert virtual.wire.drop == 0.7
    virtual.faults.clear("latency")
    assert virtual.wire.latency == 0.0
    assert [one.fault.name for one in virtual.faults.active] == ["drop"]
    await virtual.close()


async def test_closing_ends_nothing_later() -> None:
    virtual = made()
    virtual.faults.inject("abort_input", seconds=10.0)
    await virtual.close()
    await elapse(20.0)
    assert [one.fault.name for one in virtual.faults.active] == ["abort_input"]


async def test_a_reset_in_an_outage_changes_nothing() -> None:
    virtual = made()
    virtual.faults.inject("power_cycle", {"outage": 2.0})
    virtual.faults.inject("reset")
    assert await virtual.loopback().read() == b""
    await elapse(2.5)
    virtual.loopback()
    assert virtual.connections == "A"
    await virtual.close()


async def test_a_burned_program_starts_again_after_an_outage() -> None:
    virtual = made()
    host = virtual.loopback()
    host.write(b"DL\r#AUTO\rup=TIME\rWT 500\rup=TIME\rEN\r\\BP\r")
    assert await received(host) == b":::"
    virtual.faults.inject("power_cycle", {"outage": 10.0})
    await elapse(10.25)
    again = virtual.loopback()
    again.write(b"MG up<10\r")
    assert await received(again) == b" 1.0000\r\n:"
    await elapse(0.5)
    again.write(b"MG (up>500)&(up<530)\r")
    assert await received(again) == b" 1.0000\r\n:"
    await virtual.close()
