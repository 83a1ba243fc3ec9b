"""Where a replay begins, and what the controller was then."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import inf

from dmc41x3.i18n import marked
from dmc41x3.language.hardware import LETTERS
from dmc41x3.language.record import DataRecord, decode
from dmc41x3.wire.framing import RecordReply, Reply
from dmc41x3.wire.transcript import WirePiece
from maya_un.config import Config, Units
from maya_un.events import HomingBegun
from maya_un.recorder.exchanges import RecordedExchange, talk
from maya_un.recorder.recording import Recording

_AXES, _AXIS, _STOP_CODE = 82, 36, 3
"""Where the axes begin in a data record, how long each is, and where in it its stop code stands (QR)."""


@dataclass(frozen=True, slots=True)
class ReplayScene:
    """From where a recording is played: `pieces` from loop time `begin` [s] on, on a twin made for that instant.

    `opening` is what was said to configure the controller, long before; `record` is what the controller was at `begin`,
    None for a twin that is played from its power-up. `lacks` has texts about differences that cannot be avoided.
    """

    begin: float
    pieces: tuple[WirePiece, ...]
    opening: tuple[WirePiece, ...] = ()
    record: DataRecord | None = None
    homed: bool = False
    lacks: tuple[str, ...] = ()


def scene_of(recording: Recording) -> ReplayScene:
    """Return where to begin: at the power-up of a twin that was recorded whole, else where the axes were at rest.

    Raises `ValueError` where they never were.
    """
    header, wire = recording.header, tuple(piece for piece in recording.wire if piece.link >= 0)
    lacks = [marked("Not compared: unsolicited data records, by UDP.")] if len(wire) < len(recording.wire) else []
    source = header.origin.twin
    if source is not None and header.complete:
        return ReplayScene(source.born, wire, lacks=tuple(lacks))
    if source is None:
        lacks.append(
            marked(
                "Different from the machine: friction, lag, stiffness, and registers that Maya does not set. "
                "They are the twin's."
            )
        )
    opening = tuple(piece for piece in wire if piece.time < header.whole)
    rest = wire[len(opening) :]
    resting = _at_rest(talk(rest).exchanges)
    if resting is None or resting.answered is None or not isinstance(resting.reply, RecordReply):
        raise ValueError("it holds no instant at which the axes were at rest")
    homed = _homed(recording, resting.answered)
    if not homed:
        lacks.append(marked("Different: the position of the machine before homing, which its counts do not tell."))
    record = decode(resting.reply.data)
    if header.complete:
        return ReplayScene(rest[0].time, rest, (), record, homed, tuple(lacks))
    begin = resting.answered
    later = tuple(piece for piece in rest if piece.time > begin)
    if not opening:
        lacks.append(
            marked(
                "Different: registers, program and variables from before the recording, which does not contain them."
            )
        )
    return ReplayScene(begin, later, opening, record, homed, tuple(lacks))


def _at_rest(exchanges: Sequence[RecordedExchange]) -> RecordedExchange | None:
    for exchange in exchanges:
        if isinstance(exchange.reply, RecordReply) and exchange.answered is not None:
            record = decode(exchange.reply.data)
            if not any(axis.moving for axis in record.axes):
                return exchange
    return None


def _homed(recording: Recording, time: float) -> bool:
    """Tell whether counts meant lengths: the robot was homed, or it was later, and no homing came between."""
    if next((state.homed for state in reversed(recording.states) if state.time <= time), False):
        return True
    later = next((state.time for state in recording.states if state.time > time and state.homed), -inf)
    begun = (event.time for event in recording.events if isinstance(event, HomingBegun))
    return later > time and not any(time <= began <= later for began in begun)


def commands_before(scene: ReplayScene, config: Config) -> bytes:
    """Return what makes a fresh twin what the recorded controller was when the scene begins.

    What configured the controller comes before the state of the scene. Where that is not known, the answers that the
    controller gave in the scene are the best that is.
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
    """Yield the commands that make what was asked of a controller, before it was told so, answer as it did.

    That is its program (UL), and variables.
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
    """Put the code of a twin that was just switched on (1) in the place of why axes stopped before the scene."""
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
