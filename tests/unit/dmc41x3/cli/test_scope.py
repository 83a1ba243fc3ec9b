from __future__ import annotations

import struct
from pathlib import Path

import pytest

from dmc41x3.cli import scope
from dmc41x3.cli.scope import ChannelSample, ScopeRecording, ScopeRequest
from dmc41x3.errors import CodedError, FileUnwritable, InvalidValue
from tests.unit.dmc41x3.cli.bench import driven

RECORDING = ScopeRecording(
    ("_TPA", "_TTB", "x"), (ChannelSample(0.0, (0.0, -0.25, 1.0)), ChannelSample(0.5, (123456789.0, 9.998, 2.5)))
)


async def recorded(request: ScopeRequest, *commands: str) -> ScopeRecording:
    async with driven() as driver:
        await driver.batch(commands)
        taken: list[ChannelSample] = []
        await scope.record(driver, request, taken)
        return ScopeRecording(request.channels, tuple(taken))


def test_a_table_has_units_in_its_titles() -> None:
    assert scope.as_csv(RECORDING) == (
        "time [s],_TPA [counts],_TTB [V],x\n0.000000,0,-0.25,1\n0.500000,123456789,9.998,2.5\n"
    )


def test_a_picture_has_a_plot_for_every_quantity() -> None:
    one = scope.as_png(ScopeRecording(("_TPA", "_RPA"), RECORDING.samples[:0]))
    three = scope.as_png(RECORDING)
    assert three.startswith(b"\x89PNG\r\n")
    heights = [struct.unpack(">I", picture[20:24])[0] for picture in (one, three)]
    assert heights == [round(110 * 3.4), round(110 * 8.2)]


async def test_it_begins_when_the_trigger_says() -> None:
    request = ScopeRequest(("_TPA",), rate=100.0, seconds=0.5, trigger="_TPA>5000")
    recording = await recorded(request, "ACA=1024000", "SPA=10000", "PRA=50000", "BGA")
    first = recording.samples[0].values[0]
    assert 5000.0 < first <= 5000.0 + 2 * 10000 / 100 + 50
    assert len(recording.samples) == 51
    assert recording.rate == pytest.approx(100.0, rel=0.01)


async def test_combined_triggers_keep_their_parentheses() -> None:
    recording = await recorded(ScopeRequest(("x",), 10.0, 0.1, "(x=3)&(y=4)"), "x=3", "y=4")
    assert len(recording.samples) == 2


@pytest.mark.parametrize(
    "request_",
    [ScopeRequest(("_TPA",), rate=0.0), ScopeRequest(("_TPA",), rate=501.0), ScopeRequest(("_TPA",), 50.0, 0.0)],
)
async def test_rates_and_lengths_have_bounds(request_: ScopeRequest) -> None:
    with pytest.raises(InvalidValue):
        await recorded(request_)


async def test_a_trigger_the_controller_does_not_know_is_refused() -> None:
    with pytest.raises(CodedError, match="nothing"):
        await recorded(ScopeRequest(("_TPA",), 10.0, 0.1, "nothing>1"))


def test_files_are_written_or_refused(tmp_path: Path) -> None:
    request = ScopeRequest(RECORDING.channels, csv=str(tmp_path / "a.csv"), png=str(tmp_path / "a.png"))
    scope.save(RECORDING, request)
    assert (tmp_path / "a.csv").read_text(encoding="utf-8") == scope.as_csv(RECORDING)
    assert (tmp_path / "a.png").stat().st_size > 1000
    with pytest.raises(FileUnwritable):
        scope.save(RECORDING, ScopeRequest(RECORDING.channels, csv=str(tmp_path / "no" / "a.csv")))


def test_channels_are_named_once() -> None:
    assert scope.split_channels(" _TPA,_TEA ,_TPA,") == ("_TPA", "_TEA")
    with pytest.raises(InvalidValue):
        scope.split_channels(" ,")


@pytest.mark.parametrize("samples", [(), RECORDING.samples[:1]])
def test_too_few_samples_have_no_rate(samples: tuple[ChannelSample, ...]) -> None:
    assert ScopeRecording(("_TPA", "_TTB", "x"), samples).rate == 0.0
