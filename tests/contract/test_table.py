"""The conformance table, held against the virtual controller in every way that bytes can arrive."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from dmc41x3.conformance import Demand, Vector, VectorDifference, load, run
from dmc41x3.conformance.runner import coalesced, freshen, restart
from dmc41x3.conformance.vectors import sources
from tests.campaign import Campaign
from tests.channels import Bench, Cut, at, byte_by_byte, whole, wire

AXES = (3, 1, 2, 4, 8)
"""Sizes of controllers, the robot's first."""

TABLE = load()
every_group = pytest.mark.parametrize("group", sorted({vector.group for vector in TABLE}))


def sizes(vector: Vector) -> list[int]:
    return [axes for axes in AXES if vector.fits(axes)]


def places(vector: Vector) -> range:
    """Return where the longest thing it sends can be cut; nowhere where one step is repeated to fill a buffer."""
    if vector.whole or sum(step.times for step in vector.steps) > 100:
        return range(0)
    return range(1, max(len(step.send) for step in vector.steps))


@every_group
def test_in_process_on_every_size(group: str) -> None:
    found = [
        f"{axes} axes: {difference}"
        for vector in TABLE
        if vector.group == group
        for axes in sizes(vector)
        if (difference := run(vector, Bench(axes).dial, axes)) is not None
    ]
    assert not found


USED = (
    "SP*=4000;AC*=102400;DC*=50176;SD*=102400;KP*=9;KI*=1;IT*=0.5;OE*=1;ER*=100",
    "TL*=3;TK*=5;LD*=3;FL*=100000;BL*=-1000;CN 1,1,1,0,1;PF 8.2;VF 6.2;LZ 0;EO 0",
    "var=5;qa=1;DM qb[100],qd[3];OP 255;VS 1000,500;VA 2048,4096;VD 4096,2048;CAT",
    "TW*=100;HV*=512;ZA*=4;DV*=1;FA*=5;NB*=10;NF*=9;PL*=.5;IL*=4;OA*=1;OT*=50",
    "VR 2,2;VV 10;TN 5,5;ES 2,1;DP*=77;DE*=8;II 1,2,,0;TR 1;CW 1;AL A;MO;MT*=2",
    "MT*=1;SH;JG*=2000;BG;BN;BV",
)
"""States that the table does not expect: settings, variables, an armed latch, motion, burned parameters."""


@pytest.mark.parametrize("axes", [3, 8])
def test_table_holds_in_a_row_on_a_controller_that_was_used(axes: int) -> None:
    """The way of `maya dmc conform --bench`: all vectors on one controller, brought back to its factory settings."""
    bench = Bench(axes)
    used = bench.dial()
    for line in USED:
        used.send(f"{line}\r".encode("ascii"))
    assert b"?" not in used.receive()
    used.close()
    found: list[str] = []
    group = ""
    for vector in TABLE:
        if vector.fits(axes):
            (freshen if vector.group == group else restart)(bench.dial, axes)
            group = vector.group
            found += [str(difference) for difference in [run(vector, bench.dial, axes)] if difference is not None]
    assert not found


def differences(group: str, talk: Callable[[Vector, int], VectorDifference | None]) -> list[str]:
    """Return how the vectors of a group differ, each on the first controller of `AXES` it fits."""
    return [str(found) for vector in TABLE if vector.group == group and (found := talk(vector, sizes(vector)[0]))]


def over_tcp(vector: Vector, axes: int, cut: Cut = whole) -> VectorDifference | None:
    with wire(axes, cut) as controller:
        return run(vector, controller.tcp, axes)


@every_group
def test_in_as_few_pieces_as_possible(group: str) -> None:
    assert not differences(group, lambda vector, axes: run(coalesced(vector), Bench(axes).dial, axes))


@every_group
def test_byte_by_byte(group: str) -> None:
    def talk(vector: Vector, axes: int) -> VectorDifference | None:
        return run(vector, Bench(axes, whole if vector.whole else byte_by_byte).dial, axes)

    assert not differences(group, talk)


@every_group
def test_cut_in_two_at_every_place(group: str) -> None:
    def talk(vector: Vector, axes: int) -> VectorDifference | None:
        found = (run(vector, Bench(axes, at(place)).dial, axes) for place in places(vector))
        return next((difference for difference in found if difference), None)

    assert not differences(group, talk)


@every_group
def test_over_tcp(group: str) -> None:
    assert not differences(group, over_tcp)


@every_group
def test_over_tcp_byte_by_byte(group: str) -> None:
    assert not differences(group, lambda vector, axes: over_tcp(vector, axes, whole if vector.whole else byte_by_byte))


@every_group
def test_over_tcp_in_as_few_pieces_as_possible(group: str) -> None:
    assert not differences(group, lambda vector, axes: over_tcp(coalesced(vector), axes))


@every_group
def test_over_udp(group: str) -> None:
    def talk(vector: Vector, axes: int) -> VectorDifference | None:
        if vector.udp:
            return None
        with wire(axes) as controller:
            return run(vector, controller.udp, axes)

    assert not differences(group, talk)


ETHERNET_ONLY = {
    "EPICS connects",
    "gclib connects",
    "PyGalil connects",
    "who am I",
    "the first to come is on handle A",
    "who am I as a number",
    "handles of whom and of nobody",
    "free handles",
    "all handles but one are free",
    "kind of the own handle",
    "echo is on by default",
    "status byte with echo on",
    "EO 1 brings no echo on Ethernet",
    "by default messages go nowhere near Ethernet",
    "an error ends every thread",
    "the own handle is in the record",
    "messages to whoever asks for them",
}
"""Vectors about the sender's handle, about EO 1, or about messages that go to the serial port by default."""


@every_group
def test_over_a_serial_port(group: str) -> None:
    def talk(vector: Vector, axes: int) -> VectorDifference | None:
        if vector.name in ETHERNET_ONLY or any(step.on for step in vector.steps):
            return None  # there is one port
        with wire(axes) as controller:
            return run(vector, controller.serial, axes)

    assert not differences(group, talk)


def test_vectors_over_tcp_cut_in_two_at_every_place(campaign: Campaign) -> None:
    cases = [(vector, place) for vector in TABLE for place in places(vector)]
    chosen = campaign.some(cases, ci=150)
    found = ((place, over_tcp(vector, sizes(vector)[0], at(place))) for vector, place in chosen)
    assert not [f"cut at {place}: {difference}" for place, difference in found if difference]


def test_table_is_large_and_names_its_sources() -> None:
    assert len(TABLE) >= 250
    assert len({vector.name for vector in TABLE}) == len(TABLE)
    known = set(sources())
    assert [vector.name for vector in TABLE if not vector.sources or not set(vector.sources) <= known] == []
    alone = [v.name for v in TABLE if v.certainty == "two" and len(v.sources) < 2]
    assert alone == [], "certain by two sources, but one is named"


def test_a_box_in_service_can_be_spared() -> None:
    harmless = [vector for vector in TABLE if not vector.demands]
    assert len(harmless) >= 150
    energetic = ("BG", "SH", "MO", "JGA=1;BG", "DP", "AB", "SB", "CB", "OP ", "DL\r", "BN", "BP", "RS", "XQ")
    for vector in harmless:
        sent = [part for step in vector.steps for part in step.send.replace("\r", ";").split(";")]
        refused = [step.expect == ("?",) for step in vector.steps if step.send.startswith(energetic)]
        assert all(refused), (vector.name, sent)


def test_moving_axis_reports_motion() -> None:
    for vector in TABLE:
        begins = any(part.startswith("BG") for step in vector.steps for part in step.send.replace("\r", ";").split(";"))
        assert not begins or Demand.MOVES in vector.demands, vector.name
