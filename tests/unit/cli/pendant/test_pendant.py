"""The pendant without a screen: keys, the nearest limit, steps, stops, teaching, the picture."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from math import radians
from typing import Any

import pytest

from maya_un import runtime
from maya_un.cli.client import ServiceClient
from maya_un.cli.main import main
from maya_un.cli.pendant.screen import drawn
from maya_un.cli.pendant.session import MOVES, STEPS, KeyStep, PendantSession, distances
from maya_un.cli.units import MILLIMETRES, SI, OutputUnits
from maya_un.config import Config
from maya_un.errors import Busy
from maya_un.kinematics.workspace import Workspace
from maya_un.runtime import Running
from maya_un.values import Joints, Point
from tests.ports import free_port
from tests.unit.cli.servers import http_service

WORKSPACE = Workspace.of(Config())
HERE = WORKSPACE.require(Point(0.5, 1.1, 0.6))


def state(joints: Joints | None = HERE, mode: str = "idle") -> dict[str, Any]:
    point = None if joints is None else list(WORKSPACE.mechanism.fk(joints))
    return {"mode": mode, "joints": None if joints is None else list(joints), "point": point, "fault": None}


@dataclass
class Robot:
    """Answers as the service does, and notes what it was asked to do."""

    asked: list[tuple[str, str, Any]] = field(default_factory=list)
    jogged: dict[str, Any] = field(default_factory=lambda: {"limit": "", "reason": ""})
    refusal: tuple[int, object] | None = None
    stands: dict[str, Any] = field(default_factory=state)
    hold: threading.Event | None = None

    def says(self, method: str, path: str, body: Any) -> tuple[int, object]:
        if method == "GET":
            return 200, {"state": self.stands}
        self.asked.append((method, path, body))
        if path == "/v1/stop":
            if self.hold is not None:
                self.hold.set()
            return 200, {"was_moving": True, "duration": 0.88}
        if self.refusal is not None:
            return self.refusal
        if self.hold is not None:
            self.hold.wait(10.0)
        return 200, {**(body or {}), **self.jogged, "name": "shelf", "point": [0.5, 1.1, 0.6], "joints": list(HERE)}


@contextmanager
def pendant(robot: Robot) -> Iterator[PendantSession]:
    with http_service(robot.says) as url:
        yield PendantSession(ServiceClient(url), WORKSPACE, "en")


def picture(session: PendantSession, units: OutputUnits = MILLIMETRES) -> str:
    return "".join(text for _, text in drawn(session, "en", units))


def real_time(work: Any) -> None:
    """Carry out a coroutine in real time, which is what threads and sockets live in."""
    asyncio.run(work)


def test_a_letter_goes_forth_and_its_capital_back() -> None:
    assert {key: MOVES[key] for key in ("x", "X", "r", "c", "C")} == {
        "x": ("x", 1), "X": ("x", -1), "r": ("r", 1), "c": ("c", 1), "C": ("c", -1)
    }  # fmt: skip
    assert (MOVES["up"], MOVES["pagedown"]) == (("y", 1), ("z", -1))
    assert [step.length for step in STEPS.values()] == [0.001, 0.01, 0.05]
    assert (KeyStep(0.01, 0.02).of("a"), KeyStep(0.01, 0.02).of("b")) == (0.02, 0.01)


@pytest.mark.parametrize(
    ("joints", "name", "text"),
    [
        (Joints(radians(0.2), 1.6, 1.6), "boom", "boom 0.20°"),
        (Joints(1.0, 1.6, 2.297), "line c", "line c 3.0 mm"),
        (Joints(1.0, 0.576, 1.6), "line b", "line b 1.0 mm"),
        (WORKSPACE.require(Point(0.8, 0.8, 2.05)), "tension", "× load"),
    ],
)
def test_nearest_limit_is_first(joints: Joints, name: str, text: str) -> None:
    first = distances(WORKSPACE, joints)[0]
    assert first.name.startswith(name)
    assert text in first.text(MILLIMETRES)


def test_distances_are_in_order_and_none_is_left_out() -> None:
    found = distances(WORKSPACE, HERE)
    assert len(found) == 9
    assert [distance.rank for distance in found] == sorted(distance.rank for distance in found)


def test_a_key_is_one_step_of_the_size_that_was_chosen() -> None:
    async def press(session: PendantSession) -> None:
        session.move("x", -1)
        await session.settled()
        session.step = "3"
        session.move("a", 1)
        await session.settled()

    robot = Robot()
    with pendant(robot) as session:
        real_time(press(session))
    assert robot.asked == [
        ("POST", "/v1/jog", {"axis": "x", "distance": -0.01}),
        ("POST", "/v1/jog", {"axis": "a", "distance": radians(5.0)}),
    ]


def test_a_step_waits_for_the_one_before_and_is_stopped_at_the_end() -> None:
    robot = Robot(hold=threading.Event())

    async def press(session: PendantSession) -> None:
        session.move("x", 1)
        session.move("y", 1)
        assert session.stepping
        await session.close()
        assert not session.stepping

    with pendant(robot) as session:
        real_time(press(session))
        assert sorted(path for _, path, _ in robot.asked) == ["/v1/jog", "/v1/stop"]
        assert session.notes[-1] == "Stopping: at rest within 0.88 s."


def test_end_of_a_step_is_noted() -> None:
    async def press(session: PendantSession, robot: Robot) -> None:
        session.move("b", 1)
        await session.settled()
        robot.refusal = (409, {"code": Busy.code, "details": {"doing": "job 3"}})
        session.move("b", 1)
        await session.settled()

    robot = Robot(jogged={"limit": "line_b", "reason": "line b would be 3 mm too long"})
    with pendant(robot) as session:
        real_time(press(session, robot))
        assert list(session.notes) == ["line b would be 3 mm too long", str(Busy(doing="job 3"))]


def test_a_pose_is_taught() -> None:
    async def teach(session: PendantSession) -> None:
        session.teach("shelf", replacing=True)
        await session.close()

    robot = Robot()
    with pendant(robot) as session:
        real_time(teach(session))
        assert robot.asked == [("PUT", "/v1/poses/shelf?replace=true", {})]
        assert session.notes[-1].startswith("Taught shelf: 500.0 1100.0 600.0 mm")


def test_a_service_that_is_gone_is_stopped_past(monkeypatch: pytest.MonkeyPatch) -> None:
    async def stop(session: PendantSession) -> None:
        await session.look()
        session.stop()
        await session.close()

    url = f"http://127.0.0.1:{free_port()}"
    session = PendantSession(ServiceClient(url), WORKSPACE, "en")
    monkeypatch.setattr(runtime, "find", lambda: Running(url, 1, None))
    monkeypatch.setattr(runtime, "claimant", lambda: 1)
    real_time(stop(session))
    assert session.trouble.startswith("`maya up` does not run on this computer")
    assert session.notes[-1].startswith("NOT STOPPED: `maya up` does not run on this computer")
    assert session.trouble in picture(session)


def test_picture_shows_mode_step_place_and_limits() -> None:
    session = PendantSession(ServiceClient("http://127.0.0.1:1"), WORKSPACE, "en")
    assert "unknown until homed" not in picture(session), "nobody has been asked yet"
    session.status = {"state": state(None, "not_homed")}
    assert "not homed" in picture(session) and "unknown until homed" in picture(session)
    assert ("class:trouble", "sin referenciar") in drawn(session, "es", MILLIMETRES)
    session.status = {"state": state(mode="moving")}
    session.step = "1"
    session.notes.append("something")
    shown = picture(session)
    assert "Maya   moving   ± 1.0 mm / 0.10°" in shown
    assert "x     500.0 mm" in shown
    assert "r    1208.3 mm" in shown
    assert "a       24.44°" in shown
    assert f"nearest limits: {session.nearest()[0].text(MILLIMETRES)}" in shown
    assert shown.endswith("something\n")
    session.status = {"state": {**state(mode="fault"), "fault": {"code": 2301, "message": "Axis b met its switch."}}}
    assert ("class:trouble", "  Axis b met its switch.") in drawn(session, "en", MILLIMETRES)


def test_lengths_and_angles_are_shown_in_the_units_of_the_options() -> None:
    with pendant(Robot()) as session:
        session.status = {"state": state()}
        shown = picture(session, SI)
    assert "± 0.0100 m / 0.0175 rad" in shown
    assert "x     0.5000 m" in shown
    assert "a   0.4266 rad" in shown
    assert f"nearest limits: {session.nearest()[0].text(SI)}" in shown
    assert "mm" not in shown and "°" not in shown


@pytest.mark.parametrize(("line", "missing"), [("jog", "AXIS"), ("jog b", "DISTANCE")])
def test_without_a_terminal_there_is_no_pendant(line: str, missing: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(line.split()) == 2
    assert f"error 4008: {missing} is missing" in capsys.readouterr().err
