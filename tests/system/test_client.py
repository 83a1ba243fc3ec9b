"""The Python client on a whole stack: a twin in a process of its own, asked as a student would."""

from __future__ import annotations

import asyncio
import os
import select
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import suppress
from itertools import pairwise
from math import dist
from pathlib import Path

import pytest

from dmc41x3.loops import run
from maya_un import AsyncClient, Client, JobBuilder
from maya_un.client import Event, StillWaiting
from maya_un.errors import (
    GripperEmpty,
    LeaseHeld,
    MayaError,
    NotFound,
    NotTaught,
    Stopped,
    TwinNotFound,
    UnknownName,
    Unreachable,
)
from maya_un.schema.jobs import QueueMode, TaskState
from maya_un.values import Joints, Mode, Point
from tests.system.processes import CALM, running

pytestmark = [pytest.mark.system, pytest.mark.timeout(180)]

CUBE = (0.50, 1.10)
TRAY = (1.10, 0.50)
FAR = JobBuilder("far").approach([0.20, 1.30, 0.50]).approach([1.20, 0.40, 0.50])


@pytest.fixture(scope="module")
def homed() -> Iterator[Client]:
    with Client.twin(speed=60, parts={"cube": CUBE}) as client:
        client.home()
        yield client


@pytest.fixture
def maya(homed: Client) -> Iterator[Client]:
    """The twin, homed, with its gripper open, nothing queued and nothing slowed down; left the same way."""
    homed.gripper("open")
    yield homed
    homed.stop()
    homed.queue.clear()
    with suppress(MayaError):
        homed.resume()
    homed.queue.resume()
    homed.speed(1.0)


def moving(client: Client) -> None:
    """Return as soon as the robot moves."""
    for state in client.states(rate=50.0):
        if state.moving:
            return


@pytest.mark.waits("4 s of homing at sixty times real speed, and about 3 s of two picks and two places")
def test_part_is_picked_and_placed_at_the_target(maya: Client) -> None:
    assert maya.pick(*CUBE).steps[0].state is TaskState.DONE
    assert maya.status().holding
    maya.place(*TRAY)
    assert dist(maya.twin_parts()["cube"][:2], TRAY) < 2e-4
    maya.pick(TRAY)
    maya.place(CUBE)
    assert dist(maya.twin_parts()["cube"][:2], CUBE) < 2e-4


def test_questions_about_the_machine(maya: Client) -> None:
    joints = maya.ik(0.5, 1.2, 0.5)
    assert isinstance(joints, Joints)
    assert maya.fk(*joints) == pytest.approx(Point(0.5, 1.2, 0.5), abs=1e-9)
    assert maya.reach(0.5, 1.2, 0.5).reachable
    assert not maya.reach(0.5, 1.2, 2.2).reachable
    with pytest.raises(Unreachable, match="above their anchors"):
        maya.ik(0.5, 1.2, 2.2)
    assert maya.config().geometry.height == 2.35
    assert maya.state().mode is Mode.IDLE


def test_a_job_is_previewed_as_it_is_done(maya: Client) -> None:
    job = JobBuilder("there").approach([0.9, 0.7])
    preview = maya.preview(job)
    report = maya.submit(job).wait()
    assert preview.duration == pytest.approx(report.predicted)
    assert maya.inspect(job).preview.refusal is None
    picture = maya.plot(FAR)
    assert picture._repr_svg_().startswith("<?xml")


def test_refusal_is_raised_as_its_error(maya: Client) -> None:
    with pytest.raises(GripperEmpty, match="nothing to place"):
        maya.place(*TRAY)
    with pytest.raises(Unreachable, match="nearest reachable"):
        maya.approach(0.0, 2.2, 2.3)
    with pytest.raises(UnknownName):
        maya.submit({"steps": [{"pick": "cub"}]})
    with pytest.raises(NotFound):
        maya.job(99_999)


@pytest.mark.waits("1 s of two motions at sixty times real speed, through HTTP")
def test_a_job_can_be_followed_to_its_end(maya: Client) -> None:
    seen = [(report.state, [step.state for step in report.steps]) for report in maya.submit(FAR)]
    assert seen[-1] == (TaskState.DONE, [TaskState.DONE, TaskState.DONE])
    assert all(one != other for one, other in pairwise(seen))


def test_queue_is_paused_reordered_and_resumed(maya: Client) -> None:
    assert maya.queue.pause().mode is QueueMode.PAUSED
    first, second, third = (maya.submit({"name": name, "steps": [{"approach": CUBE}]}) for name in "abc")
    assert [line.id for line in maya.queue.view().waiting] == [first.id, second.id, third.id]
    third.move(to="first")
    assert second.hold().state is TaskState.HELD
    assert first.change(notes="the last", priority=-5).notes == "the last"
    maya.queue.resume()
    assert third.wait().state is TaskState.DONE
    assert first.wait().state is TaskState.DONE
    assert second.report().state is TaskState.HELD
    second.release()
    assert second.wait().state is TaskState.DONE
    assert second.again().wait().state is TaskState.DONE
    names = [line.name for line in maya.history.page(limit=4)]
    assert names == ["b", "c", "b", "a"]


def test_waiting_behind_a_paused_queue_is_reported(maya: Client) -> None:
    maya.queue.pause()
    job = maya.submit({"steps": [{"approach": CUBE}]})
    with pytest.warns(StillWaiting, match=r"the queue is paused \(asked\)"), pytest.raises(TimeoutError):
        job.wait(timeout=0.5)
    assert job.cancel().state is TaskState.CANCELLED


def test_every_event_is_received_exactly_once(maya: Client) -> None:
    found: list[Event] = []
    last = maya.status().last_event
    job = maya.submit(FAR)
    for event in maya.events(since=0):
        found.append(event)
        if event.kind == "job" and event.detail["job"] == job.id and event.detail["state"] == "done":
            break
    assert [event.seq for event in found] == list(range(1, len(found) + 1))
    assert len(found) > last
    assert {event.run for event in found} == {maya.status().run}


def test_states_are_received_in_motion(maya: Client) -> None:
    maya.speed(0.2)
    job = maya.submit(FAR)
    times: list[float] = []
    for state in maya.states(rate=50.0):
        times.append(state.time)
        if len(times) == 5:
            break
    assert times == sorted(times)
    assert job.cancel().state is TaskState.CANCELLED


def test_stop_ends_the_command_of_another_client(maya: Client) -> None:
    maya.speed(0.05)
    other = Client(maya.address)
    stopping = threading.Thread(target=lambda: (moving(other), other.stop()))
    stopping.start()
    with pytest.raises(Stopped, match="A stop command ended this motion"):
        maya.approach(0.20, 1.30, 0.50)
    stopping.join()
    other.close()


def test_ctrl_c_stops_the_robot_on_its_path(maya: Client) -> None:
    maya.speed(0.05)
    other = Client(maya.address)
    main = threading.main_thread().ident
    assert main is not None
    interrupting = threading.Thread(target=lambda: (moving(other), signal.pthread_kill(main, signal.SIGINT)))
    interrupting.start()
    with pytest.raises(KeyboardInterrupt):
        maya.approach(1.20, 0.40, 0.50)
    interrupting.join()
    other.close()
    (line,) = maya.history.page(limit=1)
    assert line.state is TaskState.CANCELLED
    assert not maya.state().moving


def test_pause_holds_the_motion_and_resume_continues_it(maya: Client) -> None:
    maya.speed(0.1)
    job = maya.submit(FAR)
    moving(maya)
    assert maya.pause().was_moving
    maya.speed(1.0)
    maya.resume()
    assert job.wait().state is TaskState.DONE


def test_places_pallets_and_zones_are_taught_and_forgotten(maya: Client) -> None:
    maya.approach(*CUBE)
    pose = maya.poses.teach("over-the-cube")
    maya.jog("z", 0.05)
    maya.move("over-the-cube")
    assert maya.state().joints == pytest.approx(pose.joints, abs=1e-5)
    assert [known.name for known in maya.poses.all()] == ["over-the-cube"]
    maya.poses.forget("over-the-cube")
    with pytest.raises(NotTaught):
        maya.poses.get("over-the-cube")
    corners = [(1.00, 0.47), (1.12, 0.47), (1.00, 0.23)]
    assert maya.pallets.teach("box", corners, 3, 2).rows == 3
    maya.pallets.forget("box")
    maya.zones.keep_out("rack", kind="box", low=[0.1, 1.6, 0.0], high=[0.3, 1.7, 0.6])
    assert [zone.name for zone in maya.zones.all()] == ["rack"]
    assert [zone.name for zone in maya.config().zones] == ["rack"]
    maya.zones.allow("rack")
    assert maya.zones.all() == []


def test_second_client_learns_the_driver(maya: Client) -> None:
    with Client(maya.address) as other, maya.lease(note="mine"):
        view = other.lease.view()
        assert (view.note, view.yours) == ("mine", False)
        assert maya.lease.view().yours
        with pytest.raises(LeaseHeld), other.lease():
            pytest.fail("two drive")
        maya.jog("z", 0.01)
    assert maya.lease.view().holder == ""


@pytest.mark.waits("1 s of three motions at sixty times real speed, through HTTP")
def test_the_client_that_awaits_does_the_same(maya: Client) -> None:
    async def later() -> tuple[list[TaskState], list[int]]:
        async with AsyncClient(maya.address) as client:
            async with client.lease(note="in a loop"):
                await client.approach(*CUBE)
            job = await client.submit(FAR)
            states = [report.state async for report in job]
            seen: list[int] = []
            async for event in client.events(since=0):
                seen.append(event.seq)
                if len(seen) == 20:
                    break
            async for state in client.states():
                assert state.homed
                break
            with pytest.raises(GripperEmpty):
                await client.place(*TRAY)
            assert len([line async for line in client.history.every(text="far")]) >= 1
            return states, seen

    states, seen = run(later())
    assert states[-1] is TaskState.DONE
    assert seen == list(range(1, 21))


def test_a_cancelled_task_stops_the_robot(maya: Client) -> None:
    maya.speed(0.05)

    async def later() -> None:
        async with AsyncClient(maya.address) as client:
            request = asyncio.create_task(client.approach(0.20, 1.30, 0.50))
            async for state in client.states(rate=50.0):
                if state.moving:
                    break
            request.cancel()
            with pytest.raises(asyncio.CancelledError):
                await request

    run(later())
    (line,) = maya.history.page(limit=1)
    assert line.state is TaskState.CANCELLED


def test_it_works_inside_a_running_loop_as_in_a_notebook(maya: Client) -> None:
    async def cell() -> bool:
        return maya.approach(*CUBE).steps[0].state is TaskState.DONE

    assert run(cell())


def test_twin_copies_the_users_robot_and_changes_nothing_of_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own = tmp_path / "maya"
    own.mkdir()
    (own / "config.toml").write_text("[cell]\nclearance = 0.12\n", encoding="utf-8")
    pose = '[poses.shelf]\njoints = [0.5, 1.7, 1.7]\ntaught = "2026-03-01"\n'
    (own / "poses.toml").write_text(pose, encoding="utf-8")
    monkeypatch.delenv("MAYA_CONFIG", raising=False)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    with Client.twin(table={"parts": {"cube": [0.5, 1.1]}, "steps": ["home"]}) as client:
        assert client.config().cell.clearance == 0.12
        assert [known.name for known in client.poses.all()] == ["shelf"]
        client.poses.forget("shelf")
        assert dist(client.twin_parts()["cube"], (0.5, 1.1, 0.4)) < 1e-9
    assert (own / "poses.toml").read_text(encoding="utf-8") == pose
    assert sorted(place.name for place in own.iterdir()) == ["config.toml", "poses.toml"]


def test_twin_that_cannot_start_gives_the_reason() -> None:
    with pytest.raises(MayaError) as caught:
        Client.twin(parts={"cube": (0.5,)})
    assert caught.value.code in {4002, TwinNotFound.code}


def test_a_twin_ends_with_the_program_that_started_it() -> None:
    program = "import maya_un; m = maya_un.Client.twin(); print(m._twin.pid, flush=True); input()"
    parent = subprocess.Popen([sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    assert parent.stdin is not None
    twin = os.pidfd_open(int(parent.stdout.readline()))
    parent.kill()
    parent.communicate()
    assert select.select([twin], [], [], 60.0)[0], "the twin goes on alone"
    os.close(twin)


@pytest.fixture
def own_places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("MAYA_RUNTIME_DIR", "MAYA_STATE_DIR", "XDG_CONFIG_HOME"):
        monkeypatch.setenv(name, str(tmp_path / name.lower()))


@pytest.mark.waits("4 s of homing at sixty times real speed, through HTTP")
@pytest.mark.usefixtures("own_places")
def test_after_a_kill_the_same_client_finds_the_new_run_and_a_person_chooses() -> None:
    line = f"up --speed 60 --port 0 {CALM}"
    client = Client()
    found: list[Event] = []
    with running(line) as up:
        up.until("maya home")
        client.home()
        client.speed(0.05)
        events = client.events(since=client.status().last_event)
        job = client.submit(FAR)
        for event in events:
            found.append(event)
            if event.kind == "phase":
                break
        up.send(signal.SIGKILL)
    with running(line) as up:
        up.until("maya home")
        for event in events:
            found.append(event)
            if event.run != found[0].run:
                break
        assert (found[-1].run, found[-1].seq) == (found[0].run + 1, 1)
        offer = client.queue.recovery()
        assert offer is not None
        assert (offer.job, offer.index, offer.step) == (job.id, 1, "approach 0.2 1.3 0.5")
        assert not client.state().moving
        assert client.queue.recover("abort").recovery is None
        assert job.report().state is TaskState.CANCELLED
    client.close()
