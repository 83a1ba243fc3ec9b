"""A ROS node that takes orders: JSON lines in, JSON lines out. `driver_client.Driver` is the other side.

It runs under the Python of nodes and uses nothing of this project, so that what it sees is what ROS sees.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from threading import Condition, Lock, Thread
from typing import Any

import actionlib
import genpy
import rosgraph
import roslib.message
import rospy
import rosservice
import rostopic
import tf2_ros
from actionlib import ActionClient
from actionlib_msgs.msg import GoalStatus

PATIENCE = 30.0
"""Longest wait for a service, an action's server or a topic's reader [s]."""
ATTEMPTS = 3
"""Attempts to reach an action's server or a topic's readers within that time."""

_telling = Lock()
_publishers: dict[str, _Publisher] = {}
_subscribers: list[Any] = []
_clients: dict[str, ActionClient] = {}
_goals: dict[str, Any] = {}
_frames: list[Any] = []


def main() -> None:
    """Obey the standard input until it closes."""
    rospy.init_node("driver", anonymous=True, disable_signals=True)
    _tell({"ready": rospy.get_name()})
    for line in sys.stdin:
        Thread(target=_serve, args=(json.loads(line),), daemon=True).start()
    rospy.signal_shutdown("nothing more to do")


def _serve(request: dict[str, Any]) -> None:
    number = request.pop("id")
    try:
        _tell({"id": number, "value": OPERATIONS[request.pop("op")](**request)})
    except Exception as error:  # noqa: BLE001 - whatever it is, the test is told
        _tell({"id": number, "error": f"{type(error).__name__}: {error}"})


def _tell(what: dict[str, Any]) -> None:
    with _telling:  # in one write: ROS' log lines must not come between a line and its end
        sys.stdout.write(f"{json.dumps(what)}\n")
        sys.stdout.flush()


def subscribe(topic: str, type: str) -> None:
    """Listen to a topic."""
    kind = _topic_class(topic, type)
    _subscribers.append(
        rospy.Subscriber(topic, kind, lambda message: _tell({"topic": topic, "message": plain(message)}))
    )


def _topic_class(topic: str, name: str) -> Any:
    kind = _message_class(name) if name else rostopic.get_topic_class(topic, blocking=True)[0]
    if kind is None:
        raise LookupError(f"no type for {topic}")
    return kind


class _Publisher(rospy.SubscribeListener):
    """A topic to publish on, that knows how many listen."""

    def __init__(self, topic: str, kind: Any, latch: bool) -> None:
        self._kind = kind
        self._news = Condition()
        self._readers = 0
        self._publisher = rospy.Publisher(topic, kind, self, queue_size=100, latch=latch)

    def peer_subscribe(self, topic_name: str, topic_publish: object, peer_publish: object) -> None:
        """Count one more."""
        with self._news:
            self._readers += 1
            self._news.notify_all()

    def publish(self, message: dict[str, Any], readers: int) -> None:
        """Publish when so many listen.

        The master tells subscribers of a new publisher once. On a busy machine this may fail, and nobody repeats it, so
        register again, which makes the master tell them once more.
        """
        for _ in range(ATTEMPTS):
            with self._news:
                if self._news.wait_for(lambda: self._readers >= readers, PATIENCE / ATTEMPTS):
                    break
            rosgraph.Master(rospy.get_name()).registerPublisher(
                self._publisher.resolved_name, self._publisher.type, rospy.get_node_uri()
            )
        else:
            raise LookupError(f"{self._readers} listen to {self._publisher.name}, not {readers}")
        self._publisher.publish(_filled(self._kind(), message))


def publish(topic: str, type: str, message: dict[str, Any], readers: int, latch: bool) -> None:
    """Publish a message."""
    if topic not in _publishers:
        _publishers[topic] = _Publisher(topic, _message_class(type), latch)
    _publishers[topic].publish(message, readers)


def call(service: str, request: dict[str, Any]) -> dict[str, Any]:
    """Call a service."""
    rospy.wait_for_service(service, PATIENCE)
    kind = rosservice.get_service_class_by_name(service)
    return plain(rospy.ServiceProxy(service, kind)(_filled(kind._request_class(), request)))


def goal(goal: str, action: str, type: str, message: dict[str, Any]) -> None:
    """Send a goal to an action."""
    client = _connected_client(action, type)
    filled = _filled(_message_class(f"{type}Goal")(), message)
    _goals[goal] = client.send_goal(filled, _when_it_changes(goal), _when_it_goes_on(goal))


def _connected_client(action: str, type: str) -> ActionClient:
    """Return a client that is connected to the action's server; raises `LookupError` if there is none.

    rospy matches dead connections by file descriptor (`_TopicImpl.check`), without a lock. If a killed server is
    started again, rospy may close the new connection for the old one, and does not connect again. So register again
    after a while, as a person does who restarts the program.
    """
    for _ in range(ATTEMPTS):
        if action not in _clients:
            _clients[action] = ActionClient(action, _message_class(f"{type}Action"))
        if _clients[action].wait_for_server(rospy.Duration.from_sec(PATIENCE / ATTEMPTS)):
            return _clients[action]
        _clients.pop(action).stop()
    raise LookupError(f"no node serves {action}")


def _when_it_goes_on(name: str) -> Callable[[Any, Any], None]:
    return lambda _, feedback: _tell({"goal": name, "what": "feedback", "message": plain(feedback)})


def _when_it_changes(name: str) -> Callable[[Any], None]:
    def changed(handle: Any) -> None:
        state, text = handle.get_goal_status(), handle.get_goal_status_text()
        _tell({"goal": name, "what": "status", "message": {"state": state, "text": text}})
        if handle.get_comm_state() == actionlib.CommState.DONE:
            result = handle.get_result()
            told = {} if result is None else plain(result)
            outcome = GoalStatus.LOST if result is None else handle.get_terminal_state()
            _tell({"goal": name, "what": "ended", "outcome": outcome, "result": told})

    return changed


def cancel(goal: str) -> None:
    """Ask for the end of a goal."""
    _goals[goal].cancel()


def transform(target: str, source: str, secs: int, nsecs: int) -> list[float]:
    """Return where the origin of a frame was in another one, and its rotation, at a time that tf has heard of."""
    if not _frames:
        buffer = tf2_ros.Buffer(rospy.Duration.from_sec(120.0))
        _frames.extend((buffer, tf2_ros.TransformListener(buffer)))
    wait = rospy.Duration.from_sec(PATIENCE)
    found = _frames[0].lookup_transform(target, source, rospy.Time(secs, nsecs), wait).transform
    at, turned = found.translation, found.rotation
    return [at.x, at.y, at.z, turned.x, turned.y, turned.z, turned.w]


def set_param(name: str, value: Any) -> None:
    """Set a parameter."""
    rospy.set_param(name, value)


def _message_class(name: str) -> Any:
    kind = roslib.message.get_message_class(name)
    if kind is None:
        raise LookupError(f"no type {name}")
    return kind


def _filled(message: Any, fields: dict[str, Any]) -> Any:
    genpy.message.fill_message_args(message, [fields] if fields else [])
    return message


def plain(value: Any) -> Any:
    """Return a message as plain data."""
    if isinstance(value, genpy.Message):
        return {name: plain(getattr(value, name)) for name in value.__slots__}
    if isinstance(value, genpy.Time | genpy.Duration):
        return {"secs": value.secs, "nsecs": value.nsecs}
    if isinstance(value, bytes):
        return list(value)
    return [plain(item) for item in value] if isinstance(value, list | tuple) else value


OPERATIONS: dict[str, Callable[..., Any]] = {
    "subscribe": subscribe, "publish": publish, "call": call, "goal": goal, "cancel": cancel, "set_param": set_param,
    "transform": transform,
}  # fmt: skip

if __name__ == "__main__":
    main()
