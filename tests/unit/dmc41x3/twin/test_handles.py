from __future__ import annotations

import pytest

from dmc41x3.twin.network import COUNT, HandleProtocol, Handles
from tests.unit.dmc41x3.twin.bench import Bench


def full() -> Handles:
    handles = Handles()
    for port in range(COUNT):
        handles.connect(("10.0.0.1", port))
    return handles


def test_the_first_free_handle_is_given() -> None:
    handles = full()
    assert (handles.free, handles.connect(("10.0.0.2", 1))) == (0, None)
    for letter in "FB":
        handle = handles.at(letter)
        assert handle is not None
        handles.close(handle)
    assert handles.free == 2
    assert [again.letter for _ in "BF" if (again := handles.connect(("10.0.0.2", 1)))] == ["B", "F"]


def test_a_handle_is_given_back_once() -> None:
    handles = full()
    old = handles.at("C")
    assert old is not None
    handles.close(old)
    assert (old.open, handles.last_lost, handles.at("C")) == (False, 2, None)
    new = handles.connect(("10.0.0.2", 1))
    handles.close(old)
    assert handles.at("C") is new
    assert new is not None
    assert new.open


def test_states_are_those_of_the_data_record() -> None:
    handles = Handles()
    handles.connect(("10.0.0.1", 1))
    second = handles.connect(("10.0.0.1", 2))
    handles.connect(("10.0.0.1", 3))
    assert second is not None
    handles.close(second)
    tcp = HandleProtocol.TCP
    assert handles.states() == (tcp, 0, tcp, 0, 0, 0, 0, 0)


def test_operands_of_handles() -> None:
    bench = Bench()
    handle = bench.machine.connect(("192.168.1.3", 40_000))
    assert handle is not None
    assert bench.value("_IHB0") == int.from_bytes(bytes((192, 168, 1, 3)), "big", signed=True)
    assert [bench.value(f"_IHB{item}") for item in (1, 2, 3, 4)] == [40_000.0, 2.0, 0.0, 1.0]
    assert [bench.value(f"_IHC{item}") for item in range(5)] == [0.0] * 5
    assert bench.machine.receive(handle, b"MG _WH,_IA3;WH\r", 0.0) == b" 1.0000 1.0000\r\n:IHB\r\n:"
    assert "IHB TCP PORT 23 TO IP ADDRESS 192,168,1,3 PORT 40000\r\n" in bench.say("TH")
    bench.machine.disconnect(handle)
    assert (bench.value("_IHB2"), bench.value("_IA4"), bench.value("_IA2")) == (0.0, 1.0, 7.0)


@pytest.mark.parametrize("host", ["::1", "localhost", "300.1.1.1", "1.2.3"])
def test_a_host_without_four_bytes_has_zeros(host: str) -> None:
    bench = Bench()
    assert bench.machine.connect((host, 5)) is not None
    assert bench.value("_IHB0") == 0.0
    assert "IHB TCP PORT 23 TO IP ADDRESS 0,0,0,0 PORT 5" in bench.say("TH")


@pytest.mark.parametrize(
    ("command", "mine", "other"),
    [
        ("IHT=>-3", True, False),
        ("IHT=>-2", True, False),
        ("IHT=-3", True, False),
        ("IHT=>-1", True, True),
        ("IHS=>-3", False, True),
        ("IHS=>-1", True, True),
        ("IHA=>-2", False, True),
        ("IHB=>-3", True, False),
        ("IH B => -3", True, False),
    ],
)
def test_commands_close_their_handles(command: str, mine: bool, other: bool) -> None:
    bench = Bench()
    second = bench.connect()
    assert bench.say(command) == ":"
    assert (bench.handle.open, second.open) == (mine, other)


def test_commands_behind_hanging_up_are_not_executed() -> None:
    bench = Bench()
    assert bench.say("IHS=>-3;SPA=2000") == ":"
    assert bench.axis(0).registers["SP"] == 25_000.0


def test_motion_continues_without_its_host() -> None:
    bench = Bench()
    bench.do("PRA=5000;BGA")
    bench.machine.disconnect(bench.handle)
    bench.machine.advance(10.0)
    bench.handle = bench.connect()
    assert bench.at(10.0).positions()[0] == 5000
