from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest

from dmc41x3.wire.transport import Transport
from maya_un.config import Config
from maya_un.config.files import parse
from maya_un.controller.controller import GalilController
from maya_un.controller.registers import GROUPS, Registers, identify, wanted
from maya_un.errors import CommandRejected, LinkTimeout, ParameterMismatch, WrongController
from maya_un.testing import Rig, rig
from tests.unit.controller.bench import FIRMWARE, box, commands_in, foreign
from tests.unit.dmc41x3.scripted import conversation


def changed(**b: object) -> Config:
    return parse({"axes": {"b": b}, "wiring": {"limit_active_level": 1}})


@pytest.mark.parametrize(
    ("operand", "value"),
    [
        ("_SPA", 1_000),
        ("_SPB", 45_000),
        ("_ACA", 1_024),
        ("_ACC", 5_120),
        ("_DCA", 10_240),
        ("_DCB", 51_200),
        ("_SDC", 51_200),
        ("_ERA", 742),
        ("_ERC", 8_000),
        ("_OEA", 1),
        ("_LDB", 0),
        ("_CN0", -1),
    ],
)
async def test_the_manuals_values_are_in_the_controller_once_connected(operand: str, value: float) -> None:
    async with rig() as bench:
        assert [float(reply) for reply in await foreign(bench, f"MG {operand}")] == [value]


async def test_earlier_values_are_overwritten() -> None:
    async with rig() as bench:
        await foreign(bench, "OE*=3", "LD*=3", "ER*=1", "CN 1", "SD*=1024", "TM 500")
        await Registers(bench.controller.config).configure(bench.controller._monitor.link.driver)
        replies = await foreign(bench, *(f"MG {operand}" for operand in wanted(bench.controller.config)))
        assert [float(reply) for reply in replies] == pytest.approx(
            list(wanted(bench.controller.config).values()), abs=5e-4
        )


async def test_values_rounded_by_the_controller_are_no_mismatch() -> None:
    config = changed(speed_counts=30_001, acceleration_counts=6_000, stop_deceleration_counts=52_000)
    async with rig(config) as bench:
        assert await foreign(bench, "MG _SPB", "MG _ACB", "MG _DCB", "MG _CN0") == [
            "30000.0000",
            "5120.0000",
            "51200.0000",
            "1.0000",
        ]


def test_a_drum_that_does_not_lock_keeps_its_motor_on_after_an_error() -> None:
    assert wanted(parse({"safety": {"self_locking": False}}))["_OEB"] == 0
    assert wanted(parse({"safety": {"off_on_error": 0}}))["_OEB"] == 0


@pytest.mark.parametrize(("register", "found"), [("ERB", "16384.0000"), ("OEC", "0.0000"), ("CN0", "1.0000")])
async def test_a_register_that_was_not_kept_is_named(register: str, found: str) -> None:
    async with conversation(box(Config(), **{register: found})) as (driver, _):
        with pytest.raises(ParameterMismatch) as mismatch:
            await Registers(Config()).configure(driver)
    requested = wanted(Config())[f"_{register}"]
    assert mismatch.value.details == {"register": register, "found": f"{float(found):g}", "wanted": f"{requested:g}"}


async def test_all_is_written_before_anything_is_read_back() -> None:
    async with conversation(box(Config())) as (driver, peer):
        await Registers(Config()).configure(driver)
    count = len(wanted(Config()))
    assert peer.commands.pop(0) == "VF 10.4"
    assert [command.startswith("MG") for command in peer.commands] == [False] * count + [True] * len(GROUPS)


@pytest.mark.parametrize("form", ["VF -8.4", "VF -4.0", "VF 1.0"])
async def test_number_format_of_other_hosts_does_not_matter(form: str) -> None:
    async with rig() as bench:
        await foreign(bench, form)
        await Registers(bench.controller.config).configure(bench.controller._monitor.link.driver)


@pytest.mark.parametrize(
    "firmware", [FIRMWARE, "DMC4133 Rev 1.1a1", "DMC4143 Rev 1.3a", "DMC4183 Rev 1.3h", "DMC4133 Rev 1.2h1-SIN"]
)
async def test_controllers_with_three_axes_or_more_will_do(firmware: str) -> None:
    async with conversation(box(Config(), firmware)) as (driver, _):
        assert await identify(driver, "box") == firmware


@pytest.mark.parametrize(
    "firmware",
    ["DMC4080 Rev 1.2h1-SIN", "DMC2133 Rev 1.0r", "DMC4123 Rev 1.3a", "DMC4113", "DMC50040 Rev 1.2", "DMC41x3", "SSH"],
)
async def test_other_devices_are_refused_by_name(firmware: str) -> None:
    async with conversation(box(Config(), firmware)) as (driver, peer):
        with pytest.raises(WrongController) as refusal:
            await identify(driver, "10.0.0.7")
    assert refusal.value.details == {"address": "10.0.0.7", "found": firmware}
    assert peer.commands == ["\x12\x16"]


async def test_control_characters_of_another_device_are_not_repeated() -> None:
    async with conversation(box(Config(), "DMC4133 Rev \x1b[2J")) as (driver, _):
        with pytest.raises(WrongController, match=r"\\x1b\[2J"):
            await identify(driver, "box")


async def test_devices_without_an_answer_are_refused() -> None:
    async with conversation(lambda _: b"\r\n:") as (driver, _):
        with pytest.raises(WrongController, match="silent"):
            await identify(driver, "box")
    async with conversation(lambda _: None) as (driver, _):
        with pytest.raises(LinkTimeout):
            await identify(driver, "box")
    async with conversation(lambda command: b"1 no\r\n:" if command == "TC1" else b"?") as (driver, _):
        with pytest.raises(CommandRejected):
            await identify(driver, "box")


async def test_connecting_says_nothing_that_moves() -> None:
    async with rig() as bench:
        said = {command[:2] for command in commands_in(bytes(bench.sent))}
        assert said == {
            "\x12\x16",
            "QR",
            "MG",
            "TC",
            "VF",
            "TM",
            "CN",
            "SP",
            "AC",
            "DC",
            "SD",
            "ER",
            "OE",
            "LD",
            "FL",
            "BL",
        } | {"TK", "TL", "GR"}


@asynccontextmanager
async def opened(bench: Rig) -> AsyncIterator[GalilController]:
    """Give another program's controller, after the one of `bench` has ended."""
    await bench.controller.close()

    async def dial() -> Transport:
        return bench.virtual.loopback()

    another = GalilController(dial, "twin", bench.controller.config)
    await another.open()
    yield another
    await another.close()


async def test_torque_limit_that_a_commissioning_left_does_not_become_the_machines() -> None:
    async with rig() as bench:
        await foreign(bench, "TLA=1", "mayatla=7.5", "mayatlb=-1")
        async with opened(bench) as controller:
            assert await foreign(bench, "MG _TLA", "MG mayatla", "MG mayatlb") == ["7.5000", "-1.0000", "-1.0000"]
            assert controller._monitor.registers._expected["_TLA"] == 7.5


@pytest.mark.parametrize("noted", ["-1", "10.5"])
async def test_torque_limit_of_the_machine_is_kept_without_a_noted_one(noted: str) -> None:
    async with rig() as bench:
        await foreign(bench, "TLA=6", f"mayatla={noted}")
        async with opened(bench):
            assert [float(reply) for reply in await foreign(bench, "MG _TLA")] == pytest.approx([6.0], abs=1e-3)
