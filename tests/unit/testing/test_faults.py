"""Faults for the length of a block."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import AbstractContextManager

import pytest

from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.plant import BenchPlant
from dmc41x3.twin.wire.faults import TABLE
from dmc41x3.twin.wire.server import VirtualController
from maya_un.errors import InvalidValue
from maya_un.testing import faults
from tests.virtual_time import elapse

Begin = Callable[[VirtualController], AbstractContextManager[object]]


def made() -> VirtualController:
    return VirtualController(VirtualDmc(BenchPlant()))


def test_every_fault_has_a_block() -> None:
    assert [fault.name for fault in TABLE if not callable(getattr(faults, fault.name, None))] == []


@pytest.mark.parametrize(
    ("begin", "name", "values"),
    [
        (lambda v: faults.latency(v, 0.2, jitter=0.1), "latency", {"seconds": 0.2, "jitter": 0.1}),
        (lambda v: faults.drop(v, 0.5), "drop", {"probability": 0.5}),
        (faults.duplicate, "duplicate", {"probability": 1.0}),
        (lambda v: faults.garbage(v, 0.5, count=3), "garbage", {"probability": 0.5, "bytes": 3}),
        (faults.refuse_commands, "refuse_commands", {"probability": 1.0}),
        (lambda v: faults.half_open(v, "AB"), "half_open", {"handles": "AB"}),
        (faults.refuse_connections, "refuse_connections", {}),
        (faults.cut, "refuse_connections", {}),
        (faults.power_cycle, "power_cycle", {"outage": 0.0}),
        (
            lambda v: faults.stuck_limit(v, "B", "reverse", active=False),
            "stuck_limit",
            {"axis": "B", "side": "reverse", "active": False},
        ),
        (lambda v: faults.encoder_loss(v, "C"), "encoder_loss", {"axis": "C"}),
        (faults.abort_input, "abort_input", {}),
        (faults.amplifier_fault, "amplifier_fault", {"status": faults.OVERCURRENT}),
    ],
)
async def test_a_fault_lasts_as_long_as_its_block(begin: Begin, name: str, values: dict[str, object]) -> None:
    virtual = made()
    with pytest.raises(KeyError), begin(virtual):
        assert [(one.fault.name, one.values) for one in virtual.faults.active] == [(name, values)]
        await elapse(5000.0)
        assert [one.fault.name for one in virtual.faults.active] == [name]
        raise KeyError
    assert virtual.faults.active == []
    await virtual.close()


async def test_blocks_of_one_kind_nest() -> None:
    virtual = made()
    virtual.faults.inject("latency", {"seconds": 1.0}, seconds=10.0)
    with faults.latency(virtual, 2.0):
        with faults.latency(virtual, 3.0):
            assert virtual.wire.latency == 3.0
            await elapse(4.0)
        assert virtual.wire.latency == 2.0
    assert (virtual.wire.latency, virtual.faults.active[0].until) == (1.0, 10.0)
    await elapse(7.0)
    assert virtual.wire.latency == 0.0
    await virtual.close()


async def test_expired_fault_does_not_return() -> None:
    virtual = made()
    virtual.faults.inject("drop", seconds=1.0)
    with faults.drop(virtual):
        await elapse(2.0)
    assert virtual.faults.active == []
    await virtual.close()


async def test_switches_of_two_axes_stick_side_by_side() -> None:
    virtual = made()
    with faults.stuck_limit(virtual, "A"), faults.stuck_limit(virtual, "B", "reverse"):
        assert len(virtual.faults.active) == 2
    assert virtual.faults.active == []
    await virtual.close()


async def test_cut_network_refuses_connections() -> None:
    virtual = made()
    host = virtual.loopback()
    with faults.cut(virtual):
        assert await host.read() == b""
        assert await virtual.loopback().read() == b""
    virtual.loopback()
    assert virtual.connections == "A"
    await virtual.close()


async def test_a_reset_happens_once() -> None:
    virtual = made()
    with faults.reset(virtual):
        host = virtual.loopback()
        host.write(b"x=1\r")
        assert await host.read() == b":"
    host.write(b"MG x\r")
    assert await host.read() == b" 1.0000\r\n:"
    await virtual.close()


async def test_a_bad_value_is_refused_before_the_block() -> None:
    virtual = made()
    with pytest.raises(InvalidValue), faults.latency(virtual, -1.0):
        raise AssertionError
    with pytest.raises(InvalidValue), faults.encoder_loss(virtual, "H"):
        raise AssertionError
    assert (virtual.faults.active, asyncio.get_running_loop().time()) == ([], 0.0)
    await virtual.close()
