"""Clients of the layers over rospy: services that are called in separate threads, and actions."""

from __future__ import annotations

import threading
from http.client import HTTPException
from typing import Any, Callable
from xml.parsers.expat import ExpatError
from xmlrpc.client import Error as XmlRpcError
from xmlrpc.client import ServerProxy, Transport

import actionlib
import rosgraph
import rospy
from actionlib_msgs.msg import GoalID

from maya_ui.robot import Command, Ended, Under

CANCELLED = "2202"
"""The code of a cancelled command."""

LOST = "lost"
"""Instead of a code: the server no longer knows the goal."""

MOST_UNHEARD = 10
"""After this number of checks, a goal that no server has taken is cancelled."""

REACH = 2.0
"""A master that does not answer within this time hangs [s]."""

LOOKUP = 0.3
"""Longest wait for the master's address of a known service [s]; then the former address is used."""

NO_ANSWER = (OSError, ValueError, HTTPException, XmlRpcError, ExpatError)
"""Errors of a master that does not answer."""

Tell = Callable[[Any], None]

_addresses: dict[str, str] = {}


def in_thread(work: Callable[..., None], *arguments: object) -> None:
    """Do `work` in a separate thread, which never keeps the program from ending."""
    threading.Thread(target=work, args=arguments, daemon=True).start()


class _BoundedTransport(Transport):
    """Waits for a connection and for an answer for `patience` [s] each; without a limit, XML-RPC waits for ever."""

    def __init__(self, patience: float) -> None:
        super().__init__()
        self._patience = patience

    def make_connection(self, host: Any) -> Any:
        """Return the connection for a request."""
        connection = super().make_connection(host)
        connection.timeout = self._patience
        return connection


def master(caller: str, patience: float = REACH) -> Any:
    """Return a link to the ROS master; a request waits for `patience` [s] at most."""
    link = rosgraph.Master(caller)
    link.handle = ServerProxy(link.master_uri, _BoundedTransport(patience))
    return link


def master_answers(caller: str) -> bool:
    """Return whether a ROS master answers now."""
    try:
        master(caller).getPid()
    except (*NO_ANSWER, rosgraph.MasterException):
        return False
    return True


def expect(*services: str) -> None:
    """Look up services in a thread while the master is available; without it, the former addresses are used."""

    def look() -> None:
        for service in services:
            try:
                _located(rospy.resolve_name(service))
            except rospy.ServiceException:
                continue

    in_thread(look)


class _Service(rospy.ServiceProxy):
    """A service that is called at its last known address if no master answers."""

    def _get_service_uri(self, request: Any) -> str:
        """Return the address of the service; raises `rospy.ServiceException`."""
        return _located(self.resolved_name)


def call(service: str, kind: Any, *arguments: object) -> Any:
    """Return the answer of a service; raises `rospy.ServiceException`, `rospy.ROSException`, `OSError`."""
    return _Service(service, kind)(*arguments)


def _located(service: str) -> str:
    """Return the address of a service; raises `rospy.ServiceException`."""
    try:
        patience = LOOKUP if service in _addresses else REACH
        _addresses[service] = master(rospy.get_name(), patience).lookupService(service)
    except rosgraph.MasterException:
        raise rospy.ServiceException(f"no node serves {service}") from None
    except NO_ANSWER:
        if service not in _addresses:
            raise rospy.ServiceException("the ROS master does not answer") from None
    return _addresses[service]


def ask(command: Command, service: str, kind: Any, tell: Tell, *arguments: object) -> None:
    """Call a service and pass its end to `tell`; returns at once."""
    in_thread(_asked, command, service, kind, tell, arguments)


def _asked(command: Command, service: str, kind: Any, tell: Tell, arguments: Any) -> None:
    try:
        tell(answer(command, call(service, kind, *arguments)))
    except (rospy.ServiceException, rospy.ROSException, OSError) as error:
        tell(Ended(command, done=False, message=str(error)))


def answer(command: Command, reply: Any) -> Ended:
    """Return the end of a command from its reply; without a field for it (std_srvs), the code may begin the message."""
    code = str(getattr(reply, "code", ""))
    message = str(reply.message)
    if not code and not reply.success:
        first, _, rest = message.partition(" ")
        number = first.strip("():")
        code, message = (number, rest) if number.isdigit() else ("", message)
    return Ended(command, bool(reply.success), code, message)


class GoalClient:
    """An action of a layer: at most one goal of this client at a time.

    No method of actionlib is called while the lock is held, because actionlib calls back while it holds its locks.
    """

    def __init__(self, name: str, kind: Any, tell: Tell) -> None:
        self._client = actionlib.ActionClient(name, kind)
        self._tell = tell
        self._lock = threading.Lock()
        self._command: Command | None = None
        self._number = 0
        self._unheard = 0
        self._goal: Any = None
        self._cancelled = threading.Event()
        self._free = threading.Event()
        client = self._client
        self._ends = (client.pub_goal, client.pub_cancel, client.status_sub, client.feedback_sub, client.result_sub)

    @property
    def there(self) -> bool:
        """Whether a server is connected to all topics of the action."""
        return all(end.get_num_connections() for end in self._ends)

    def begin(self, command: Command) -> bool:
        """Reserve this client for a command; return False while another goal is under way."""
        with self._lock:
            if self._command is not None:
                return False
            self._command, self._goal = command, None
            self._cancelled.clear()
            self._number += 1
            self._unheard = 0
            self._free.clear()
        self._tell(Under(command))
        return True

    def go(self, message: Any) -> None:
        """Send the goal of the command that this client is reserved for, unless it was cancelled since."""
        with self._lock:
            number, cancelled = self._number, self._cancelled.is_set()
        if cancelled:
            self.end(done=False, code=CANCELLED)
            return
        goal = self._client.send_goal(message, lambda goal: self._changed(number, goal), self._come)
        with self._lock:
            if self._command is None or number != self._number:
                return
            self._goal, cancelled = goal, self._cancelled.is_set()
        if cancelled:
            goal.cancel()

    def cancel(self) -> None:
        """Cancel the goal of this client; it ends when the robot is at rest."""
        with self._lock:
            self._cancelled.set()
            goal = self._goal if self._command is not None else None
        if goal is not None:
            goal.cancel()

    def cancelled_within(self, seconds: float) -> bool:
        """Wait until the command of this client is cancelled; return False if it is not."""
        return self._cancelled.wait(seconds)

    def cancel_all(self) -> None:
        """Cancel the goals of all clients; needs no master."""
        self._client.pub_cancel.publish(GoalID())

    def end(self, *, done: bool, code: str = "", message: str = "") -> None:
        """Report the end of the goal, once."""
        with self._lock:
            command, self._command, self._goal = self._command, None, None
            self._free.set()
        if command is not None:
            self._tell(Ended(command, done, code, message))

    def check(self) -> None:
        """End a goal whose server has gone or never took it; called periodically."""
        goal = self._goal
        if goal is None:
            return
        if not self.there:
            self.end(done=False, code="1011", message="layer_gone")
        elif goal.get_comm_state() == actionlib.CommState.WAITING_FOR_GOAL_ACK:
            self._unheard += 1
            if self._unheard > MOST_UNHEARD:
                goal.cancel()
                self.end(done=False, message="no_answer")

    def wait(self, seconds: float) -> bool:
        """Wait until no goal of this client is under way; return False if one still is."""
        with self._lock:
            if self._command is None:
                return True
        return self._free.wait(seconds)

    def close(self) -> None:
        """Close the topics of the action one by one: actionlib before 1.13 has no other way."""
        for end in self._ends:
            end.unregister()

    def _come(self, _: Any, feedback: Any) -> None:
        command = self._command
        if command is not None:
            phase, share = getattr(feedback, "phase", ""), getattr(feedback, "progress", 0.0)
            self._tell(Under(command, str(phase), float(share)))

    def _changed(self, number: int, goal: Any) -> None:
        if goal.get_comm_state() != actionlib.CommState.DONE or number != self._number:
            return
        state, result = goal.get_terminal_state(), goal.get_result()
        if state in (actionlib.TerminalState.PREEMPTED, actionlib.TerminalState.RECALLED):
            self.end(done=False, code=str(getattr(result, "code", "")) or CANCELLED, message=_said(result))
        elif result is None or state == actionlib.TerminalState.LOST:
            self.end(done=False, code=LOST, message="no_answer")
        else:
            self.end(done=bool(result.success), code=str(result.code), message=_said(result))


def _said(result: Any) -> str:
    return str(getattr(result, "message", ""))
