"""`maya replay`: send the commands of a recording to a new twin, and compare both.

The twin replaces the recorded controller: it is first brought into the controller's state at the start of the replay.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydantic import TypeAdapter

from dmc41x3.i18n import marked, phrase, translate
from dmc41x3.language.hardware import LETTERS
from dmc41x3.language.record import AxisRecord, DataRecord, decode
from dmc41x3.loops import run_virtual
from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.wire.server import VirtualController
from dmc41x3.wire.framing import RecordReply, Reply
from dmc41x3.wire.transcript import WirePiece
from dmc41x3.wire.transport import LoopbackTransport
from maya_un.assembly.controller import machine_of
from maya_un.cli import output
from maya_un.cli.progress import computing
from maya_un.cli.recordings.recordings import found
from maya_un.cli.report import table
from maya_un.cli.settings import OutputSettings
from maya_un.config import Config, Units
from maya_un.config.files import parse
from maya_un.errors import FileUnreadable, InvalidValue
from maya_un.events import HomingBegun
from maya_un.kinematics import Floats
from maya_un.machine.miswired import built
from maya_un.machine.truth import StartPose, TrueConstants
from maya_un.recorder import mcap_file
from maya_un.recorder.compare import Comparison, RecordSample, ReplayDifference, Tolerances, compare, samples
from maya_un.recorder.exchanges import RecordedExchange, RecordedTalk, talk
from maya_un.recorder.recording import Recording, TwinSource

_AXES, _AXIS, _STOP_CODE = 82, 36, 3
"""Offset of the axes in a data record, length of each, and offset of the stop code in it (QR)."""


@dataclass(frozen=True, slots=True)
class ReplayScene:
    """The start of a replay: `pieces` from loop time `begin` [s] on, for a twin in the state of that instant.

    `opening` contains earlier traffic that configured the controller; `record` is the controller's data record at
    `begin`, None for a twin replayed from its power-up. `lacks` contains texts about unavoidable differences.
    """

    begin: float
    pieces: tuple[WirePiece, ...]
    opening: tuple[WirePiece, ...] = ()
    record: DataRecord | None = None
    homed: bool = False
    lacks: tuple[str, ...] = ()


def scene_of(recording: Recording) -> ReplayScene:
    """Return the start: the power-up of a completely recorded twin, else an instant with all axes at rest.

    Raises `ValueError` if no such instant exists.
    """
    header, wire = recording.header, recording.wire
    lacks = list[str]()
    source = header.origin.twin
    if source is not None and header.complete:
        return ReplayScene(source.born, wire)
    if source is None:
        lacks.append(
            marked(
                "The replay uses the friction, lag and stiffness of the twin, and its values of registers that Maya "
                "does not set."
            )
        )
    opening = tuple(piece for piece in wire if piece.time < header.whole)
    rest = wire[len(opening) :]
    resting = _at_rest(talk(rest).exchanges)
    if resting is None or resting.answered is None or not isinstance(resting.reply, RecordReply):
        raise ValueError(phrase("it holds no instant at which the axes were at rest"))
    homed = _homed(recording, resting.answered)
    if not homed:
        lacks.append(marked("The replay does not know the position of the machine before homing."))
    record = decode(resting.reply.data)
    if header.complete:
        return ReplayScene(rest[0].time, rest, (), record, homed, tuple(lacks))
    begin = resting.answered
    later = tuple(piece for piece in rest if piece.time > begin)
    if not opening:
        lacks.append(marked("The replay does not know the registers, program and variables from before the recording."))
    return ReplayScene(begin, later, opening, record, homed, tuple(lacks))


def _at_rest(exchanges: Sequence[RecordedExchange]) -> RecordedExchange | None:
    for exchange in exchanges:
        if isinstance(exchange.reply, RecordReply) and exchange.answered is not None:
            record = decode(exchange.reply.data)
            if not any(axis.moving for axis in record.axes):
                return exchange
    return None


def _homed(recording: Recording, time: float) -> bool:
    """Return whether counts were referenced: the robot was homed, or became so later without a homing in between."""
    if next((state.homed for state in reversed(recording.states) if state.time <= time), False):
        return True
    later = next((state.time for state in recording.states if state.time > time and state.homed), -inf)
    begun = (event.time for event in recording.events if isinstance(event, HomingBegun))
    return later > time and not any(time <= began <= later for began in begun)


def commands_before(scene: ReplayScene, config: Config) -> bytes:
    """Return the commands that bring a new twin into the state of the recorded controller at the start of the scene.

    If the commands that configured the controller were recorded, they come before the commands that set the state.
    Commands derived from the replies in the recording set the program and the variables.
    """
    state, known = _lines(_preparation(scene, config)), _lines(_earlier_answers(scene.opening or scene.pieces))
    if not scene.opening:
        return state + known
    return known + b"".join(piece.data for piece in scene.opening if piece.side == "client") + state


def _lines(commands: Iterable[str]) -> bytes:
    return "".join(f"{command}\r" for command in commands).encode()


def _preparation(scene: ReplayScene, config: Config) -> Iterator[str]:
    """Yield the commands for counts, motors, outputs, and the mark of a homing."""
    record = scene.record
    if record is None:
        return
    axes = list(zip(LETTERS, record.axes, strict=False))
    yield f"DP {','.join(str(axis.reference) for _, axis in axes)}"
    on = "".join(letter for letter, axis in axes if not axis.motor_off)
    if on:
        yield f"SH{on}"
    for bit in range(8):
        yield f"{'SB' if record.outputs[0] >> bit & 1 else 'CB'} {bit + 1}"
    yield from (f"ZA{letter}={axis.user}" for letter, axis in axes)
    if scene.homed:
        units = Units.of(config)
        yield f"mayahome={record.axes[0].user}"
        yield f"mayaendb={round(config.axes.b.maximum * units.per_unit[1])}"
        yield f"mayaendc={round(config.axes.c.maximum * units.per_unit[2])}"


def _earlier_answers(pieces: Sequence[WirePiece]) -> Iterator[str]:
    """Yield the commands by which the twin gives the recorded answers to queries of values set before the recording.

    These are its program (UL) and variables.
    """
    told: set[str] = set()
    for exchange in talk(pieces).exchanges:
        name, equals, _ = exchange.command.partition("=")
        if equals:
            told.add(name)
        asked = exchange.command.removeprefix("MG ").strip()
        reply = exchange.reply
        if not isinstance(reply, Reply) or not reply.ok:
            continue
        if exchange.command == "UL" and "UL" not in told:
            told.add("UL")
            text = reply.text.removesuffix("\x1a")
            if text.strip():
                yield "DL\r" + "\r".join(text.splitlines()) + "\r\\"
        elif exchange.command.startswith("MG ") and asked.isidentifier() and asked[0].islower() and asked not in told:
            told.add(asked)
            yield f"{asked}={reply.text.strip()}"


def forget_stop_codes(exchanges: list[RecordedExchange]) -> None:
    """Replace the stop codes from before the replay by that of a new twin (1)."""
    moved: set[int] = set()
    for number, exchange in enumerate(exchanges):
        if not isinstance(exchange.reply, RecordReply):
            continue
        data = bytearray(exchange.reply.data)
        for place, axis in enumerate(decode(exchange.reply.data).axes):
            moved |= {place} if axis.moving else set()
            if place not in moved:
                data[_AXES + place * _AXIS + _STOP_CODE] = 1
        exchanges[number] = exchange._replace(reply=RecordReply(bytes(data)))


_PAST = 1e-5
"""Margin by which a switch is tripped or not [rad, m]."""

_SETTLE = 0.01
"""Waiting time for answers of the twin [s, virtual]."""


class Replayed(NamedTuple):
    """Both runs as exchanges, with the same times; `lacks` as in `ReplayScene`."""

    recorded: RecordedTalk
    replayed: RecordedTalk
    begin: float
    lacks: tuple[str, ...]


async def run_on_twin(recording: Recording, reached: Callable[[float], None] = lambda _: None) -> Replayed:
    """Send the recorded commands to a new twin, each at its time; raises `ValueError` without a possible start.

    Run it in a loop with a virtual clock. It calls `reached` with the part of the recording that is sent, 0 to 1.
    """
    scene = scene_of(recording)
    twin = _twin(recording, scene)
    try:
        pieces = await _Player(twin, scene, parse(recording.header.origin.config), reached).play()
    finally:
        await twin.close()
    recorded = talk(scene.pieces)
    if scene.record is not None:
        forget_stop_codes(recorded.exchanges)
    return Replayed(recorded, talk(pieces), scene.begin, scene.lacks)


def _twin(recording: Recording, scene: ReplayScene) -> VirtualController:
    header = recording.header
    config, source = parse(header.origin.config), header.origin.twin
    truth = _truth(source, config)
    start = _start(source, scene, config, truth)
    parts = {} if source is None else {name: (place[0], place[1], place[2]) for name, place in source.parts.items()}
    _, plant = built(truth, start, parts)
    machine = VirtualDmc(plant, firmware=header.firmware or None)
    if source is not None:
        machine.advance(scene.begin - source.born - _SETTLE)  # its programs depend on its clock
    return VirtualController(machine, seed=0 if source is None else source.seed)


def _truth(source: TwinSource | None, config: Config) -> TrueConstants:
    """Return the constants of the twin: those of the recorded twin, else those of the configuration."""
    if source is not None:
        return TypeAdapter(TrueConstants).validate_python(source.truth)
    return machine_of(config)


def _start(source: TwinSource | None, scene: ReplayScene, config: Config, truth: TrueConstants) -> StartPose:
    """Return the start pose of the twin: that of its counts if homed, and consistent with its limit switches."""
    record = scene.record
    if source is not None and not scene.homed:
        return StartPose(*source.start)
    if record is None:
        return StartPose()
    axes = [record.axes[LETTERS.index(config.axes[axis].letter)] for axis in range(3)]
    a, b, c = (axis.reference for axis in axes)
    places = Units.of(config).to_joints((a, b, c)) if scene.homed else StartPose()
    return StartPose(*(_beside(places[i], axes[i], truth.switches[i]) for i in range(3)))


def _beside(place: float, axis: AxisRecord, switches: tuple[float, float]) -> float:
    """Return the position [rad or m] nearest to `place` at which the limit switches read as recorded."""
    reverse, forward = switches
    if axis.reverse_limit_active:
        return min(place, reverse - _PAST)
    if axis.forward_limit_active:
        return max(place, forward + _PAST)
    return min(max(place, reverse + _PAST), forward - _PAST)


_TURNS = 8
"""Turns of the loop after which a twin has answered commands of the same instant."""


class _Player:
    """Sends the pieces of a replay to a twin, and records both sides of the traffic."""

    def __init__(
        self, twin: VirtualController, scene: ReplayScene, config: Config, reached: Callable[[float], None]
    ) -> None:
        self._twin = twin
        self._scene = scene
        self._config = config
        self._reached = reached
        self._loop = asyncio.get_running_loop()
        self._zero = self._loop.time()
        self._links: dict[int, LoopbackTransport] = {}
        self._readers: dict[int, asyncio.Task[None]] = {}
        self._said: list[WirePiece] = []

    async def play(self) -> list[WirePiece]:
        """Return all traffic, with the times of the recording."""
        scene = self._scene
        try:
            await self._prepare()
            self._zero = self._loop.time()
            for number, piece in enumerate(scene.pieces):
                self._reached(number / len(scene.pieces))
                await self._until(piece.time)
                await self._do(piece)
            await self._until(scene.pieces[-1].time if scene.pieces else scene.begin)
            await asyncio.sleep(_SETTLE)
        finally:
            for link in list(self._links):
                await self._end(link)
        return self._said

    async def _prepare(self) -> None:
        """Bring the twin into the controller's state: first its configuration, then its state at the start.

        The commands use the connection with which the replay continues, because programs send their messages there.
        """
        scene = self._scene
        if scene.record is None or not scene.pieces:
            return
        first = scene.pieces[0]
        self._open(first.link)
        end = self._links[first.link]
        end.write(commands_before(scene, self._config))
        await asyncio.sleep(_SETTLE)
        if first.event == "open":
            await self._end(first.link)
        self._said.clear()

    async def _until(self, time: float) -> None:
        left = self._zero + (time - self._scene.begin) - self._loop.time()
        if left > 0.0:
            await asyncio.sleep(left)

    async def _do(self, piece: WirePiece) -> None:
        if piece.event == "end":
            for _ in range(_TURNS):
                await asyncio.sleep(0)
            await self._end(piece.link)
            return
        if piece.event == "open":
            self._said.append(piece)
        if piece.link not in self._links:
            self._open(piece.link)
        if piece.side == "client" and piece.data:
            self._said.append(piece)
            self._links[piece.link].write(piece.data)

    def _open(self, link: int) -> None:
        self._links[link] = end = self._twin.loopback()
        self._readers[link] = self._loop.create_task(self._read(link, end))

    async def _read(self, link: int, end: LoopbackTransport) -> None:
        while data := await end.read():
            time = self._scene.begin + (self._loop.time() - self._zero)
            self._said.append(WirePiece(time, link, "controller", data))

    async def _end(self, link: int) -> None:
        end, reader = self._links.pop(link, None), self._readers.pop(link, None)
        if end is not None and reader is not None:
            reader.cancel()
            await asyncio.wait({reader})
            await end.close()


HORIZON = 1e9
"""Longest recording that is replayed [s]."""

OF_A_TWIN = Tolerances(counts=2.0, seconds=0.02)
"""Allowed difference between a recording of a twin and its replay; multiplied by the speed of the twin's clock."""

OF_A_LATER_TWIN = Tolerances(counts=50.0, seconds=0.02)
"""The same if the replay does not start at power-up: the guard may act a sample earlier or later (44 counts)."""

OF_A_MACHINE = Tolerances(counts=50.0, seconds=0.1)
"""Allowed difference between a recording of a machine and its replay: 50 µm of a line, a tenth of a second."""

MOST_SHOWN = 40
"""Maximum number of differences on the screen; --json prints all."""

_LEFT_OUT = marked("Not compared: jobs, steps and the queue, because the controller does not know them.")


class ReplayOptions(NamedTuple):
    """Options of `maya replay`; None is the default tolerance for the recording."""

    counts: float | None = None
    seconds: float | None = None
    plot: str | None = None


def replay(file: str, options: ReplayOptions, settings: OutputSettings) -> int:
    """Replay a recording and print the differences; return 0 without differences, else 1.

    Raises `FileUnreadable`, `NotFound`, `InvalidValue`, and `FileUnwritable` for the picture.
    """
    for key, value in (("--counts", options.counts), ("--seconds", options.seconds)):
        if value is not None and not value >= 0.0:
            raise InvalidValue(key=key, value=value, reason="it must be 0 or more")
    if options.plot is not None:
        _require_format(Path(options.plot))
    path = found(file)
    with computing(marked("Replaying"), settings) as display:
        recording = mcap_file.read(path)
        try:
            runs = run_virtual(run_on_twin(recording, display.reached), HORIZON)
        except ValueError as error:
            raise FileUnreadable(path=path, reason=str(error)) from error
        tolerances = tolerated(recording, options)
        comparison = compare(runs.recorded, runs.replayed, tolerances)
        if options.plot is not None:
            _draw(recording, runs, Path(options.plot))
    data = _as_data(path, recording, comparison, tolerances, runs)
    output.answer(data, _as_text(comparison, runs, options, settings), settings)
    return output.FAILED if comparison.differences else output.DONE


def tolerated(recording: Recording, options: ReplayOptions) -> Tolerances:
    """Return the allowed differences: those of the options, else the defaults for a twin or a machine."""
    header = recording.header
    of_twin = OF_A_TWIN if header.complete else OF_A_LATER_TWIN
    least = OF_A_MACHINE if header.origin.twin is None else of_twin
    counts, seconds = (max(1.0, header.origin.speed) * most for most in least)
    return Tolerances(
        counts if options.counts is None else options.counts, seconds if options.seconds is None else options.seconds
    )


def _as_data(
    path: Path, recording: Recording, comparison: Comparison, tolerances: Tolerances, runs: Replayed
) -> dict[str, Any]:
    header = recording.header
    return {
        "file": str(path),
        "reason": header.reason,
        "date": header.date,
        "begin": runs.begin,
        "same": not comparison.differences,
        "tolerances": tolerances._asdict(),
        "commands": comparison.commands,
        "compared": comparison.compared,
        "differences": [one._asdict() for one in comparison.differences],
        "motions": [one._asdict() for one in comparison.motions],
        "ends": [one._asdict() for one in comparison.ends],
        "not_compared": [*runs.lacks, _LEFT_OUT],
    }


def _as_text(comparison: Comparison, runs: Replayed, options: ReplayOptions, settings: OutputSettings) -> str:
    language = settings.language
    lines: list[str] = []
    if comparison.differences:
        head = tuple(translate(text, language) for text in (marked("time [s]"), marked("what"), marked("how")))
        shown = comparison.differences[:MOST_SHOWN]
        lines.append(table(head, [_row(one) for one in shown], right=(0,)))
        if len(comparison.differences) > len(shown):
            lines.append(
                translate("and {count} more; --json has all.", language, count=len(comparison.differences) - len(shown))
            )
        lines.append("")
    if comparison.ends:
        head = tuple(
            translate(text, language)
            for text in (marked("axis"), marked("recorded, at its end [counts]"), marked("replayed"))
        )
        lines += [table(head, [(end.axis, f"{end.recorded}", f"{end.replayed}") for end in comparison.ends]), ""]
    took = [one.recorded for one in comparison.motions if one.recorded is not None]
    lines.append(
        translate(
            "{count} motions, {seconds:.1f} s in all.", language, count=len(comparison.motions), seconds=sum(took)
        )
    )
    lines += [translate(text, language) for text in (*runs.lacks, _LEFT_OUT)]
    count = len(comparison.differences)
    lines.append(
        translate(
            "{compared} answers compared; {differences} differences.",
            language,
            compared=comparison.compared,
            differences=count,
        )
    )
    if options.plot is not None:
        lines.append(translate("Picture: {path}", language, path=options.plot))
    return "\n".join(lines)


def _row(one: ReplayDifference) -> tuple[str, str, str]:
    many = f" (× {one.times})" if one.times > 1 else ""
    return f"{one.time:.3f}", f"{one.what}{many}", one.how


def _require_format(path: Path) -> None:
    from maya_un.plots import style

    style.kind_of(path)


def _draw(recording: Recording, runs: Replayed, path: Path) -> None:
    from maya_un.plots import style
    from maya_un.plots.recording import replay_figure

    config = parse(recording.header.origin.config)
    order = [LETTERS.index(config.axes[axis].letter) for axis in range(3)]
    scale = np.array(Units.of(config).per_unit) * np.array([np.pi / 180.0, 1.0, 1.0])
    recorded, replayed = samples(runs.recorded.exchanges), samples(runs.replayed.exchanges)
    commanded = _course(recorded, "reference", order, scale, runs.begin)
    before, after = (_course(records, "position", order, scale, runs.begin) for records in (recorded, replayed))
    common, here, there = np.intersect1d(before[0], after[0], return_indices=True)
    apart = (after[1][there] - before[1][here]) * np.array([1.0, 1e3, 1e3])
    header = recording.header
    style.save(replay_figure(commanded, before, after, (common, apart), f"{header.reason}, {header.date}"), path)


def _course(
    records: list[RecordSample], what: str, order: list[int], scale: Floats, begin: float
) -> tuple[Floats, Floats]:
    """Return times (n,) [s] since `begin`, and the values of the axes in the records, in °, m, m (n, 3)."""
    times = np.array([time - begin for time, _ in records])
    counts = [[getattr(record.axes[place], what) for place in order] for _, record in records]
    return times, np.array(counts, dtype=float).reshape(len(records), 3) / scale
