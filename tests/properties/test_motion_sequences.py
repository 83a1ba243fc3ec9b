"""Random commands of sequences, contours and PVT, at random times: the axes keep their rules after all of them."""

from __future__ import annotations

from collections.abc import Callable
from random import Random

import pytest

from tests.campaign import Campaign
from tests.unit.dmc41x3.twin.bench import Bench

AXES = "ABCD"
FASTEST = 400_000.0
"""No axis gets faster than this by these commands [counts/s]."""


def _pair(rng: Random) -> str:
    return "".join(rng.sample(AXES, 2))


def _command(rng: Random) -> str:
    """Return one command, sensible or not; more segments and records than anything else."""
    return rng.choice(_SEGMENTS if rng.random() < 0.5 else _OTHERS)(rng)


_SEGMENTS: tuple[Callable[[Random], str], ...] = (
    lambda rng: f"VP {rng.randint(-9999, 9999)},{rng.randint(-9999, 9999)}",
    lambda rng: f"VP {rng.randint(-9999, 9999)},0<{rng.randint(2, 50_000)}>{rng.randint(0, 50_000)}",
    lambda rng: f"CR {rng.randint(10, 20_000)},{rng.randint(-360, 360)},{rng.randint(-720, 720)}",
    lambda rng: f"LI {rng.randint(-999, 999)},{rng.randint(-999, 999)}",
    lambda rng: f"LI {rng.choice(AXES)}={rng.randint(-999, 999)}",
    lambda rng: f"CD {rng.randint(-99, 99)},{rng.randint(-99, 99)}" + rng.choice(("", "=1", "=4", "=7")),
    lambda rng: f"CD {rng.randint(-99, 99)}",
    lambda rng: f"PV{rng.choice(AXES)}={rng.randint(-999, 999)},{rng.randint(-20_000, 20_000)},{rng.randint(64, 400)}",
)

_OTHERS: tuple[Callable[[Random], str], ...] = (
    lambda rng: f"VM {_pair(rng)}",
    lambda rng: f"VM {rng.choice(AXES)}N",
    lambda rng: f"LM {_pair(rng)}",
    lambda rng: "LM ABCD",
    lambda rng: f"CM {_pair(rng)}",
    lambda rng: "CM AB",
    lambda rng: "CD 0=0",
    lambda rng: f"DT {rng.randint(-1, 6)}",
    lambda rng: f"PV{rng.choice(AXES)}=0,0,{rng.choice((0, 0, -1))}",
    lambda rng: f"BT {_pair(rng)}",
    lambda rng: f"BT {rng.choice(AXES)}",
    lambda rng: rng.choice(("VE", "LE", "CS", "CA S", "CA T")),
    lambda rng: rng.choice(("BGS", "BGT", "BGST", "BGA", "BGB")),
    lambda rng: "BGS",
    lambda rng: "BGT",
    lambda rng: rng.choice(("STS", "STT", "STA", "STB", "ST", "AB1", "MOA", "MOB")),
    lambda rng: f"VS {rng.randint(2, 60_000)}",
    lambda rng: f"VA {rng.randint(1024, 900_000)}",
    lambda rng: f"VD {rng.randint(1024, 900_000)}",
    lambda rng: f"VR {rng.choice((0, 0.5, 1, 2))}",
    lambda rng: f"{rng.choice(('PR', 'JG'))}{rng.choice(AXES)}={rng.randint(-30_000, 30_000)}",
    lambda rng: f"FL{rng.choice(AXES)}={rng.randint(-5000, 40_000)}",
    lambda rng: f"BL{rng.choice(AXES)}={rng.randint(-40_000, 5000)}",
    lambda rng: rng.choice(("SH", "MG _CM,_PVA,_BTA,_CSS,_AVS,_VMS,_LMT,_VPA,_TNS", "TS", "SC")),
)


def _check(bench: Bench) -> None:
    """An axis is on a course exactly while that runs and has it as a member; at rest it stands on a whole count."""
    core = bench.machine.unit.core
    for axis in core.axes:
        if axis.plane:
            course = core.courses[axis.plane]
            assert course.running
            assert axis.index in course.members
            assert axis.motion is None
        if not axis.moving:
            position, velocity = axis.timeline.at(bench.now)
            assert (position % 1.0, velocity) == (0.0, 0.0)
    for name, course in core.courses.items():
        if course.running:
            assert bench.now <= course.end
            names = {core.axes[i].plane for i in course.members if i < len(core.axes)}
            assert name in names or not names


def _advance(bench: Bench, rng: Random) -> None:
    """Let time pass in steps of about a millisecond, in which no axis goes farther than its speed takes it."""
    span = rng.choice((0.0, 0.002, 0.02, 0.3))
    before = [axis.timeline.at(bench.now)[0] for axis in bench.machine.unit.core.axes]
    end = bench.now + span * rng.random()
    while bench.now < end:
        step = min(0.001 + 0.0005 * rng.random(), end - bench.now)
        bench.at(bench.now + step)
        after = [axis.timeline.at(bench.now)[0] for axis in bench.machine.unit.core.axes]
        for old, new in zip(before, after, strict=True):
            assert abs(new - old) <= FASTEST * step + 1.0
        before = after


@pytest.mark.parametrize("batch", range(4))
def test_axes_and_sequences_agree_after_any_commands(campaign: Campaign, batch: int) -> None:
    for case in range(campaign.size(ci=15, long=600)):
        rng = campaign.rng(1000 * batch + case)
        bench = Bench(axes=4)
        for _ in range(120):
            bench.say(_command(rng))
            _check(bench)
            if rng.random() < 0.05:
                bench.switch(rng.randrange(4), forward=rng.random() < 0.5, reverse=rng.random() < 0.8)
                _check(bench)
            _advance(bench, rng)
            _check(bench)
        bench.do("VR 1,1", "ST")
        bench.at(bench.now + 1000.0)
        _check(bench)
        assert not any(axis.moving for axis in bench.machine.unit.core.axes)
