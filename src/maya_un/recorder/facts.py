"""Facts in data records: motions with their times, and changes of switches, motors and outputs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

from dmc41x3.language.hardware import LETTERS
from dmc41x3.language.record import DataRecord, decode
from dmc41x3.wire.framing import RecordReply
from maya_un.errors import UnexpectedReply
from maya_un.recorder.exchanges import RecordedExchange


class RecordSample(NamedTuple):
    """A data record and when it was asked for [s]."""

    time: float
    record: DataRecord


class RecordedMotion(NamedTuple):
    """A stretch in which axes moved, as far as records tell: first record in motion, first one at rest again [s].

    `end` is where the reference of every axis was then [counts]; both are None where it went on.
    """

    began: float
    ended: float | None
    end: tuple[int, ...] | None


class Fact(NamedTuple):
    """Something that became so at a time [s]."""

    time: float
    what: str


def samples(exchanges: Iterable[RecordedExchange]) -> list[RecordSample]:
    """Return the data records among the answers, in order."""
    found: list[RecordSample] = []
    for exchange in exchanges:
        if isinstance(exchange.reply, RecordReply):
            try:
                found.append(RecordSample(exchange.time, decode(exchange.reply.data)))
            except UnexpectedReply:
                continue
    return found


def motions(records: Sequence[RecordSample]) -> list[RecordedMotion]:
    """Return the motions; one that was under way at the first record begins there."""
    found: list[RecordedMotion] = []
    began: float | None = None
    for time, record in records:
        moving = any(axis.moving for axis in record.axes)
        if moving and began is None:
            began = time
        elif not moving and began is not None:
            found.append(RecordedMotion(began, time, tuple(axis.reference for axis in record.axes)))
            began = None
    if began is not None:
        found.append(RecordedMotion(began, None, None))
    return found


def facts(records: Sequence[RecordSample]) -> list[Fact]:
    """Return what changed from record to record, in words that two runs can be compared by."""
    return [Fact(after.time, what) for before, after in pairwise(records) for what in _changes(before, after)]


def _changes(before: RecordSample, after: RecordSample) -> Iterator[str]:
    for letter, one, other in zip(LETTERS, before.record.axes, after.record.axes, strict=False):
        for name in ("forward_limit_active", "reverse_limit_active", "motor_off"):
            is_now = getattr(other, name)
            if getattr(one, name) != is_now:
                yield f"{_WORDS[name][is_now]} {letter}"
    was, now = before.record.amplifier_status, after.record.amplifier_status
    if was != now:
        yield f"amplifier status {now:#010x}"
    changed = before.record.outputs[0] ^ after.record.outputs[0]
    for bit in range(8):
        if changed >> bit & 1:
            yield f"output {bit + 1} {'on' if after.record.outputs[0] >> bit & 1 else 'off'}"


_WORDS = {
    "forward_limit_active": ("left the forward limit of", "met the forward limit of"),
    "reverse_limit_active": ("left the reverse limit of", "met the reverse limit of"),
    "motor_off": ("motor on:", "motor off:"),
}
