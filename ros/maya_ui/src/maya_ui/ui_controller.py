"""A robot over rospy: the topics, services and actions of the graph that the dashboard uses, and nothing else.

Names are relative, so the dashboard shows the Maya of its namespace; without a namespace they are the manual's.
"""

from __future__ import annotations

import threading
from time import monotonic
from typing import Any, Callable, Sequence

import rosgraph
import rospy
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import Point
from maya_controller.msg import FollowAction, FollowGoal, HomeAction, HomeGoal
from maya_process.msg import ProcessQueue
from maya_process.srv import RecoverQueue
from maya_robot.msg import MayaPrimitive, TaskAction, TaskGoal
from maya_robot.srv import MayaCommand
from sensor_msgs.msg import JointState
from std_msgs.msg import Empty, Float64, String
from std_srvs.srv import SetBool, Trigger
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from maya_ui.layers import NO_ANSWER, GoalClient, answer, ask, call, expect, in_thread, master, master_answers
from maya_ui.robot import (
    Cell,
    Choice,
    Command,
    Ended,
    Heard,
    Joints,
    Path,
    Position,
    Presence,
    Standing,
    Under,
)
from maya_ui.seen import event, queue
from maya_ui.tasks import AIMED, HOME, Task

OF_THE_CONTROLLER = (
    "controller/stop",
    "controller/pause",
    "controller/resume",
    "controller/recover",
    "gripper",
)
"""The services of the controller layer that are called from here."""

LOOK = 0.5
"""Time between two checks for servers [s]."""

SILENCE = 3.0
"""A controller layer that publishes no joints for this time is silent [s]."""

LEAVE = 1.0
"""Longest wait for a jog to come to rest when the dashboard is closed [s]; then the layer ends it."""

STOP_ANSWER = 2.0
"""A stop that is not confirmed within this time is reported as unconfirmed [s]."""


BUSY = "2104"
"""The code of a robot that is busy."""

MOST_ASKED, ASK_AGAIN = 20, 0.05
"""A busy robot layer is asked so many times for permission to jog, with this wait between [s]."""

_AT_REST = frozenset({"idle", "not_homed", "paused", "fault"})
"""Modes in which nothing moves."""


class UiController:
    """Sends all requests of the dashboard over the graph, and returns answers as facts.

    Home, tasks and the gripper go to the highest layer in the graph, because that layer decides about all motion.
    `prepare` makes this program a node, and may wait for a master; in rqt it is one already.
    """

    def __init__(self, prepare: Callable[[], None] | None = None) -> None:
        self._prepare = prepare
        self._heard: Heard = lambda _: None
        self._graph: _Part | None = None
        self._ended = threading.Event()

    def open(self, heard: Heard) -> None:
        """Take part in the graph once a master answers. rospy waits for a master, so this is done in a thread."""
        self._heard = heard
        in_thread(self._live)

    def close(self) -> None:
        """Leave the graph; end a jog of this dashboard."""
        self.end_jog()
        self._ended.set()
        graph = self._graph
        if graph is not None:
            graph.follow.wait(LEAVE)
            gone = threading.Event()
            in_thread(graph.leave, gone)
            gone.wait(LEAVE)

    def home(self) -> None:
        """Home, through the robot layer if it is present."""
        graph = self._graph
        if graph is not None and graph.presence.robot:
            self._begin(graph.task, Command.HOME, TaskGoal(_primitive(Task(HOME))))
        elif graph is not None:
            self._begin(graph.home, Command.HOME, HomeGoal())

    def perform(self, task: Task) -> None:
        """Do a task now."""
        graph = self._graph
        if task.command == HOME:
            self.home()
        elif task.command not in AIMED:
            self.gripper(task.open)
        elif graph is not None:
            self._begin(graph.task, Command.TASK, TaskGoal(_primitive(task)))

    def gripper(self, open_: bool) -> None:
        """Open or close the gripper, through the robot layer if it is present."""
        self._heard(Under(Command.GRIPPER))
        if self._graph is not None and self._graph.presence.robot:
            task = MayaPrimitive(command=MayaPrimitive.GRIPPER, open=open_)
            ask(Command.GRIPPER, "maya_command", MayaCommand, self._heard, task)
        else:
            ask(Command.GRIPPER, "gripper", SetBool, self._heard, open_)

    def stop(self) -> None:
        """Stop the queue and the controller node; if the node does not answer, cancel its actions.

        The stop is unconfirmed if the node neither answers nor reports rest afterwards.
        """
        if self._graph is None:
            self._heard(Ended(Command.STOP, done=False, message="stop_unheard"))
            return
        self._graph.stop_queue.publish(Empty())
        in_thread(self._stop, self._graph)

    def recover(self) -> None:
        """Clear a fault."""
        ask(Command.RECOVER, "controller/recover", Trigger, self._heard)

    def pause(self) -> None:
        """Hold all motion."""
        ask(Command.PAUSE, "controller/pause", Trigger, self._heard)

    def resume(self) -> None:
        """Continue after a pause."""
        ask(Command.RESUME, "controller/resume", Trigger, self._heard)

    def speed(self, ratio: float) -> None:
        """Scale the speed of all motion."""
        if self._graph is not None:
            self._graph.speed.publish(Float64(ratio))

    def jog(self, path: Path) -> None:
        """Send a path as a goal to the controller layer, which ends it if this program dies."""
        graph = self._graph
        if graph is None or not graph.follow.there:
            self._heard(Ended(Command.JOG, done=False, message="no_answer"))
        elif graph.follow.begin(Command.JOG):
            in_thread(_jog, graph, FollowGoal(_trajectory(path)))
        else:
            self._heard(Ended(Command.JOG, done=False, code=BUSY, message="busy"))

    def end_jog(self) -> None:
        """Cancel the jog, which comes to rest on its path; if it does not, stop the robot."""
        if self._graph is not None:
            self._graph.follow.cancel()
            in_thread(self._see_it_end, self._graph)

    def send(self, task: Task) -> None:
        """Append a task to the queue."""
        if self._graph is not None:
            self._graph.send_task.publish(_primitive(task))

    def start_queue(self, tasks: Sequence[Task]) -> None:
        """Append tasks to the queue as one job."""
        if self._graph is not None:
            self._graph.start_queue.publish(ProcessQueue([_primitive(task) for task in tasks]))

    def stop_queue(self) -> None:
        """Stop all motion and cancel all jobs in the queue."""
        if self._graph is not None:
            self._graph.stop_queue.publish(Empty())
            self._heard(Ended(Command.STOP_QUEUE, done=True))

    def resume_queue(self) -> None:
        """Continue the paused queue."""
        ask(Command.RESUME_QUEUE, "resume_queue", Trigger, self._heard)

    def recover_queue(self, choice: Choice) -> None:
        """Decide about the interrupted job."""
        ask(Command.RECOVER_QUEUE, "recover_queue", RecoverQueue, self._heard, choice.name, choice.holding)

    def _begin(self, goal_client: GoalClient, command: Command, goal: Any) -> None:
        if not goal_client.there:
            self._heard(Ended(command, done=False, message="no_answer"))
        elif goal_client.begin(command):
            goal_client.go(goal)
        else:
            self._heard(Ended(command, done=False, code=BUSY, message="busy"))

    def _live(self) -> None:
        """Check repeatedly which servers are connected."""
        if self._prepare is not None:
            self._prepare()
        graph = self._graph = _Part(self._heard)
        if self._ended.is_set():
            graph.leave(threading.Event())
            return
        in_thread(self._watch_master)
        while not self._ended.wait(LOOK):
            graph.look()

    def _watch_master(self) -> None:
        """Check whether the master answers, in a separate thread, because a call of a hanging master blocks."""
        while self._graph is not None and not self._ended.wait(LOOK):
            self._graph.master = master_answers(rospy.get_name())

    def _stop(self, graph: _Part) -> None:
        heard = threading.Event()
        confirmed: list[Ended] = []

        def tell(end: Ended) -> None:
            confirmed.extend([end] if end.done or end.code else [])
            heard.set()

        ask(Command.STOP, "controller/stop", Trigger, tell)
        graph.follow.cancel()
        heard.wait(STOP_ANSWER)
        if confirmed:
            self._heard(confirmed[0])
            return
        graph.cancel_all()
        rests = graph.rests(STOP_ANSWER)
        self._heard(Ended(Command.STOP, done=rests, message="" if rests else "stop_unheard"))

    def _see_it_end(self, graph: _Part) -> None:
        if not graph.follow.wait(STOP_ANSWER):
            self.stop()


class _Part:
    """Members of this program in the graph: topics, clients, and which servers answer."""

    def __init__(self, heard: Heard) -> None:
        self._heard = heard
        self._spoken: float | None = None
        self._news = threading.Condition()
        self._told = 0
        self._standing = Standing()
        self.master = True
        self.presence = Presence()
        self.send_task = rospy.Publisher("send_task", MayaPrimitive, queue_size=100)
        self.start_queue = rospy.Publisher("start_queue", ProcessQueue, queue_size=100)
        self.stop_queue = rospy.Publisher("stop_queue", Empty, queue_size=100)
        self.speed = rospy.Publisher("controller/speed", Float64, queue_size=1)
        self.task = GoalClient("task", TaskAction, heard)
        self.home = GoalClient("home", HomeAction, heard)
        self.follow = GoalClient("controller/follow", FollowAction, heard)
        self._cancel_move = rospy.Publisher("move/cancel", GoalID, queue_size=1)
        self._events = rospy.Subscriber("maya_event", String, self._event, queue_size=100)
        self._heard_of = [
            self._events,
            rospy.Subscriber("maya_position", Point, lambda at: heard(Position(at.x, at.y, at.z)), queue_size=1),
            rospy.Subscriber("joint_states", JointState, self._joints, queue_size=1),
            rospy.Subscriber("queue_status", String, self._queue, queue_size=1),
        ]

    def look(self) -> None:
        """Report which layers are present, after a change, and end goals without a server."""
        for goal_client in (self.task, self.home, self.follow):
            goal_client.check()
        presence = self._now()
        if presence == self.presence:
            return
        if presence.controller and not self.presence.controller:
            self._ask_cell()
            expect(*OF_THE_CONTROLLER)
        if presence.robot and not self.presence.robot:
            expect("maya_command")
        if presence.process and not self.presence.process:
            expect("resume_queue", "recover_queue")
        self.presence = presence
        self._heard(presence)

    def cancel_all(self) -> None:
        """Cancel the goals of all clients in the controller layer and the robot layer; needs no master."""
        for goal_client in (self.follow, self.home, self.task):
            goal_client.cancel_all()
        self._cancel_move.publish(GoalID())

    def rests(self, within: float) -> bool:
        """Return whether the controller layer reports rest from now on, within the time `within` [s]."""
        with self._news:
            told = self._told
            return self._news.wait_for(lambda: self._told > told and self._standing.mode in _AT_REST, within)

    def leave(self, gone: threading.Event) -> None:
        """Close everything, and set `gone` when that is done."""
        for goal_client in (self.task, self.home, self.follow):
            goal_client.close()
        topics = (self.send_task, self.start_queue, self.stop_queue, self.speed, self._cancel_move)
        for topic in (*self._heard_of, *topics):
            topic.unregister()
        gone.set()

    def _now(self) -> Presence:
        controller = self._events.get_num_connections() > 0
        if not controller:
            self._spoken = None
        elif not self.presence.controller:  # its topics are found one after the other
            controller = self.home.there and self.follow.there
        return Presence(
            master=self.master,
            controller=controller,
            silent=self._spoken is not None and monotonic() - self._spoken > SILENCE,
            robot=self.task.there,
            process=all(topic.get_num_connections() for topic in (self.send_task, self.start_queue, self.stop_queue)),
        )

    def _event(self, text: Any) -> None:
        happened = event(text.data)
        self._tell(happened.standing)
        self._heard(happened)

    def _queue(self, text: Any) -> None:
        found = queue(text.data)
        if found is not None:
            self._heard(found)

    def _tell(self, standing: Standing | None = None) -> None:
        """Record a report of the controller layer, and its state."""
        with self._news:
            self._told += 1
            self._standing = standing or self._standing
            if not self._standing.homed:
                self._spoken = None  # before homing the joints are unknown, and no joints are published
            self._news.notify_all()

    def _joints(self, message: Any) -> None:
        if self._standing.homed:
            self._spoken = monotonic()
        self._tell()
        places = dict(zip(message.name, message.position))
        if {"a", "b", "c"} <= places.keys():
            self._heard(Joints(places["a"], places["b"], places["c"]))

    def _ask_cell(self) -> None:
        try:
            height = master(rospy.get_name()).getParam(rospy.resolve_name("maya/config/cell/grasp_height"))
        except (*NO_ANSWER, rosgraph.MasterException):
            return
        if isinstance(height, (int, float)):
            self._heard(Cell(float(height)))


def _jog(graph: _Part, goal: Any) -> None:
    """Send the jog, if the robot layer permits it: between two motions of a task the robot looks idle."""
    may = _permission(graph) if graph.presence.robot else Ended(Command.JOG, done=True)
    if may.done:
        graph.follow.go(goal)
    else:
        graph.follow.end(done=False, code=may.code, message=may.message)


def _permission(graph: _Part) -> Ended:
    """Ask the robot layer for permission to jog, several times if it is busy.

    It may hear of the end of the last motion later than this program.
    """
    asked = MayaPrimitive(command=MayaPrimitive.CAN_TELEOP)
    may = Ended(Command.JOG, done=False)
    for _ in range(MOST_ASKED):
        try:
            may = answer(Command.JOG, call("maya_command", MayaCommand, asked))
        except (rospy.ServiceException, rospy.ROSException, OSError) as error:
            return Ended(Command.JOG, done=False, message=str(error))
        if may.done or may.code != BUSY or graph.follow.cancelled_within(ASK_AGAIN):
            break
    return may


def _primitive(task: Task) -> Any:
    return MayaPrimitive(command=task.command, target=Point(*task.target), open=task.open)


def _trajectory(path: Path) -> Any:
    points = [JointTrajectoryPoint(positions=list(point)) for point in path.points]
    return JointTrajectory(joint_names=list(path.names), points=points)
