"""Comparison of two runs of the same commands: replies, messages, data records, durations and ends of motions."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise, zip_longest
from math import inf
from typing import NamedTuple

from dmc41x3.language.hardware import LETTERS
from dmc41x3.language.record import DataRecord, decode
from dmc41x3.wire.framing import RecordReply
from dmc41x3.wire.transcript import difference, shown
from maya_un.errors import UnexpectedReply
from maya_un.recorder.exchanges import RecordedExchange, RecordedTalk


class RecordSample(NamedTuple):
    """A data record and the time of its request [s]."""

    time: float
    record: DataRecord


class RecordedMotion(NamedTuple):
    """A stretch in which axes moved, according to records: first record in motion, first one at rest again [s].

    `end` is the reference of every axis at its end [counts]; both are None if the motion had not ended.
    """

    began: float
    ended: float | None
    end: tuple[int, ...] | None


class Fact(NamedTuple):
    """A change that happened at a time [s]."""

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
    """Return the motions; a motion that was under way at the first record begins there."""
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
    """Return the changes from record to record, in words by which two runs can be compared."""
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


_CLOCK = 0.005
"""The twin sends unsolicited data at its own pace; a time shift up to this is never a difference [s]."""


class Tolerances(NamedTuple):
    """Allowed differences of two runs: positions at rest by `counts`, times by `seconds`."""

    counts: float
    seconds: float


class ReplayDifference(NamedTuple):
    """A difference in the replay: its time [s], connection (0: none), subject, and description.

    `times` is the number of consecutive data records that show it.
    """

    time: float
    link: int
    what: str
    how: str
    times: int = 1


class MotionTiming(NamedTuple):
    """A motion in both runs: its start [s] and its durations [s], None if it did not end or did not happen."""

    began: float
    recorded: float | None
    replayed: float | None


class FinalPosition(NamedTuple):
    """Position of an axis at the end of both runs [counts]."""

    axis: str
    recorded: int
    replayed: int


@dataclass(frozen=True, slots=True)
class Comparison:
    """The result of a comparison: the number of `commands`, of which the answers of `compared` were compared."""

    commands: int
    compared: int
    differences: tuple[ReplayDifference, ...]
    motions: tuple[MotionTiming, ...]
    ends: tuple[FinalPosition, ...]


def compare(recorded: RecordedTalk, replayed: RecordedTalk, tolerances: Tolerances) -> Comparison:
    """Compare a run with its replay, which uses the times of the recording."""
    pairs = list(_paired(recorded.exchanges, replayed.exchanges))
    before, after = samples(recorded.exchanges), samples(replayed.exchanges)
    gap = _gap(before)
    timed = _timed(motions(before), motions(after))
    last = _last(before, after)
    ends = [] if last is None else _ends(*last)
    slack = tolerances.seconds + _CLOCK
    found = [
        *_unpaired(recorded),
        *_texts(pairs, tolerances),
        *_records(pairs, tolerances, gap),
        *_happened("message", [Fact(*message) for message in recorded.messages], _facts_of(replayed), slack),
        *_happened("", facts(before), facts(after), slack + gap),
        *_slower(timed, slack + gap),
        *([] if last is None else _elsewhere(ends, last[0], tolerances)),
    ]
    compared = sum(1 for one, _ in pairs if one.reply is not None)
    return Comparison(len(recorded.exchanges), compared, tuple(sorted(found)), tuple(timed), tuple(ends))


Pair = tuple[RecordedExchange, RecordedExchange | None]


def _facts_of(talk: RecordedTalk) -> list[Fact]:
    return [Fact(*message) for message in talk.messages]


def _paired(recorded: Iterable[RecordedExchange], replayed: Iterable[RecordedExchange]) -> Iterator[Pair]:
    """Yield every recorded exchange with that of the replay: the same command at the same time."""
    again: defaultdict[tuple[int, float, str], deque[RecordedExchange]] = defaultdict(deque)
    for exchange in replayed:
        again[exchange.link, exchange.time, exchange.command].append(exchange)
    for exchange in recorded:
        same = again[exchange.link, exchange.time, exchange.command]
        yield exchange, same.popleft() if same else None


def _unpaired(recorded: RecordedTalk) -> Iterator[ReplayDifference]:
    for time, link, data in recorded.unpaired:
        how = f"{data[:40]!r} answers nothing: a command is missing before it, or it was put in"
        yield ReplayDifference(time, link, "bytes of the controller", how)


def _texts(pairs: Sequence[Pair], tolerances: Tolerances) -> Iterator[ReplayDifference]:
    last = {one.link: number for number, (one, _) in enumerate(pairs) if one.reply is not None}
    for number, (one, other) in enumerate(pairs):
        if isinstance(one.reply, RecordReply):
            continue
        if one.reply is None:
            if number < last.get(one.link, -1):
                said = shown(None if other is None else other.reply)
                yield ReplayDifference(
                    one.time, one.link, one.command, f"no answer was recorded, the replay has {said}"
                )
            continue
        how = difference(one.command, one.reply, None if other is None else other.reply, tolerances.counts)
        if how:
            yield ReplayDifference(one.time, one.link, one.command, how)


def _records(pairs: Sequence[Pair], tolerances: Tolerances, gap: float) -> Iterator[ReplayDifference]:
    """Yield stretches of data records that differ.

    A change that comes one record earlier or later is no difference, nor is a difference in other values than positions
    that lasts no longer than the tolerance of times.
    """
    asked = [(one, other) for one, other in pairs if isinstance(one.reply, RecordReply)]
    hows = [_how(asked, number, tolerances, gap) for number in range(len(asked))]
    for differs, stretch in groupby(range(len(asked)), lambda number: bool(hows[number])):
        places = list(stretch)
        first, last = places[0], places[-1]
        around = asked[max(0, first - 1)][0].time, asked[min(len(asked) - 1, last + 1)][0].time
        within = first > 0 and last + 1 < len(asked) and around[1] - around[0] <= tolerances.seconds + gap
        if differs and not (within and any(_more_than_places(*asked[place]) for place in places)):
            one = asked[first][0]
            yield ReplayDifference(one.time, one.link, "data record", hows[first], len(places))


def _how(asked: Sequence[Pair], number: int, tolerances: Tolerances, gap: float) -> str:
    one, other = asked[number]
    how = difference("QR", one.reply, None if other is None else other.reply, *tolerances)
    if how and other is not None and _shifted(one, other, asked, number, tolerances, gap):
        return ""
    return how


def _more_than_places(one: RecordedExchange, other: RecordedExchange | None) -> bool:
    return other is not None and bool(difference("QR", one.reply, other.reply, inf))


def _shifted(
    one: RecordedExchange,
    other: RecordedExchange,
    asked: Sequence[Pair],
    number: int,
    tolerances: Tolerances,
    gap: float,
) -> bool:
    """Return whether a record differs in more than positions, and equals one of the replay at about that time."""
    if not _more_than_places(one, other):
        return False
    counts, seconds = tolerances
    near = (other for _, other in _around(asked, number, seconds + gap) if other is not None)
    return any(not difference("QR", one.reply, other.reply, counts, seconds + gap) for other in near)


def _around(asked: Sequence[Pair], number: int, seconds: float) -> Iterator[Pair]:
    """Yield the neighbours of a record, at least one on either side, and all within `seconds` [s]."""
    time = asked[number][0].time
    for step in (-1, 1):
        place = number + step
        while 0 <= place < len(asked) and (place == number + step or abs(asked[place][0].time - time) <= seconds):
            yield asked[place]
            place += step


def _happened(
    kind: str, recorded: Sequence[Fact], replayed: Sequence[Fact], seconds: float
) -> Iterator[ReplayDifference]:
    """Yield facts that happened in one run only, or at different times."""
    left = list(replayed)
    for fact in recorded:
        same = [other for other in left if other.what == fact.what]
        match = min(same, key=lambda other: abs(other.time - fact.time), default=None)
        what = f"{kind} {fact.what}".strip()
        if match is None:
            yield ReplayDifference(fact.time, 0, what, "it does not happen in the replay")
        else:
            left.remove(match)
            late = match.time - fact.time
            if abs(late) > seconds:
                yield ReplayDifference(
                    fact.time, 0, what, f"in the replay {abs(late):.3f} s {'later' if late > 0 else 'earlier'}"
                )
    for fact in left:
        yield ReplayDifference(fact.time, 0, f"{kind} {fact.what}".strip(), "it happens in the replay only")


def _timed(recorded: Sequence[RecordedMotion], replayed: Sequence[RecordedMotion]) -> list[MotionTiming]:
    found: list[MotionTiming] = []
    for one, other in zip_longest(recorded, replayed):
        began = one.began if one is not None else other.began if other is not None else 0.0
        found.append(MotionTiming(began, _duration(one), _duration(other)))
    return found


def _duration(motion: RecordedMotion | None) -> float | None:
    return None if motion is None or motion.ended is None else motion.ended - motion.began


def _slower(timed: Iterable[MotionTiming], seconds: float) -> Iterator[ReplayDifference]:
    for began, one, other in timed:
        if one is None and other is None:
            continue
        if one is None or other is None:
            words = [("no end" if took is None else f"{took:.3f} s") for took in (one, other)]
            yield ReplayDifference(began, 0, "motion", f"it took {words[0]}, in the replay {words[1]}")
        elif abs(one - other) > seconds:
            yield ReplayDifference(began, 0, "motion", f"it took {one:.3f} s, in the replay {other:.3f} s")


def _last(
    recorded: Sequence[RecordSample], replayed: Sequence[RecordSample]
) -> tuple[RecordSample, RecordSample] | None:
    """Return the last record that both runs have, None without one."""
    again = {sample.time: sample for sample in replayed}
    return next(((one, again[one.time]) for one in reversed(recorded) if one.time in again), None)


def _ends(recorded: RecordSample, replayed: RecordSample) -> list[FinalPosition]:
    axes = zip(LETTERS, recorded.record.axes, replayed.record.axes, strict=False)
    return [FinalPosition(letter, one.position, other.position) for letter, one, other in axes]


def _elsewhere(
    ends: Iterable[FinalPosition], recorded: RecordSample, tolerances: Tolerances
) -> Iterator[ReplayDifference]:
    for (letter, one, other), axis in zip(ends, recorded.record.axes, strict=True):
        if abs(one - other) > tolerances.counts + tolerances.seconds * abs(axis.velocity):
            how = f"at {one} counts, in the replay at {other}, {other - one:+d}"
            yield ReplayDifference(recorded.time, 0, f"end of axis {letter}", how)


def _gap(records: Sequence[RecordSample]) -> float:
    """Return the usual time between two records [s], which limits the accuracy of facts read from them."""
    gaps = sorted(after.time - before.time for before, after in pairwise(records))
    return gaps[len(gaps) // 2] if gaps else 0.0
