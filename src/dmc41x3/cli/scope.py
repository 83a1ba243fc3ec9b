"""`dmc scope`: channels recorded for a while, from a trigger on, to a table (CSV) and a picture (PNG)."""

from __future__ import annotations

import asyncio
import csv
import io
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from dmc41x3.cli import dial, output
from dmc41x3.cli.sampling import ChannelSample, Sampler, samples, ticks
from dmc41x3.cli.settings import OutputSettings
from dmc41x3.cli.site import Site
from dmc41x3.cli.watch import require_rate
from dmc41x3.driver import Driver
from dmc41x3.errors import InvalidValue
from dmc41x3.files import write
from dmc41x3.language.channels import quantity, unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D

_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Colours that people with any eyes tell apart (Okabe and Ito)."""


class ScopeRequest(NamedTuple):
    """What to record: `rate` samples a second for `seconds` [s], once `trigger` is not 0; files by their paths."""

    channels: tuple[str, ...]
    rate: float = 50.0
    seconds: float = 5.0
    trigger: str | None = None
    csv: str | None = None
    png: str | None = None


class ScopeRecording(NamedTuple):
    """What was recorded."""

    channels: tuple[str, ...]
    samples: tuple[ChannelSample, ...]

    @property
    def rate(self) -> float:
        """Samples a second that were really taken, by the controller's clock; 0 for fewer than two."""
        took = self.samples[-1].time - self.samples[0].time if self.samples else 0.0
        return (len(self.samples) - 1) / took if took > 0.0 else 0.0


def split_channels(text: str) -> tuple[str, ...]:
    """Return the channels of `_TPA,_TEA`, each once; raises `InvalidValue` where there is none."""
    channels = tuple(dict.fromkeys(part for part in (piece.strip() for piece in text.split(",")) if part))
    if not channels:
        raise InvalidValue(key="--channels", value=repr(text), reason="it names at least one, as in _TPA,_TEA")
    return channels


def scope(address: str, request: ScopeRequest, settings: OutputSettings) -> int:
    """Record and write; without a file the table goes to the screen. Return the exit code.

    Ctrl-C ends the recording early and keeps what there is. Raises `FileUnwritable` and as the driver does.
    """
    recording = asyncio.run(_scope(dial.meant(address, settings), request, settings.site))
    save(recording, request)
    if request.csv is None and request.png is None and not settings.json:
        output.say(as_csv(recording).rstrip("\n"))
        return output.DONE
    return output.answer(_report(recording, request), summary(recording, request), settings)


async def _scope(place: str, request: ScopeRequest, site: Site) -> ScopeRecording:
    async with dial.opened(place, site) as driver:
        taken: list[ChannelSample] = []
        await dial.until_asked(record(driver, request, taken))
        return ScopeRecording(request.channels, tuple(taken))


async def record(driver: Driver, request: ScopeRequest, taken: list[ChannelSample]) -> None:
    """Wait for the trigger and append samples to `taken`; raises `InvalidValue` and as the driver does."""
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
    """Write the files that were asked for; raises `FileUnwritable`."""
    if request.csv is not None:
        write(Path(request.csv), as_csv(recording).encode())
    if request.png is not None:
        write(Path(request.png), as_png(recording))


def _report(recording: ScopeRecording, request: ScopeRequest) -> dict[str, object]:
    values = [[sample.time, *sample.values] for sample in recording.samples]
    kept = {} if request.csv or request.png else {"columns": ["time", *recording.channels], "values": values}
    return {"samples": len(values), "rate": recording.rate, "csv": request.csv, "png": request.png, **kept}


def summary(recording: ScopeRecording, request: ScopeRequest) -> str:
    """Return in one line what was recorded and where it is."""
    places = ", ".join(place for place in (request.csv, request.png) if place is not None)
    return f"{len(recording.samples)} samples, {recording.rate:.1f} a second: {places or 'nowhere written'}"


def _title(channel: str) -> str:
    return f"{channel} [{unit(channel)}]" if unit(channel) else channel


def as_csv(recording: ScopeRecording) -> str:
    """Return a recording as CSV: a line of titles with units, then one line a sample, the time [s] first."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["time [s]", *map(_title, recording.channels)])
    table.writerows(
        [f"{sample.time:.6f}", *(f"{value:.10g}" for value in sample.values)] for sample in recording.samples
    )
    return text.getvalue()


def as_png(recording: ScopeRecording) -> bytes:
    """Return a recording as a picture: one plot above the other for every quantity, over the same time."""
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
