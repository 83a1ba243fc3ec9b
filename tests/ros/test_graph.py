"""The graph by rospy, as other nodes see it: one node made of it, and a driver that knows ROS alone."""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator
from threading import Event, Thread
from typing import Any

import pytest

from maya_ros.graph.protocol import GoalStatus
from tests.ros.driver_client import Driver, Feed, Goal, RefusedError
from tests.ros.harness import HERE, Ros
from tests.ros.peer_outcomes import MOVE, GoalOutcome
from tests.ros.programs import Program
from tests.ros.slow_master import slow_master
from tests.ros.workspace import ROOT, Workspace, outputs_of, python

pytestmark = pytest.mark.system

OFFERED = ("in", "out", "said", "do", "move", "lasting", "failing", "late", "quick")
"""Names below /peer of a peer; others of the same graph need other ones."""


class Peer:
    """The node made of our graph."""

    def __init__(self, ros: Ros, driver: Driver, name: str = "peer", *names: str) -> None:
        path = f"{ROOT}:{ros.environment.get('PYTHONPATH', '')}"
        self.driver = driver
        self.program = ros.start(
            str(python()), "-m", "tests.ros.peer", f"__name:={name}", *names, environment={"PYTHONPATH": path}
        )
        self.program.until("ready")
        self.said = driver.subscribe("/peer/said", "std_msgs/String")

    def do(self, op: str, **details: Any) -> None:
        """Have it do something."""
        self.driver.publish("/peer/do", "std_msgs/String", {"data": json.dumps({"op": op, **details})})

    def says(self, what: str, after: int = 0) -> dict[str, Any]:
        """Return its next message about a topic."""
        return _read(self.said.until(lambda message: _read(message)["what"] == what, after=after))

    def runs(self, thread: str) -> bool:
        """Return whether it has a thread of this name."""
        before = len(self.said.messages)
        self.do("threads")
        return thread in self.says("threads", before)["names"]


def _read(message: dict[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(message["data"])
    return found


@pytest.fixture(scope="module")
def ros(tmp_path_factory: pytest.TempPathFactory, workspace: Workspace) -> Iterator[Ros]:
    with Ros(tmp_path_factory.mktemp("graph"), workspace) as shared:
        shared.set_param("/maya/speed", 10.0)
        shared.set_param("/actionlib_client_pub_queue_size", 100)  # of the 10 by default, a loaded machine drops goals
        yield shared


@pytest.fixture(scope="module")
def driver(ros: Ros) -> Driver:
    return ros.driver()


@pytest.fixture(scope="module")
def peer(ros: Ros, driver: Driver) -> Peer:
    return Peer(ros, driver)


def move(driver: Driver, asked: GoalOutcome) -> Goal:
    return driver.do("/peer/move", MOVE, {"a": float(asked)})


def mark(feed: Feed) -> int:
    """Return the number of messages so far."""
    return len(feed.messages)


def test_latched_messages_reach_late_subscribers_and_order_is_kept(peer: Peer, driver: Driver) -> None:
    heard = driver.subscribe("/peer/out", "std_msgs/String")
    assert heard.until()["data"] == "latched"
    for number in range(200):
        driver.publish("/peer/in", "std_msgs/String", {"data": str(number)})
    heard.until(lambda message: message["data"] == "199")
    assert [message["data"] for message in heard.messages] == ["latched", *map(str, range(200))]
    peer.do("writers")
    assert peer.says("writers")["names"] == [driver.name]


@pytest.mark.waits("2 s: rospy begins to handle the publishers of topics, and gets the news of another one")
def test_publisher_that_registers_during_a_subscription_is_heard(ros: Ros, driver: Driver) -> None:
    """rospy handles the old answer to the registration after the new list of publishers, and drops the list."""
    publishing = Thread(
        target=driver.publish, args=("/missed/in", "std_msgs/String", {"data": "heard"}), kwargs={"latch": True}
    )

    def publish() -> None:
        Event().wait(1.0)  # rospy looks at them every half second, and waits now for the end of the registration
        publishing.start()
        ros.until(lambda: "/missed/in" in dict(ros.ask_master("getPublishedTopics", "")), "a publisher")
        Event().wait(1.0)

    heard = driver.subscribe("/missed/out", "std_msgs/String")
    names = [f"/peer/{name}:=/missed/{name}" for name in OFFERED]
    path = f"{ROOT}:{ros.environment.get('PYTHONPATH', '')}"
    with slow_master(ros.uri, "registerSubscriber", "/missed/in", publish) as way:
        peer = ros.start(
            str(python()), "-m", "tests.ros.peer", "__name:=missed", *names,
            environment={"PYTHONPATH": path, "ROS_MASTER_URI": way.uri},
        )  # fmt: skip
        heard.until(lambda message: message["data"] == "heard")
        assert way.held.is_set()
        peer.close()
    publishing.join()


def test_second_connection_to_a_publisher_does_not_replace_the_first() -> None:
    """rospy would close the first one, with messages in it that nobody has read."""
    (kept,) = outputs_of("tests.ros.connecting")
    assert kept == [True, False, True]


@pytest.mark.parametrize(("service", "words"), [("/peer/late", "in the loop"), ("/peer/quick", "at once")])
def test_services_are_answered(service: str, words: str, peer: Peer, driver: Driver) -> None:
    assert driver.call(service) == {"success": True, "message": words}
    before = mark(peer.said)
    peer.do("call", service=service)
    assert peer.says("answered", before)["answer"] == {"success": True, "message": words}


@pytest.mark.usefixtures("peer")
def test_a_service_that_fails_says_why(driver: Driver) -> None:
    with pytest.raises(RefusedError, match=r"busy.*2104"):
        driver.call("/peer/failing")


def test_a_call_that_fails_has_the_code_of_services_and_the_words_of_the_server(peer: Peer) -> None:
    before = mark(peer.said)
    peer.do("call", service="/peer/failing")
    failed = peer.says("failed", before)
    assert failed["code"] == 4020
    assert "The robot is busy (something else)" in failed["sentence"]
    before = mark(peer.said)
    peer.do("call", service="/peer/nothing")
    assert peer.says("failed", before)["code"] == 4019


def test_disconnected_caller_has_its_answer_cancelled(ros: Ros, peer: Peer) -> None:
    before = mark(peer.said)
    caller = ros.start("rosservice", "call", "/peer/lasting")
    peer.says("asked", before)
    caller.kill()
    assert peer.says("cancelled", before)["of"] == "service"
    before = mark(peer.said)
    peer.do("call", service="/peer/lasting")
    peer.says("asked", before)
    peer.do("cancel")
    assert peer.says("cancelled", before)["of"] == "service"


@pytest.mark.usefixtures("peer")
@pytest.mark.waits("5 s: a node waits so long for the header of a connection")
def test_client_that_sends_no_header_keeps_nobody_from_connecting(ros: Ros, driver: Driver) -> None:
    """A node that looks for a killed one may reach this one at the same port: it sends an HTTP request, and waits."""
    assert driver.call("/peer/late")["success"]
    with ros.connection_to("/peer/late") as silent:
        silent.sendall(b"POST / HTTP/1.1\r\n")
        assert driver.call("/peer/late")["success"]
        assert silent.recv(1) == b""


def test_service_expected_before_it_was_served_is_called_without_a_master(ros: Ros, peer: Peer) -> None:
    peer.do("expect", service="/peer/promised")
    ros.until(lambda: peer.runs("maya-expect"), "the lookup")
    peer.do("serve", service="/peer/promised")
    ros.until(lambda: not peer.runs("maya-expect"), "an end of the lookup")
    with ros.frozen_master():
        before = mark(peer.said)
        peer.do("call", service="/peer/promised", kind="std_srvs/Trigger")
        assert peer.says("answered", before)["answer"]["message"] == "in the loop"


def test_call_cancelled_while_it_connects_is_never_sent(ros: Ros, peer: Peer) -> None:
    path = f"{ROOT}:{ros.environment.get('PYTHONPATH', '')}"
    offered = ("lasting", "failing", "late", "quick", "move", "do")
    server = ros.start(
        str(python()), "-m", "tests.ros.peer", "__name:=slow", *(f"/peer/{name}:=/slow/{name}" for name in offered),
        environment={"PYTHONPATH": path},
    )  # fmt: skip
    server.until("ready")
    server.send(signal.SIGSTOP)
    before = mark(peer.said)
    peer.do("call", service="/slow/lasting", kind="std_srvs/Trigger")
    peer.says("calling", before)
    peer.do("cancel")
    peer.says("did cancel", before)
    server.send(signal.SIGCONT)

    ros.until(lambda: not peer.runs("maya-call /slow/lasting"), "an end of the call")
    assert all(_read(message)["what"] != "asked" for message in peer.said.messages[before:])
    server.close()


ENDS = [
    (GoalOutcome.SUCCEEDS, GoalStatus.SUCCEEDED, ""),
    (GoalOutcome.TAKES_A_WHILE, GoalStatus.SUCCEEDED, ""),
    (GoalOutcome.IS_REFUSED, GoalStatus.REJECTED, "2104"),
    (GoalOutcome.FAILS, GoalStatus.ABORTED, "2301"),
    (GoalOutcome.BREAKS, GoalStatus.ABORTED, "5999"),
]


@pytest.mark.parametrize(("asked", "outcome", "code"), ENDS)
def test_a_goal_ends_as_its_act_does(
    asked: GoalOutcome, outcome: GoalStatus, code: str, peer: Peer, driver: Driver
) -> None:
    ended, result = move(driver, asked).ended()
    assert (ended, result["code"], result["success"]) == (outcome, code, not code)
    before = mark(peer.said)
    peer.do("do", action="/peer/move", goal={"a": float(asked)})
    told = peer.says("ended", before)
    assert (told["outcome"], told["result"]["code"]) == (outcome, code)


def test_a_cancel_ends_a_goal_when_its_act_is_at_rest(peer: Peer, driver: Driver) -> None:
    before = mark(peer.said)
    goal = move(driver, GoalOutcome.LASTS)
    goal.status.until(lambda status: status["state"] == GoalStatus.ACTIVE)
    goal.cancel()
    ended, result = goal.ended()
    assert (ended, result["code"]) == (GoalStatus.PREEMPTED, "2202")
    peer.says("cancelled", before)


@pytest.mark.usefixtures("peer")
def test_a_cancel_of_everything_ends_all_goals(driver: Driver) -> None:
    goals = [move(driver, GoalOutcome.LASTS) for _ in range(3)]
    for goal in goals:
        goal.status.until(lambda status: status["state"] == GoalStatus.ACTIVE)
    driver.publish("/peer/move/cancel", "actionlib_msgs/GoalID", {"id": ""}, readers=0)
    assert [goal.ended()[0] for goal in goals] == [GoalStatus.PREEMPTED] * 3


@pytest.mark.usefixtures("peer")
def test_goals_that_are_cancelled_at_once_all_end(driver: Driver) -> None:
    """ROS' own client may take such a goal for lost; the server knows better."""
    results = driver.subscribe("/peer/move/result", "maya_controller/MoveActionResult")
    before = mark(results)
    for _ in range(30):
        move(driver, GoalOutcome.LASTS).cancel()
    results.until(lambda _: len(results.messages) >= before + 30, after=before)
    ends = {message["status"]["status"] for message in results.messages[before:]}
    assert ends <= {GoalStatus.PREEMPTED, GoalStatus.RECALLED}
    assert driver.call("/peer/late")["success"]


def test_the_goals_of_a_client_that_is_gone_are_cancelled(ros: Ros, peer: Peer) -> None:
    other = ros.driver()
    before = mark(peer.said)
    move(other, GoalOutcome.LASTS).feedback.until()
    other.program.kill()
    assert peer.says("cancelled", before)["of"] == "goal"


@pytest.mark.waits("3 s for which `rostopic pub -1` keeps its message, as the tools of ROS do")
def test_client_that_only_published_a_goal_may_leave(ros: Ros, peer: Peer, driver: Driver) -> None:
    before = mark(peer.said)
    results = driver.subscribe("/peer/move/result", "maya_controller/MoveActionResult")
    goal = f"{{goal_id: {{id: by_hand}}, goal: {{a: {GoalOutcome.TAKES_A_WHILE:d}}}}}"
    ros.tool("rostopic", "pub", "-1", "/peer/move/goal", "maya_controller/MoveActionGoal", goal)
    ended = results.until(lambda message: message["status"]["goal_id"]["id"] == "by_hand")
    assert ended["status"]["status"] == GoalStatus.SUCCEEDED
    assert all(_read(message)["what"] != "cancelled" for message in peer.said.messages[before:])


def test_our_client_cancels_and_gets_feedback(peer: Peer) -> None:
    before = mark(peer.said)
    peer.do("do", action="/peer/move", goal={"a": float(GoalOutcome.LASTS)})
    assert peer.says("feedback", before)["message"]["progress"] == 0.5
    peer.do("cancel")
    peer.says("did cancel", before)
    words = [_read(message)["what"] for message in peer.said.messages[before:]]
    assert words.index("cancelled") < words.index("did cancel")


def test_our_client_learns_that_an_action_has_no_server(peer: Peer) -> None:
    before = mark(peer.said)
    peer.do("do", action="/nobody/there", goal={})
    assert peer.says("failed", before)["code"] == 1011


def test_our_client_learns_that_the_server_was_killed(ros: Ros, driver: Driver, peer: Peer) -> None:
    path = f"{ROOT}:{ros.environment.get('PYTHONPATH', '')}"
    server = ros.start(
        str(python()), "-m", "tests.ros.peer", "__name:=mortal", "/peer/move:=/mortal/move", "/peer/do:=/mortal/do",
        environment={"PYTHONPATH": path},
    )  # fmt: skip
    server.until("ready")
    before = mark(peer.said)
    peer.do("do", action="/mortal/move", goal={"a": float(GoalOutcome.LASTS)})
    peer.says("feedback", before)
    server.kill()
    assert peer.says("ended", before)["outcome"] == GoalStatus.LOST


def _ends_in_time(program: Program) -> None:
    assert program.wait(within=8.0) == 0
    assert program.said.index("resting") < program.said.index("rested")
    assert "Traceback" not in program.said


@pytest.mark.parametrize("kind", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_node_comes_to_rest_before_it_ends(kind: signal.Signals, ros: Ros, driver: Driver) -> None:
    name = f"ended_by_{kind.name.lower()}"
    peer = Peer(ros, driver, name, f"/peer/move:=/{name}/move")  # others serve /peer/move as well
    goal = driver.do(f"/{name}/move", MOVE, {"a": float(GoalOutcome.LASTS)})
    goal.feedback.until()
    peer.program.send(kind)
    _ends_in_time(peer.program)
    assert f"/{name}" not in ros.nodes()


def test_a_node_ends_by_rosnode_kill_and_for_another_of_its_name(ros: Ros, driver: Driver) -> None:
    first = Peer(ros, driver, "twin")
    stranger = Driver(ros.start(str(python()), str(HERE / "driver.py"), "__name:=twin"))
    _ends_in_time(first.program)
    stranger.close()
    second = Peer(ros, driver, "twin")
    ros.tool("rosnode", "kill", "/twin")
    _ends_in_time(second.program)
    assert "/twin" not in ros.nodes()


@pytest.mark.waits("5 s until a node that does not answer counts as one that hangs")
def test_a_second_of_our_nodes_is_refused_until_the_first_is_dead(ros: Ros, driver: Driver) -> None:
    path = f"{ROOT}:{ros.environment.get('PYTHONPATH', '')}"

    def refused() -> str:
        second = ros.start(str(python()), "-m", "tests.ros.peer", "__name:=sole", environment={"PYTHONPATH": path})
        assert second.wait() == 2
        return second.said

    first = Peer(ros, driver, "sole")
    assert "error 5004: " in (said := refused())
    assert f"process {first.program.pid}" in said
    first.program.send(signal.SIGSTOP)
    assert "error 5004: " in refused()
    first.program.send(signal.SIGCONT)
    assert first.program.runs
    first.program.kill()
    third = Peer(ros, driver, "sole")
    third.program.close()


def test_without_a_master_a_node_reports_it_and_ends(ros: Ros) -> None:
    path = f"{ROOT}:{ros.environment.get('PYTHONPATH', '')}"
    alone = {"PYTHONPATH": path, "ROS_MASTER_URI": "http://127.0.0.1:1"}
    program = ros.start(str(python()), "-m", "tests.ros.peer", environment=alone)
    assert program.wait() == 2
    assert "error 5011: No ROS master answers at http://127.0.0.1:1." in program.said


WRONG = [
    ("speed", 0.0), ("speed", -1.0), ("speed", 1e6), ("speed", "fast"), ("speed", "20"), ("speed", True),
    ("sim_mode", "false"), ("sim_mode", 0),
]  # fmt: skip


@pytest.mark.parametrize(("name", "value"), WRONG)
def test_a_clock_that_cannot_be_is_refused(name: str, value: object, ros: Ros) -> None:
    path = f"{ROOT}:{ros.environment.get('PYTHONPATH', '')}"
    ros.set_param(f"/wrong/{name}", value)
    program = ros.start(
        str(python()), "-m", "tests.ros.peer", "__name:=wrong", f"/maya/{name}:=/wrong/{name}",
        environment={"PYTHONPATH": path},
    )  # fmt: skip
    assert program.wait() == 2
    assert "error 4001: " in program.said
    assert f"maya/{name}" in program.said


@pytest.mark.parametrize(("name", "value"), [("skip_home", "false"), ("seed", "x")])
def test_a_parameter_that_says_nothing_is_refused_by_its_name(name: str, value: object, ros: Ros) -> None:
    ros.set_param(f"/choosy/{name}", value)
    program = ros.start("rosrun", "maya_controller", "hw_simulator.py", "__name:=choosy")
    assert program.wait() == 2
    assert "error 4001: " in program.said
    assert name in program.said
