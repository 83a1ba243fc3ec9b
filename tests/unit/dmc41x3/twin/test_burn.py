"""BN, BP, BV, RS, ^R^S: the settings of a controller at power-up."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from dmc41x3.language.codes import ErrorCode
from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.memory import Memory
from dmc41x3.twin.plant import BenchPlant
from tests.unit.dmc41x3.twin.bench import Bench


def machine(path: Path) -> Bench:
    """Return a new machine that has the memory of a file."""
    bench = Bench(servo=False)
    bench.machine = VirtualDmc(bench.plant, memory=Memory(path))
    bench.handle = bench.connect()
    return bench


@pytest.mark.parametrize(
    ("setup", "operand", "value"),
    [
        ("SPB=2000", "_SPB", 2000.0),
        ("KPC=20.5", "_KPC", 20.5),
        ("FLA=5000;BLA=-5000", "_BLA", -5000.0),
        ("VS 3000;VA 2048", "_VAS", 2048.0),
        ("VST=6000", "_VST", 6000.0),
        ("CN 1,1,1,1,1", "_CN4", 1.0),
        ("PF 6.2", "_PF", 6.2),
        ("PF -8.4", "_PF", -8.4),
        ("VF 4.1", "_VF", 4.1),
        ("LZ 0", "_LZ", 0.0),
        ("EO 0", "_EO", 0.0),
        ("CF C", "_CF", 67.0),
        ("TM 2000", "_TM", 2000.0),
        ("CW 1", "_CW", 1.0),
        ("DH 0;IA 10,1,2,3", "_IA0", 0x0A010203),
        ("IA<99", "_IA1", 99.0),
        ("MU 1,2,3,4", "_MU", 0x01020304),
        ("SM 1,2,3,4", "_SM", 0x01020304),
    ],
)
def test_burned_parameters_survive_a_reset_and_a_power_cycle(
    setup: str, operand: str, value: float, tmp_path: Path
) -> None:
    bench = machine(tmp_path / "memory.json")
    before = bench.value(operand)
    bench.do(setup, "RS")
    assert bench.value(operand) == pytest.approx(before, abs=1e-4)
    bench.do(setup, "BN", "RS")
    assert bench.value(operand) == pytest.approx(value, abs=1e-4)
    assert machine(tmp_path / "memory.json").value(operand) == pytest.approx(value, abs=1e-4)


def test_blocked_ports_are_burned_and_zs_outputs_and_user_values_are_not() -> None:
    bench = Bench()
    bench.do("IK 0;SB 1;ZAA=5;VV 100;x=1", "BN", "RS")
    assert bench.say("IK ?") == " 0\r\n:"
    assert [bench.value(operand) for operand in ("_OP0", "_ZAA", "_VVS")] == [0.0, 0.0, 0.0]
    assert bench.code("MG x") == ErrorCode.VARIABLE_ERROR


@pytest.mark.parametrize(("state", "off"), [("SH", [0.0, 0.0, 0.0]), ("SH;MOB", [0.0, 1.0, 0.0]), ("MO", [1.0] * 3)])
def test_motors_power_up_as_burned(state: str, off: list[float]) -> None:
    bench = Bench(servo=False)
    bench.do(state, "BN", "MO;SHB", "RS")
    assert [bench.value(f"_MO{axis}") for axis in "ABC"] == off
    assert [not on for on in bench.plant.powered] == [bool(value) for value in off]


def test_variables_are_burned_by_bv_alone(tmp_path: Path) -> None:
    bench = machine(tmp_path / "memory.json")
    bench.do("x=1.5", "DM a[3];a[1]=-7.25", "BN", "RS")
    assert bench.code("MG x") == ErrorCode.VARIABLE_ERROR
    bench.do("x=1.5", "DM a[3];a[1]=-7.25", "BV", "x=9;a[1]=9", "RS")
    for one in (bench, machine(tmp_path / "memory.json")):
        assert (one.value("x"), one.value("a[1]"), one.value("a[-1]")) == (1.5, -7.25, 3.0)


def test_a_program_is_burned_by_bp_and_runs_at_power_up(tmp_path: Path) -> None:
    bench = machine(tmp_path / "memory.json")
    assert bench.raw("DL\r#AUTO\rup=7\rEN\r\\") == b"::"
    bench.do("BP")
    again = machine(tmp_path / "memory.json")
    again.at(1.0)
    assert again.value("up") == 7.0
    assert again.say("UL").startswith("#AUTO\r\nup=7\r\nEN\r\n")
    again.raw("DL\r\\")
    again.do("RS")
    assert again.say("UL").startswith("#AUTO\r\n")


def test_rs_minus_1_starts_with_factory_settings_once() -> None:
    bench = Bench()
    bench.do("SPA=2000;x=1", "BN;BV", "RS -1")
    assert bench.value("_SPA") == 25000.0
    assert bench.code("MG x") == ErrorCode.VARIABLE_ERROR
    bench.do("RS")
    assert (bench.value("_SPA"), bench.value("x")) == (2000.0, 1.0)


def test_master_reset_erases_burned_settings(tmp_path: Path) -> None:
    path = tmp_path / "memory.json"
    bench = machine(path)
    bench.do("SPA=2000;x=1", "BN;BV", "\x12\x13")
    assert not path.exists()
    assert bench.value("_SPA") == 25000.0
    bench.do("RS")
    assert bench.code("MG x") == ErrorCode.VARIABLE_ERROR


def test_a_reset_answers_and_closes_all_handles() -> None:
    bench = Bench()
    mine, other = bench.handle, bench.connect()
    assert bench.say("CF B;RS;SPA=2000") == "::"
    assert (mine.open, other.open) == (False, False)
    assert (bench.value("_IA4"), bench.value("_CF"), bench.value("_SPA")) == (-1.0, 83.0, 25000.0)


@pytest.mark.parametrize(
    ("part", "bit", "kept"),
    [("variables", 1.0, ["_SPA"]), ("parameters", 2.0, ["x"]), ("program", 4.0, ["_SPA", "x"])],
)
def test_damaged_part_is_reported_and_the_rest_comes_up(tmp_path: Path, part: str, bit: float, kept: list[str]) -> None:
    path = tmp_path / "memory.json"
    bench = machine(path)
    bench.raw("DL\r#AUTO\rEN\r\\")
    bench.do("SPA=2000;x=2000", "BN;BP;BV")
    found = json.loads(path.read_text(encoding="utf-8"))
    found[part]["checksum"] += 1
    path.write_text(json.dumps(found), encoding="utf-8")
    again = machine(path)
    assert (again.value("_RS"), again.value("_TC")) == (bit, float(ErrorCode.CHECKSUM))
    assert [again.value(name) for name in kept] == [2000.0] * len(kept)
    again.do("BN;BP;BV")
    assert machine(path).value("_RS") == 0.0


def test_autoerr_runs_instead_of_auto_if_the_memory_is_damaged(tmp_path: Path) -> None:
    path = tmp_path / "memory.json"
    bench = machine(path)
    bench.raw("DL\r#AUTO\rgood=1\rEN\r#AUTOERR\rbad=_RS\rEN\r\\")
    bench.do("BN;BP")
    found = json.loads(path.read_text(encoding="utf-8"))
    found["parameters"]["data"] = None
    path.write_text(json.dumps(found), encoding="utf-8")
    again = machine(path).at(1.0)
    assert again.value("bad") == 2.0
    assert again.code("MG good") == ErrorCode.VARIABLE_ERROR


def test_values_out_of_range_in_a_file_leave_the_factorys(tmp_path: Path) -> None:
    memory = Memory(tmp_path / "memory.json")
    memory.contents.parameters = {
        "A": {"SP": 1e12, "AC": "x", "KP": 7.0, "nope": 1.0, "motor_off": False},
        "Q": {"SP": 1.0},
        "unit": {"PF": "99.9", "VF": "8.2", "CF": "Q", "IA": "1.2.3", "LZ": "x", "CN0": 5.0},
    }
    memory.store()
    bench = machine(tmp_path / "memory.json")
    assert [bench.value(f"_{name}") for name in ("SPA", "ACA", "KPA", "PF", "CF", "LZ", "CN0")] == [
        25000.0, 256000.0, 7.0, 10.0, 83.0, 1.0, -1.0
    ]  # fmt: skip
    assert bench.say("VF ?") == " 8.2\r\n:"


def test_a_memory_that_cannot_be_written_is_error_15(tmp_path: Path) -> None:
    bench = machine(tmp_path / "nowhere" / "memory.json")
    assert bench.code("BN") == ErrorCode.WRITE


def test_power_cycle_keeps_the_shafts_in_place() -> None:
    bench = Bench()
    bench.do("DP 1000,2000,3000", "SB 1", "JGA=10000;BGA")
    bench.at(2.0)
    there = bench.plant.position(0)
    bench.machine.power_off()
    assert bench.plant.powered == [False] * 3
    assert not bench.plant.outputs[1]
    bench.machine.advance(5.0)
    bench.machine.power_on()
    bench.now = 5.0
    assert bench.plant.position(0) == pytest.approx(there, abs=1.0)
    assert bench.positions() == [0, 0, 0]
    assert bench.value("TIME") == 0.0


def test_eight_axes_are_burned_too(tmp_path: Path) -> None:
    path = tmp_path / "memory.json"
    first = VirtualDmc(BenchPlant(8), axes=8, memory=Memory(path))
    handle = first.connect()
    assert handle is not None
    assert first.receive(handle, b"SPH=4000;BN\r", 0.0) == b"::"
    second = VirtualDmc(BenchPlant(8), axes=8, memory=Memory(path))
    handle = second.connect()
    assert handle is not None
    assert second.receive(handle, b"MG _SPH\r", 0.0) == b" 4000.0000\r\n:"


@pytest.mark.parametrize(("command", "code"), [("BN", 17), ("BP", 17), ("BV", 0)])
def test_a_host_may_burn_only_variables_while_a_program_runs(command: str, code: int) -> None:
    bench = Bench()
    assert bench.raw("DL\r#A\rWT 1000\rJP #A\r\\") == b"::"
    bench.do("XQ #A")
    bench.at(0.1)
    assert bench.say(command) == ("?" if code else ":")
    assert bench.value("_TC") == code


def test_a_program_may_burn() -> None:
    bench = Bench()
    assert bench.raw("DL\r#A\rSPA=2000\rBN\rEN\r\\") == b"::"
    bench.do("XQ #A")
    bench.at(0.1).do("SPA=4000", "RS")
    assert bench.value("_SPA") == 2000.0


def test_a_program_is_not_burned_in_motion() -> None:
    bench = Bench()
    bench.do("JGA=100;BGA", "BN", "BV")
    assert bench.code("BP") == ErrorCode.NOT_WHILE_RUNNING
