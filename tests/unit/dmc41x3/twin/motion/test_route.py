from __future__ import annotations

import pytest

from dmc41x3.twin.motion.path import TANGENT, Arc, PathSegment, PathSpan, X, Y
from dmc41x3.twin.motion.plane import Route, RouteAxis


def line(x: float, y: float) -> PathSegment:
    return PathSegment.of((x, y))


def route(*segments: PathSegment) -> Route:
    made = Route(2)
    for segment in segments:
        made.append(segment, turning=True)
    return made


def test_every_segment_begins_at_the_end_of_the_last() -> None:
    made = route(line(300, 400), PathSegment.along(Arc.of(100, 0, 90)), line(0, -100))
    assert [start.place for start in made.starts] == [
        (0.0, 0.0),
        (300.0, 400.0),
        (pytest.approx(200.0), pytest.approx(500.0)),
    ]
    assert [start.way for start in made.starts] == pytest.approx([0.0, 500.0, 500.0 + 157.07963])
    assert made.tip == pytest.approx((200.0, 400.0))
    assert made.length == pytest.approx(757.07963)


def test_dropped_segments_keep_their_numbers() -> None:
    made = route(line(1, 0), line(2, 0), line(3, 0))
    assert made.drop(2) == 2
    assert made.first == 2
    assert made.coordinate(X, 2, 1.5) == 4.5
    assert made.end(X) == 6.0


@pytest.mark.parametrize(
    ("segments", "headings"),
    [
        ([line(0, 5), line(5, 0)], [90.0, 0.0]),
        ([line(-5, 1), line(-5, -1)], [168.690068, 191.309932]),
        ([line(5, 0), line(-5, 0)], [0.0, 180.0]),
        ([PathSegment.along(Arc.of(10, 0, 270)), line(0, 5)], [90.0, 450.0]),
        ([PathSegment.along(Arc.of(10, 0, -90)), PathSegment.along(Arc.of(10, -90, -90))], [-90.0, -180.0]),
        ([PathSegment.along(Arc.of(10, 0, 720)), line(0, 5)], [90.0, 810.0]),
    ],
)
def test_directions_are_continuous_between_segments(segments: list[PathSegment], headings: list[float]) -> None:
    assert [start.heading for start in route(*segments).starts] == pytest.approx(headings)


def test_the_tangent_is_linear_along_an_arc() -> None:
    made = route(PathSegment.along(Arc.of(1000, 0, 90)))
    assert made.coordinate(TANGENT, 0, made.length / 3) == pytest.approx(120.0)
    assert made.end(TANGENT) == pytest.approx(180.0)


def test_a_member_scales_and_shifts_its_coordinate() -> None:
    made = route(line(30, 40))
    pieces, peak = RouteAxis(Y, 2.0, 1000).pieces(made, [(PathSpan(5.0, 0, 10.0, 100.0, 50.0), 6.0)])
    assert [tuple(piece) for piece in pieces] == [(5.0, 1016.0, 160.0, 80.0)]
    assert peak == 160.0


def test_a_member_without_a_part_in_a_segment_rests() -> None:
    made = route(line(30, 0), line(20, 0), line(0, 10))
    stretches = [(PathSpan(float(n), n, 0.0, 10.0, 0.0), n + 1.0) for n in range(3)]
    pieces, _ = RouteAxis(Y, 1.0, 0).pieces(made, stretches)
    assert [(piece.t, piece.v) for piece in pieces] == [(0.0, 0.0), (2.0, 10.0)]
