from __future__ import annotations

import asyncio
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from maya_ros.graph.bus import Bus
from maya_ros.ros1.configuration import CONFIG, awaited, checked, configured, settled
from maya_un.config import Config
from maya_un.errors import InvalidConfig, InvalidValue
from tests.virtual_time import elapse


@pytest.fixture(autouse=True)
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    place = tmp_path / "config.toml"
    place.write_text("[controller]\nstream_rate = 30.0\n[cell]\nclearance = 0.2\n")
    monkeypatch.setenv("MAYA_CONFIG", str(place))
    yield place


def rewrite(file: Path) -> None:
    """Have the user's file say something else."""
    file.write_text("[controller]\nstream_rate = 25.0\n")


async def test_parameters_are_laid_over_the_file_and_all_of_it_is_written() -> None:
    parameters = Bus().node("n").parameters
    await parameters.set(CONFIG, {"controller": {"stream_rate": 40.0}})
    async with configured(parameters) as config:
        assert (config.controller.stream_rate, config.cell.clearance) == (40.0, 0.2)
        written: dict[str, Any] = await parameters.get(CONFIG)
        assert written["cell"]["clearance"] == 0.2
        assert written["scale"]["pulses_per_metre"] == Config().scale.pulses_per_metre
        assert await settled(parameters) == config
    assert await parameters.get(CONFIG) == {"controller": {"stream_rate": 40.0}}


async def test_file_of_a_killed_node_is_not_used(file: Path) -> None:
    parameters = Bus().node("n").parameters
    killed = configured(parameters)
    await killed.__aenter__()
    rewrite(file)
    async with configured(parameters) as config:
        assert config.controller.stream_rate == 25.0
    assert await parameters.get(CONFIG, "none") == "none"


async def test_wrong_value_is_refused_by_its_key() -> None:
    parameters = Bus().node("n").parameters
    await parameters.set(CONFIG, {"controller": {"stream_rates": 1.0}})
    with pytest.raises(InvalidConfig) as refused:
        async with configured(parameters):
            pass
    assert refused.value.details["key"] == "controller.stream_rates"


@pytest.mark.parametrize("given", [0, 7, [1], "fast"])
async def test_invalid_group_of_keys_is_refused(given: object) -> None:
    parameters = Bus().node("n").parameters
    await parameters.set(CONFIG, given)
    with pytest.raises(InvalidConfig) as refused:
        async with configured(parameters):
            pass
    assert refused.value.details["key"] == CONFIG


@pytest.mark.parametrize("address", ["sim", "real", "10.0.0.5", "box.local:2323"])
def test_an_address_is_taken_as_it_is(address: str) -> None:
    assert checked(address) == address


@pytest.mark.parametrize("address", ["", "::::", "box:0", "box:x", [1]])
def test_invalid_address_is_refused_by_its_name(address: object) -> None:
    with pytest.raises(InvalidValue) as refused:
        checked(address)
    assert refused.value.details["key"] == "address"


async def test_upper_layers_wait_for_the_configuration_and_report_it_once() -> None:
    parameters = Bus().node("n").parameters
    await parameters.set(CONFIG, {"controller": {"stream_rate": 40.0}})
    said: list[str] = []
    waiting = asyncio.ensure_future(awaited(parameters, waiting=lambda: said.append("waiting")))
    await elapse(5.0)
    assert not waiting.done()
    async with configured(parameters) as config:
        assert await waiting == config
    assert said == ["waiting"]
