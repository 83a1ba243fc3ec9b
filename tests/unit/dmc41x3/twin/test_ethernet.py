"""Commands about handles and addresses. The wire itself is in test_wire.py."""

from __future__ import annotations

import pytest

from dmc41x3.language.codes import ErrorCode
from dmc41x3.twin.network import Handle, HandleProtocol
from tests.unit.dmc41x3.twin.bench import Bench


def udp(bench: Bench, port: int = 60_007) -> Handle:
    """Return one more handle, taken by a datagram."""
    handle = bench.machine.connect(("10.0.0.9", port), HandleProtocol.UDP, 5023)
    assert handle is not None
    return handle


@pytest.mark.parametrize(
    ("command", "code"),
    [
        ("IHQ=>-3", ErrorCode.OPERAND_ERROR),
        ("IHB", ErrorCode.OPERAND_ERROR),
        ("IHB=10,0,0", ErrorCode.NOT_ENOUGH_FIELDS),
        ("IHB=10,0,0,256", ErrorCode.OUT_OF_RANGE),
        ("IHB=10,0,0,1<65536", ErrorCode.OUT_OF_RANGE),
        ("IHB=10,0,0,1>3", ErrorCode.OUT_OF_RANGE),
        ("IHA=10,0,0,1", ErrorCode.HANDLE_IN_USE),
        ("IHB=>-2", ErrorCode.HANDLE_CLOSED),
        ("IHS=10,0,0,1", ErrorCode.OPERAND_ERROR),
        ("HSA", ErrorCode.OPERAND_ERROR),
        ("HSA=T", ErrorCode.OPERAND_ERROR),
        ("IK 2", ErrorCode.OUT_OF_RANGE),
        ("IA 10,0,0,1", ErrorCode.NOT_WITH_DHCP),
        ("IA<", ErrorCode.OPERAND_ERROR),
        ("IA 1,2,3,4<250", ErrorCode.OPERAND_ERROR),
        ("IA<0", ErrorCode.OUT_OF_RANGE),
        ("MU 1,2,3", ErrorCode.NOT_ENOUGH_FIELDS),
        ("SM 256,0,0,0", ErrorCode.OUT_OF_RANGE),
        ("DH 2", ErrorCode.OUT_OF_RANGE),
        ("DR 8", 0),
        ("DR 8,0", ErrorCode.HANDLE_MUST_BE_UDP),
        ("DR 8,5", ErrorCode.HANDLE_MUST_BE_UDP),
        ("DR 8,8", ErrorCode.OUT_OF_RANGE),
        ("DR 7,1", ErrorCode.OUT_OF_RANGE),
        ("DR 30001", ErrorCode.OUT_OF_RANGE),
        ("DR -1", ErrorCode.OUT_OF_RANGE),
        ("DR 8,0,0", ErrorCode.OPERAND_ERROR),
        ("CF A;DR 8", ErrorCode.HANDLE_MUST_BE_UDP),
        ("CF B;DR 8", ErrorCode.HANDLE_MUST_BE_UDP),
    ],
)
def test_misuse_has_its_code(command: str, code: int) -> None:
    bench = Bench()
    assert bench.say(command).endswith("?" if code else ":")
    assert int(bench.say("TC")[:-3]) == code


@pytest.mark.parametrize(
    ("command", "open_handles"),
    [("IHT=>-1", "AC"), ("IHT=>-2", "AB"), ("IHT=>-3", "A"), ("IHB=>-2", "ABC"), ("IHB=>-1", "AC"), ("IHS=>-1", "ABC")],
)
def test_closing_looks_at_the_kind(command: str, open_handles: str) -> None:
    bench = Bench()
    udp(bench)
    bench.connect()
    bench.do(command)
    assert "".join(handle.letter for handle in bench.machine.unit.handles if handle is not None) == open_handles


def test_handles_show_their_protocol() -> None:
    bench = Bench()
    handle = udp(bench)
    assert bench.say("IHB=?;IHC=?") == " 10, 0, 0, 9\r\n: 0, 0, 0, 0\r\n:"
    assert "\r\nIHB UDP PORT 5023 TO IP ADDRESS 10,0,0,9 PORT 60007\r\n" in bench.say("TH")
    assert bench.value("_IHB2") == 1.0
    assert bench.machine.receive(handle, b"WH\r", 0.0) == b"IHB\r\n:"
    assert bench.record().handles == (2, 1, 0, 0, 0, 0, 0, 0)


@pytest.mark.parametrize(
    ("text", "peer", "kind", "state"),
    [
        ("IHB=10,0,0,7", ("10.0.0.7", 1001), HandleProtocol.TCP, -6),
        ("IHB=10,0,0,7<2000", ("10.0.0.7", 2000), HandleProtocol.TCP, -6),
        ("IHB=10,0,0,7>1", ("10.0.0.7", 1001), HandleProtocol.UDP, -5),
        ("IHB=10,0,0,7<502>2", ("10.0.0.7", 502), HandleProtocol.TCP, -6),
        ("v=7;IHB=10,0,0,v<v*100>1", ("10.0.0.7", 700), HandleProtocol.UDP, -5),
        ("IHB=167772167", ("10.0.0.7", 1001), HandleProtocol.TCP, -6),
    ],
)
def test_a_handle_can_be_opened_by_the_controller(
    text: str, peer: tuple[str, int], kind: HandleProtocol, state: int
) -> None:
    bench = Bench()
    bench.do(text)
    (handle,) = bench.machine.unit.handles.take_dialing()
    assert (handle.peer, handle.kind, handle.index) == (peer, kind, 1)
    assert (bench.value("_IHB2"), bench.value("_IHB3")) == (state, 1.0)
    handle.connected = True
    assert (bench.value("_IHB2"), bench.value("_IHB3")) == (-int(kind), 0.0)
    bench.do(f"IHB=>-{int(kind)}")
    assert bench.value("_IHB2") == 0.0


def test_the_other_side_of_an_opened_handle_answers_and_does_not_command() -> None:
    bench = Bench()
    bench.do("IHB=10,0,0,7", "SPA=2000")
    (handle,) = bench.machine.unit.handles.take_dialing()
    handle.connected = True
    assert bench.value("_IHB4") == 1.0
    assert bench.machine.receive(handle, b"SPA=4000\r:", 0.0) == b""
    assert (bench.value("_IHB4"), bench.value("_SPA")) == (2.0, 2000.0)
    assert bench.machine.receive(handle, b"?", 0.0) == b""
    assert bench.value("_IHB4") == 3.0


def test_swapped_handles_keep_their_connections() -> None:
    bench = Bench()
    other = bench.connect()
    bench.do("HSA=B")
    assert (bench.say("WH"), bench.handle.letter, other.letter) == ("IHB\r\n:", "B", "A")
    bench.do("HSS=D")
    assert (bench.say("WH"), bench.value("_IHB2"), bench.value("_IHD2")) == ("IHD\r\n:", 0.0, 2.0)
    bench.machine.disconnect(bench.handle)
    assert bench.machine.unit.handles.last_lost == 3
    assert bench.machine.unit.handles.at("A") is other


def test_ports_below_1000_are_blocked_until_ik_0() -> None:
    bench = Bench()
    ports = (0, 23, 68, 502, 24, 999, 1000)
    assert [_may_connect(bench, port) for port in ports] == [True, True, True, True, False, False, True]
    assert bench.say("IK ?") == " 1\r\n:"
    bench.do("IK 0")
    assert all(_may_connect(bench, port) for port in ports)


def _may_connect(bench: Bench, port: int) -> bool:
    handle = bench.machine.connect(("10.0.0.1", 4000), port=port)
    if handle is not None:
        bench.machine.disconnect(handle)
    return handle is not None


def test_addresses_are_stored_and_printed() -> None:
    bench = Bench()
    number = int.from_bytes(bytes((10, 51, 0, 87)), "big")
    assert (bench.say("IA ?"), bench.value("_IA0"), bench.value("_IA1")) == (" 10, 51, 0, 87\r\n:", number, 250.0)
    bench.do("DH 0;IA 192,168,1,3", "IA<100", "MU 239,1,2,3", "SM 255,255,255,0")
    signed = int.from_bytes(bytes((192, 168, 1, 3)), "big", signed=True)
    assert (bench.value("_IA0"), bench.value("_IA1"), bench.value("_IA5")) == (signed, 100.0, 100.0)
    assert bench.say("TH").startswith("CONTROLLER IP ADDRESS 192,168,1,3 ETHERNET ADDRESS 00-50-4C-")
    assert bench.say("MU ?;SM ?;DH ?") == " 239, 1, 2, 3\r\n: 255, 255, 255, 0\r\n: 0\r\n:"
    assert bench.value("_MU") == int.from_bytes(bytes((239, 1, 2, 3)), "big", signed=True)
    assert bench.value("_SM0") == -256.0


def test_a_send_that_found_its_connection_gone_is_error_123() -> None:
    bench = Bench()
    told: list[int] = []
    hook = bench.machine.unit.on_tcp_error
    bench.machine.unit.on_tcp_error = told.append
    bench.machine.unit.tcp_error(5)
    bench.machine.unit.on_tcp_error = hook
    assert (told, bench.value("_TC"), bench.value("_IA4")) == ([5], 123.0, 5.0)
