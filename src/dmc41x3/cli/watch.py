"""`dmc watch`: live values, as a table on a screen, as lines elsewhere, as JSON for programs."""

from __future__ import annotations

import asyncio
import json
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

from dmc41x3.cli import dial, output
from dmc41x3.cli.sampling import ChannelSample, Sampler, samples
from dmc41x3.cli.settings import OutputSettings
from dmc41x3.driver import Driver
from dmc41x3.errors import InvalidValue
from dmc41x3.language.channels import columns, unit

if TYPE_CHECKING:
    from rich.table import Table


def watch(address: str, channels: Sequence[str], rate: float, seconds: float | None, settings: OutputSettings) -> int:
    """Show channels `rate` times a second for so long [s], until Ctrl-C for None; return the exit code.

    Without channels it shows position, error, velocity and torque of every axis. Raises as the driver does.
    """
    require_rate(rate)
    if seconds is not None and not seconds >= 0.0:
        raise InvalidValue(key="--for", value=seconds, reason="it is 0 s or more")
    place = dial.meant(address, settings)
    asyncio.run(dial.until_asked(_watch(place, channels, rate, seconds, settings)))
    return output.DONE


def require_rate(rate: float) -> None:
    """Raise `InvalidValue` for a rate that no controller of the family answers at."""
    if not 0.0 < rate <= 500.0:
        raise InvalidValue(key="--rate", value=rate, reason="it is above 0 and at most 500 samples a second")


async def _watch(
    place: str, channels: Sequence[str], rate: float, seconds: float | None, settings: OutputSettings
) -> None:
    async with dial.opened(place, settings.site) as driver:
        sampler = await Sampler.prepare(driver, channels or await _usual(driver))
        if sys.stdout.isatty() and not settings.json:
            await _live(sampler, rate, seconds)
            return
        async for sample in samples(sampler, rate, seconds):
            output.say(json_line(sampler, sample) if settings.json else _plain_line(sampler, sample))


async def _usual(driver: Driver) -> tuple[str, ...]:
    return columns(len((await driver.record()).axes))


async def _live(sampler: Sampler, rate: float, seconds: float | None) -> None:
    from rich.live import Live

    with Live(auto_refresh=False) as screen:
        async for sample in samples(sampler, rate, seconds):
            screen.update(_table(sampler, sample), refresh=True)


def _table(sampler: Sampler, sample: ChannelSample) -> Table:
    from rich.table import Table

    table = Table("channel", title=f"{sample.time:.3f} s", title_justify="left")
    table.add_column("value", justify="right", min_width=14)
    table.add_column("unit")
    for channel, value in zip(sampler.channels, sample.values, strict=True):
        table.add_row(channel, shown(value), unit(channel))
    return table


def json_line(sampler: Sampler, sample: ChannelSample) -> str:
    """Return one sample as one line of JSON: `time` [s], then every channel by its name."""
    return json.dumps({"time": sample.time, **dict(zip(sampler.channels, sample.values, strict=True))})


def _plain_line(sampler: Sampler, sample: ChannelSample) -> str:
    pairs = zip(sampler.channels, sample.values, strict=True)
    return f"{sample.time:.3f}  " + "  ".join(f"{channel} {shown(value)}" for channel, value in pairs)


def shown(value: float) -> str:
    """Return a value for people: whole numbers without, others with four decimals, as the controller has them."""
    return f"{value:.0f}" if value == int(value) else f"{value:.4f}"
