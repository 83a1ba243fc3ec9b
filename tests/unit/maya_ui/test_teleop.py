from __future__ import annotations

from math import hypot

import pytest
from maya_ui.robot import Command, Ended, Happened, Joints, Path, Position, Presence, Standing
from maya_ui.seen import Seen
from maya_ui.teleop import KEYS, PATIENCE, REACHES, SHORTEST, Direction, Teleop

UP = Direction("z", 1)
DONE = Ended(Command.JOG, done=True)
OUTSIDE = Ended(Command.JOG, done=False, code="2101")
ELSEWHERE = Ended(Command.JOG, done=False, code="2107")
STOPPED = Ended(Command.JOG, done=False, code="2201")


class Hands:
    """A teleoperation, and what it asked for."""

    def __init__(self, *, homed: bool = True) -> None:
        self.seen = Seen()
        self.seen.take(Presence(master=True, controller=True))
        self.seen.take(Happened("idle", Standing("idle" if homed else "not_homed", homed=homed)))
        self.at(0.6, 0.8, 1.0)
        self.seen.take(Joints(0.5, 1.5, 1.6))
        self.paths: list[Path] = []
        self.ends = 0
        self.teleop = Teleop(self.seen, self.paths.append, self.end)

    def at(self, x: float, y: float, z: float) -> None:
        self.seen.take(Position(x, y, z))

    def end(self) -> None:
        self.ends += 1

    def ended(self, end: Ended) -> None:
        """Have a path end, and the robot say where it is."""
        self.teleop.ended(end)
        self.teleop.positioned()

    @property
    def lengths(self) -> list[float]:
        return [path.points[1][2] - path.points[0][2] for path in self.paths]


def test_held_direction_requests_one_path_of_the_reach_from_the_position() -> None:
    hands = Hands()
    hands.teleop.press(UP)
    assert hands.paths == [Path(("x", "y", "z"), ((0.6, 0.8, 1.0), (0.6, 0.8, 1.05)))]
    hands.teleop.press(Direction("x", 1))
    hands.teleop.positioned()
    assert len(hands.paths) == 1


def test_while_it_is_held_path_follows_path_and_none_after() -> None:
    hands = Hands()
    hands.teleop.press(UP)
    hands.at(0.6, 0.8, 1.05)
    hands.ended(DONE)
    assert hands.paths[1].points[0] == (0.6, 0.8, 1.05)
    hands.teleop.release()
    assert hands.ends == 1
    hands.ended(STOPPED)
    assert len(hands.paths) == 2
    assert not hands.teleop.under_way


def test_the_next_path_waits_for_a_position_that_came_after_the_end() -> None:
    hands = Hands()
    hands.teleop.press(UP)
    hands.teleop.ended(DONE)
    assert len(hands.paths) == 1
    hands.teleop.positioned()
    assert len(hands.paths) == 2


def test_at_the_edge_the_path_is_halved_and_then_given_up() -> None:
    hands = Hands()
    hands.teleop.press(UP)
    hands.ended(OUTSIDE)
    hands.ended(DONE)
    hands.ended(OUTSIDE)
    assert hands.lengths == pytest.approx([0.05, 0.025, 0.0125, 0.00625])
    for _ in range(20):
        hands.ended(OUTSIDE)
    assert min(hands.lengths) >= SHORTEST - 1e-12
    assert hands.teleop.held == UP
    assert not hands.teleop.under_way


def test_path_begun_elsewhere_is_retried_a_limited_number_of_times() -> None:
    hands = Hands()
    hands.teleop.press(UP)
    for _ in range(10):
        if hands.teleop.under_way:
            hands.ended(ELSEWHERE)
    assert len(hands.paths) == 1 + PATIENCE


@pytest.mark.parametrize("code", ["2104", "2105", "2201", "2202", "1011", "", "lost"])
def test_refused_or_stopped_jog_is_not_retried_before_release(code: str) -> None:
    hands = Hands()
    hands.teleop.press(UP)
    hands.ended(Ended(Command.JOG, done=False, code=code))
    hands.teleop.press(UP)
    hands.teleop.positioned()
    assert len(hands.paths) == 1
    hands.teleop.release()
    assert hands.ends == 0
    hands.teleop.press(UP)
    assert len(hands.paths) == 2


def test_another_direction_waits_until_the_robot_is_at_rest() -> None:
    hands = Hands()
    hands.teleop.press(UP)
    hands.teleop.release()
    hands.teleop.press(Direction("z", -1))
    hands.teleop.positioned()
    assert len(hands.paths) == 1
    hands.ended(STOPPED)
    assert hands.lengths == pytest.approx([0.05, -0.05])


def test_nothing_is_sent_at_an_unknown_position() -> None:
    hands = Hands(homed=False)
    for direction in KEYS.values():
        hands.teleop.press(direction)
        hands.teleop.release()
    assert hands.paths == []
    assert hands.ends == 0


def test_outward_is_along_the_boom_and_turning_moves_joint_a_alone() -> None:
    hands = Hands()
    hands.teleop.press(Direction("r", 1))
    (x, y, z), (there_x, there_y, there_z) = hands.paths[0].points
    assert hypot(there_x, there_y) - hypot(x, y) == pytest.approx(0.05)
    assert there_x / there_y == pytest.approx(x / y)
    assert there_z == z
    hands.teleop.release()
    hands.ended(STOPPED)
    hands.teleop.press(Direction("a", -1))
    assert hands.paths[1].names == ("a", "b", "c")
    assert hands.paths[1].points == ((0.5, 1.5, 1.6), (pytest.approx(0.5 - REACHES[2].angle), 1.5, 1.6))


def test_every_direction_has_a_key_and_no_two_are_the_same() -> None:
    assert len(set(KEYS.values())) == len(KEYS) == 10
