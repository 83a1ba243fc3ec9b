"""`dmc watch` and `dmc scope`: sample channels, show them live, record them to a table or a picture."""

from __future__ import annotations

import asyncio
import csv
import io
import json
import sys
from collections.abc import AsyncIterator, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from dmc41x3.cli import connection, console
from dmc41x3.cli.console import OutputSettings, Site
from dmc41x3.driver import Driver
from dmc41x3.errors import CommandRejected, InvalidValue, UnexpectedReply
from dmc41x3.files import write
from dmc41x3.language.commands import LINE_LIMIT
from dmc41x3.language.hardware import SAMPLES
from dmc41x3.language.numbers import parse_number
from dmc41x3.language.record import Reading, SampleClock, columns, quantity, reading, unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D
    from rich.table import Table

_TIME = "TIME"


class ChannelSample(NamedTuple):
    """Values of all channels; `time` is the controller's time [s], 0 at the first sample."""

    time: float
    values: tuple[float, ...]


class Sampler:
    """Takes samples of fixed channels; created by `prepare`."""

    def __init__(self, driver: Driver, channels: Sequence[str], axes: int, period: float) -> None:
        self._driver = driver
        self.channels = tuple(channels)
        self._readings: dict[str, Reading] = {}
        for channel in channels:
            if (read := reading(channel, axes)) is not None:
                self._readings[channel] = read
        asked = [channel for channel in self.channels if channel not in self._readings]
        self._asked = asked if self._readings else [_TIME, *asked]
        self._clock = SampleClock(period)
        self._second = SAMPLES * 1000.0 / period
        self._first: float | None = None

    @classmethod
    async def prepare(cls, driver: Driver, channels: Sequence[str]) -> Sampler:
        """Return a sampler after a check of every channel; raises `CommandRejected` for a refused channel."""
        axes = len((await driver.record()).axes)
        sampler = cls(driver, channels, axes, await _period(driver))
        for channel in sampler._asked:
            await driver.value(channel)
        return sampler

    async def sample(self) -> ChannelSample:
        """Return the present values; raises the driver's errors."""
        if not self._readings:
            found = await self._ask()
            return ChannelSample(self._since_first(found[_TIME]), tuple(found[name] for name in self.channels))
        record, found = await asyncio.gather(self._driver.record(), self._ask())
        found.update({name: read(record) for name, read in self._readings.items()})
        return ChannelSample(self._clock.at(record.sample), tuple(found[name] for name in self.channels))

    async def _ask(self) -> dict[str, float]:
        found: dict[str, float] = {}
        for group in _lines(self._asked):
            command = f"MG {','.join(group)}"
            reply = await self._driver.send(command)
            try:
                numbers = [parse_number(word) for word in reply.split()]
                found.update(zip(group, numbers, strict=True))
            except ValueError as error:
                raise UnexpectedReply(command=command, reply=reply) from error
        return found

    def _since_first(self, time: float) -> float:
        if self._first is None:
            self._first = time
        return (time - self._first) / self._second


async def _period(driver: Driver) -> float:
    """Return TM [µs], or its default if the controller does not report it."""
    try:
        return await driver.value("_TM") or 1000.0
    except CommandRejected:
        return 1000.0


def _lines(channels: Sequence[str]) -> Iterator[list[str]]:
    """Yield the channels in groups that fit on one line of the controller."""
    group: list[str] = []
    for channel in channels:
        if group and len(f"MG {','.join([*group, channel])}") > LINE_LIMIT:
            yield group
            group = []
        group.append(channel)
    if group:
        yield group


async def samples(sampler: Sampler, rate: float, seconds: float | None) -> AsyncIterator[ChannelSample]:
    """Yield `rate` samples a second for `seconds` [s], or without end for None; late samples are left out."""
    async for _ in ticks(rate, seconds):
        yield await sampler.sample()


async def ticks(rate: float, seconds: float | None) -> AsyncIterator[int]:
    """Yield `rate` numbers a second, beginning with 0 immediately; late numbers are left out."""
    loop = asyncio.get_running_loop()
    start = loop.time()
    tick = 0
    while seconds is None or tick <= seconds * rate + 1e-9:
        await asyncio.sleep(max(0.0, start + tick / rate - loop.time()))
        yield tick
        tick = max(tick + 1, int((loop.time() - start) * rate))


def watch(address: str, channels: Sequence[str], rate: float, seconds: float | None, settings: OutputSettings) -> int:
    """Show channels `rate` times a second for `seconds` [s], or until Ctrl-C for None; return the exit code.

    Without channels it shows position, error, velocity and torque of every axis. Raises `InvalidValue` and the
    driver's errors.
    """
    require_rate(rate)
    if seconds is not None and not seconds >= 0.0:
        raise InvalidValue(key="--for", value=seconds, reason="it is 0 s or more")
    place = connection.meant(address, settings)
    asyncio.run(connection.until_asked(_watch(place, channels, rate, seconds, settings)))
    return console.DONE


def require_rate(rate: float) -> None:
    """Raise `InvalidValue` for a rate [samples/s] that no controller of the family supports."""
    if not 0.0 < rate <= 500.0:
        raise InvalidValue(key="--rate", value=rate, reason="it is above 0 and at most 500 samples a second")


async def _watch(
    place: str, channels: Sequence[str], rate: float, seconds: float | None, settings: OutputSettings
) -> None:
    async with connection.opened(place, settings.site) as driver:
        sampler = await Sampler.prepare(driver, channels or await _usual(driver))
        if sys.stdout.isatty() and not settings.json:
            await _live(sampler, rate, seconds)
            return
        async for sample in samples(sampler, rate, seconds):
            console.say(json_line(sampler, sample) if settings.json else _plain_line(sampler, sample))


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
    """Return a value as text: whole numbers without decimals, others with four, as the controller prints them."""
    return f"{value:.0f}" if value == int(value) else f"{value:.4f}"


_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Colours that remain distinct with colour blindness (Okabe and Ito)."""


class ScopeRequest(NamedTuple):
    """A requested recording: `rate` samples a second for `seconds` [s], once `trigger` is not 0; paths of the files."""

    channels: tuple[str, ...]
    rate: float = 50.0
    seconds: float = 5.0
    trigger: str | None = None
    csv: str | None = None
    png: str | None = None


class ScopeRecording(NamedTuple):
    """A finished recording."""

    channels: tuple[str, ...]
    samples: tuple[ChannelSample, ...]

    @property
    def rate(self) -> float:
        """The actual rate by the controller's clock [samples/s]; 0 for fewer than two samples."""
        took = self.samples[-1].time - self.samples[0].time if self.samples else 0.0
        return (len(self.samples) - 1) / took if took > 0.0 else 0.0


def split_channels(text: str) -> tuple[str, ...]:
    """Return the distinct channels of `_TPA,_TEA`, in order; raises `InvalidValue` if there are none."""
    channels = tuple(dict.fromkeys(part for part in (piece.strip() for piece in text.split(",")) if part))
    if not channels:
        raise InvalidValue(key="--channels", value=repr(text), reason="it names at least one, as in _TPA,_TEA")
    return channels


def scope(address: str, request: ScopeRequest, settings: OutputSettings) -> int:
    """Record; write the result to files, or print it as a table without files. Return the exit code.

    Ctrl-C ends the recording early and keeps the samples so far. Raises `FileUnwritable` and the driver's errors.
    """
    recording = asyncio.run(_scope(connection.meant(address, settings), request, settings.site))
    save(recording, request)
    if request.csv is None and request.png is None and not settings.json:
        console.say(as_csv(recording).rstrip("\n"))
        return console.DONE
    return console.answer(_report(recording, request), summary(recording, request), settings)


async def _scope(place: str, request: ScopeRequest, site: Site) -> ScopeRecording:
    async with connection.opened(place, site) as driver:
        taken: list[ChannelSample] = []
        await connection.until_asked(record(driver, request, taken))
        return ScopeRecording(request.channels, tuple(taken))


async def record(driver: Driver, request: ScopeRequest, taken: list[ChannelSample]) -> None:
    """Wait for the trigger and append samples to `taken`; raises `InvalidValue` and the driver's errors."""
    require_rate(request.rate)
    if not 0.0 < request.seconds <= 3600.0:
        raise InvalidValue(key="--for", value=request.seconds, reason="it is above 0 and at most 3600 s")
    sampler = await Sampler.prepare(driver, request.channels)
    if request.trigger is not None:
        async for _ in ticks(request.rate, None):
            if await driver.value(f"({request.trigger})"):
                break
    async for sample in samples(sampler, request.rate, request.seconds):
        taken.append(sample)


def save(recording: ScopeRecording, request: ScopeRequest) -> None:
    """Write the requested files; raises `FileUnwritable`."""
    if request.csv is not None:
        write(Path(request.csv), as_csv(recording).encode())
    if request.png is not None:
        write(Path(request.png), as_png(recording))


def _report(recording: ScopeRecording, request: ScopeRequest) -> dict[str, object]:
    values = [[sample.time, *sample.values] for sample in recording.samples]
    kept = {} if request.csv or request.png else {"columns": ["time", *recording.channels], "values": values}
    return {"samples": len(values), "rate": recording.rate, "csv": request.csv, "png": request.png, **kept}


def summary(recording: ScopeRecording, request: ScopeRequest) -> str:
    """Return one line that states what was recorded and where it is stored."""
    places = ", ".join(place for place in (request.csv, request.png) if place is not None)
    return f"{len(recording.samples)} samples, {recording.rate:.1f} a second: {places or 'nowhere written'}"


def _title(channel: str) -> str:
    return f"{channel} [{unit(channel)}]" if unit(channel) else channel


def as_csv(recording: ScopeRecording) -> str:
    """Return a recording as CSV: a header with units, then one line for each sample, with the time [s] first."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["time [s]", *map(_title, recording.channels)])
    table.writerows(
        [f"{sample.time:.6f}", *(f"{value:.10g}" for value in sample.values)] for sample in recording.samples
    )
    return text.getvalue()


def as_png(recording: ScopeRecording) -> bytes:
    """Return a recording as a PNG image: one plot for each quantity, with a common time axis."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    groups = _by_quantity(recording.channels)
    figure = Figure(figsize=(10.0, 1.0 + 2.4 * len(groups)), dpi=110, facecolor="white", layout="constrained")
    FigureCanvasAgg(figure)
    plots = figure.subplots(len(groups), 1, sharex=True, squeeze=False)[:, 0]
    for plot, (label, places) in zip(plots, groups.items(), strict=True):
        lines = [_drawn(plot, recording, place) for place in places]
        names = [recording.channels[place] for place in places]
        plot.legend(lines, names, loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=11)
        plot.set_ylabel(label, fontsize=12)
        plot.grid(color="#dddddd", linewidth=0.8)
        plot.tick_params(labelsize=11)
    plots[-1].set_xlabel("time [s]", fontsize=12)
    picture = io.BytesIO()
    figure.savefig(picture, format="png")
    return picture.getvalue()


def _drawn(plot: Axes, recording: ScopeRecording, place: int) -> Line2D:
    times = [sample.time for sample in recording.samples]
    values = [sample.values[place] for sample in recording.samples]
    (line,) = plot.plot(times, values, color=_COLOURS[place % len(_COLOURS)], linewidth=1.6)
    return line


def _by_quantity(channels: tuple[str, ...]) -> dict[str, list[int]]:
    groups: dict[str, list[int]] = {}
    for place, channel in enumerate(channels):
        label = f"{quantity(channel)}\n[{unit(channel)}]" if unit(channel) else quantity(channel)
        groups.setdefault(label, []).append(place)
    return groups
