from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest

from dmc41x3.driver import Driver
from maya_un.config import Config, Units
from maya_un.controller import homing_mark
from maya_un.testing import rig
from maya_un.values import Joints
from tests.unit.controller.bench import HERE, commands_in, homed
from tests.unit.dmc41x3.scripted import conversation
from tests.virtual_time import elapse

CONFIG = Config()
UNITS = Units.of(CONFIG)
ENDS = ["mayaendb=2250000", "mayaendc=2290000"]


@asynccontextmanager
async def wire() -> AsyncIterator[Driver]:
    async with rig() as bench:
        yield bench.controller._monitor.link.driver


@pytest.mark.parametrize(
    "left",
    [
        [],
        ["mayahome=9", *ENDS],
        ["ZAA=9"],
        ["mayahome=9", "ZAA=8", *ENDS],
        ["mayahome=0", "ZAA=0", *ENDS],
        ["mayahome=9", "ZAB=9", *ENDS],
        ["mayahome=9", "ZAA=9", "mayaendb=2250000"],
    ],
    ids=["nothing", "variable alone", "ZA alone", "other numbers", "erased", "other axis", "an end is missing"],
)
async def test_half_a_mark_is_invalid(left: list[str]) -> None:
    async with wire() as driver:
        await driver.batch(left)
        assert await homing_mark.read(driver, CONFIG, UNITS, HERE) is None


@pytest.mark.parametrize(
    ("here", "holds"),
    [
        (HERE, True),
        (Joints(0.0, 0.575, 2.300), True),
        (Joints(0.0, 2.260 * 1.03, 0.565), True),
        (Joints(1.0, 0.0, 0.0), False),
        (Joints(1.0, 1.5, 0.0), False),
        (Joints(1.0, 0.0, 1.5), False),
        (Joints(1.0, -1.5, 1.5), False),
        (Joints(1.0, 1.5, 2.5), False),
    ],
)
async def test_mark_is_valid_for_possible_lengths_of_the_lines(here: Joints, holds: bool) -> None:
    async with wire() as driver:
        await driver.batch(["mayahome=9", "ZAA=9", *ENDS])
        found = await homing_mark.read(driver, CONFIG, UNITS, here)
        assert found == (pytest.approx((2.25, 2.29)) if holds else None)


def configured(**minimum: float) -> Config:
    """Return a configuration with other short ends."""
    axes = {name: getattr(CONFIG.axes, name).model_copy(update={"minimum": value}) for name, value in minimum.items()}
    return CONFIG.model_copy(update={"axes": CONFIG.axes.model_copy(update=axes)})


@pytest.mark.parametrize(
    ("noted", "minimum", "holds"),
    [
        ({}, {}, True),
        ({}, {"b": 0.571}, False),
        ({"b": 571_000}, {"b": 0.571}, True),
        ({"b": 571_000}, {}, False),
        ({"c": 565_001}, {}, False),
        ({"a": 212}, {"a": 0.01}, False),
        ({"a": 213}, {"a": 0.01}, True),
    ],
)
async def test_a_mark_holds_while_the_switches_are_called_the_same(
    noted: dict[str, int], minimum: dict[str, float], holds: bool
) -> None:
    """A calibration moves `axes.*.minimum`; counts of a homing before it are off by that much then."""
    async with wire() as driver:
        await driver.batch(["mayahome=9", "ZAA=9", *ENDS, *(f"mayamin{axis}={at}" for axis, at in noted.items())])
        found = await homing_mark.read(driver, configured(**minimum), UNITS, HERE)
        assert (found is not None) is holds


async def test_scale_alone_keeps_the_counts() -> None:
    """If the datum keeps its counts, only lengths change: the mark is valid, its ends are scaled."""
    config = configured(b=0.46, c=0.452)
    scale = config.scale.model_copy(update={"pulses_per_metre": 1.25e6})
    config = config.model_copy(update={"scale": scale})
    async with wire() as driver:
        await driver.batch(["mayahome=9", "ZAA=9", *ENDS])
        assert await homing_mark.read(driver, config, Units.of(config), HERE) == pytest.approx((1.8, 1.832))


@pytest.mark.parametrize(("axis", "command"), [(0, "mayamina=0"), (1, "mayaminb=575000"), (2, "mayaminc=565000")])
def test_the_datum_is_noted_in_counts(axis: int, command: str) -> None:
    assert homing_mark.datum(CONFIG, UNITS, axis) == command


@pytest.mark.parametrize("after", [0.0, 1.0, 1e5])
async def test_a_mark_that_was_left_is_found_until_it_is_erased(after: float) -> None:
    async with wire() as driver:
        await elapse(after)
        await homing_mark.leave(driver, (2.2513, 2.2987), UNITS)
        assert await homing_mark.read(driver, CONFIG, UNITS, HERE) == pytest.approx((2.2513, 2.2987))
        await homing_mark.erase(driver)
        assert await homing_mark.read(driver, CONFIG, UNITS, HERE) is None


@pytest.mark.parametrize("time", [0, 1, 2, 2**31 - 1, -(2**31), -1])
async def test_the_number_of_a_mark_is_never_zero_and_fits_both_places(time: int) -> None:
    answers = {"MG TIME": f" {time}.0000\r\n:".encode()}
    async with conversation(lambda command: answers.get(command, b":")) as (driver, peer):
        await homing_mark.leave(driver, (2.2, 2.2), UNITS)
    told = dict(command.split("=") for command in peer.commands if "=" in command)
    assert told["mayahome"] == told["ZAA"]
    assert 0 < int(told["ZAA"]) < 2**31


async def test_variable_is_written_last_and_erased_first() -> None:
    async with homed() as bench:
        del bench.sent[:]
        driver = bench.controller._monitor.link.driver
        await homing_mark.erase(driver)
        await homing_mark.leave(driver, (2.2, 2.2), UNITS)
        names = [command.split("=")[0] for command in commands_in(bytes(bench.sent)) if "=" in command]
        assert names == ["mayahome", "ZAA", "ZAA", "mayaendb", "mayaendc", "mayagiv", "mayahome"]
