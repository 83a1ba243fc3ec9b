"""A stranger in a ROS 2 graph: a program with Cyclone DDS and types written by hand, without a line of Maya.

It reads one JSON command a line and answers with one JSON line:
    {"do": "command", "task": {"command": "home"}}      {"do": "trigger", "service": NAME}      {"do": "graph"}
    {"do": "last", "topic": NAME, "type": TYPE}         {"do": "send", "task": {...}}           and more: see `Commands`
"""

import itertools
import json
import os
import random
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

from cyclonedds._clayer import ddspy_write
from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription
from cyclonedds.core import InstanceState, ReadCondition, SampleState, ViewState
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct, make_idl_struct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import array, float32, float64, int8, int32, int64, sequence, uint8, uint16, uint32, uint64
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

NEVER = threading.Event()
PATIENCE = 60.0
"""Longest wait for anything [s]."""


JOINTS = "FollowJointTrajectory"


def _name(kind: str, form: str, own: str) -> str:
    return f"{kind}.{form}.dds_.{own}_"


@final
@dataclass
class String(IdlStruct, typename=_name("std_msgs", "msg", "String")):
    data: str


@final
@dataclass
class Point(IdlStruct, typename=_name("geometry_msgs", "msg", "Point")):
    x: float64
    y: float64
    z: float64


@final
@dataclass
class Time(IdlStruct, typename=_name("builtin_interfaces", "msg", "Time")):
    sec: int32
    nanosec: uint32


@final
@dataclass
class Uuid(IdlStruct, typename=_name("unique_identifier_msgs", "msg", "UUID")):
    uuid: array[uint8, 16]


@final
@dataclass
class Primitive(IdlStruct, typename=_name("maya_interfaces", "msg", "MayaPrimitive")):
    command: str
    target: Point
    open: bool


@final
@dataclass
class TriggerRequest(IdlStruct, typename=_name("std_srvs", "srv", "Trigger_Request")):
    guid: uint64
    seq: int64
    structure_needs_at_least_one_member: uint8 = 0


@final
@dataclass
class TriggerResponse(IdlStruct, typename=_name("std_srvs", "srv", "Trigger_Response")):
    guid: uint64
    seq: int64
    success: bool
    message: str


@final
@dataclass
class CommandRequest(IdlStruct, typename=_name("maya_interfaces", "srv", "MayaCommand_Request")):
    guid: uint64
    seq: int64
    task: Primitive


@final
@dataclass
class CommandResponse(IdlStruct, typename=_name("maya_interfaces", "srv", "MayaCommand_Response")):
    guid: uint64
    seq: int64
    success: bool
    code: str
    message: str


@final
@dataclass
class TaskGoal(IdlStruct, typename=_name("maya_interfaces", "action", "Task_Goal")):
    task: Primitive


@final
@dataclass
class TaskResult(IdlStruct, typename=_name("maya_interfaces", "action", "Task_Result")):
    success: bool
    code: str
    message: str


@final
@dataclass
class TaskFeedback(IdlStruct, typename=_name("maya_interfaces", "action", "Task_Feedback")):
    phase: str
    progress: float32
    position: Point


@final
@dataclass
class SendRequest(IdlStruct, typename=_name("maya_interfaces", "action", "Task_SendGoal_Request")):
    guid: uint64
    seq: int64
    goal_id: Uuid
    goal: TaskGoal


@final
@dataclass
class SendResponse(IdlStruct, typename=_name("maya_interfaces", "action", "Task_SendGoal_Response")):
    guid: uint64
    seq: int64
    accepted: bool
    stamp: Time


@final
@dataclass
class ResultRequest(IdlStruct, typename=_name("maya_interfaces", "action", "Task_GetResult_Request")):
    guid: uint64
    seq: int64
    goal_id: Uuid


@final
@dataclass
class ResultResponse(IdlStruct, typename=_name("maya_interfaces", "action", "Task_GetResult_Response")):
    guid: uint64
    seq: int64
    status: int8
    result: TaskResult


@final
@dataclass
class GoalInfo(IdlStruct, typename=_name("action_msgs", "msg", "GoalInfo")):
    goal_id: Uuid
    stamp: Time


@final
@dataclass
class CancelRequest(IdlStruct, typename=_name("action_msgs", "srv", "CancelGoal_Request")):
    guid: uint64
    seq: int64
    goal_info: GoalInfo


@final
@dataclass
class CancelResponse(IdlStruct, typename=_name("action_msgs", "srv", "CancelGoal_Response")):
    guid: uint64
    seq: int64
    return_code: int8
    goals_canceling: sequence[GoalInfo]


@final
@dataclass
class FeedbackMessage(IdlStruct, typename=_name("maya_interfaces", "action", "Task_FeedbackMessage")):
    goal_id: Uuid
    feedback: TaskFeedback


@final
@dataclass
class Gid(IdlStruct, typename=_name("rmw_dds_common", "msg", "Gid")):
    data: array[uint8, 16]


@final
@dataclass
class NodeEntities(IdlStruct, typename=_name("rmw_dds_common", "msg", "NodeEntitiesInfo")):
    node_namespace: str
    node_name: str
    reader_gid_seq: sequence[Gid]
    writer_gid_seq: sequence[Gid]


@final
@dataclass
class ParticipantEntities(IdlStruct, typename=_name("rmw_dds_common", "msg", "ParticipantEntitiesInfo")):
    gid: Gid
    node_entities_info_seq: sequence[NodeEntities]


@final
@dataclass
class Duration(IdlStruct, typename=_name("builtin_interfaces", "msg", "Duration")):
    sec: int32
    nanosec: uint32


@final
@dataclass
class Header(IdlStruct, typename=_name("std_msgs", "msg", "Header")):
    stamp: Time
    frame_id: str


@final
@dataclass
class Vector3(IdlStruct, typename=_name("geometry_msgs", "msg", "Vector3")):
    x: float64
    y: float64
    z: float64


@final
@dataclass
class Quaternion(IdlStruct, typename=_name("geometry_msgs", "msg", "Quaternion")):
    x: float64
    y: float64
    z: float64
    w: float64


@final
@dataclass
class Transform(IdlStruct, typename=_name("geometry_msgs", "msg", "Transform")):
    translation: Vector3
    rotation: Quaternion


@final
@dataclass
class TransformStamped(IdlStruct, typename=_name("geometry_msgs", "msg", "TransformStamped")):
    header: Header
    child_frame_id: str
    transform: Transform


@final
@dataclass
class TFMessage(IdlStruct, typename=_name("tf2_msgs", "msg", "TFMessage")):
    transforms: sequence[TransformStamped]


@final
@dataclass
class JointState(IdlStruct, typename=_name("sensor_msgs", "msg", "JointState")):
    header: Header
    name: sequence[str]
    position: sequence[float64]
    velocity: sequence[float64]
    effort: sequence[float64]


@final
@dataclass
class Clock(IdlStruct, typename=_name("rosgraph_msgs", "msg", "Clock")):
    clock: Time


@final
@dataclass
class Log(IdlStruct, typename=_name("rcl_interfaces", "msg", "Log")):
    stamp: Time
    level: uint8
    name: str
    msg: str
    file: str
    function: str
    line: uint32


@final
@dataclass
class Twist(IdlStruct, typename=_name("geometry_msgs", "msg", "Twist")):
    linear: Vector3
    angular: Vector3


@final
@dataclass
class TrajectoryPoint(IdlStruct, typename=_name("trajectory_msgs", "msg", "JointTrajectoryPoint")):
    positions: sequence[float64]
    velocities: sequence[float64]
    accelerations: sequence[float64]
    effort: sequence[float64]
    time_from_start: Duration


@final
@dataclass
class Trajectory(IdlStruct, typename=_name("trajectory_msgs", "msg", "JointTrajectory")):
    header: Header
    joint_names: sequence[str]
    points: sequence[TrajectoryPoint]


@final
@dataclass
class MultiPoint(IdlStruct, typename=_name("trajectory_msgs", "msg", "MultiDOFJointTrajectoryPoint")):
    transforms: sequence[Transform]
    velocities: sequence[Twist]
    accelerations: sequence[Twist]
    time_from_start: Duration


@final
@dataclass
class MultiTrajectory(IdlStruct, typename=_name("trajectory_msgs", "msg", "MultiDOFJointTrajectory")):
    header: Header
    joint_names: sequence[str]
    points: sequence[MultiPoint]


@final
@dataclass
class Tolerance(IdlStruct, typename=_name("control_msgs", "msg", "JointTolerance")):
    name: str
    position: float64
    velocity: float64
    acceleration: float64


@final
@dataclass
class ComponentTolerance(IdlStruct, typename=_name("control_msgs", "msg", "JointComponentTolerance")):
    joint_name: str
    component: uint16
    position: float64
    velocity: float64
    acceleration: float64


@final
@dataclass
class JointsGoal(IdlStruct, typename=_name("control_msgs", "action", f"{JOINTS}_Goal")):
    trajectory: Trajectory
    multi_dof_trajectory: MultiTrajectory
    path_tolerance: sequence[Tolerance]
    component_path_tolerance: sequence[ComponentTolerance]
    goal_tolerance: sequence[Tolerance]
    component_goal_tolerance: sequence[ComponentTolerance]
    goal_time_tolerance: Duration


@final
@dataclass
class JointsResult(IdlStruct, typename=_name("control_msgs", "action", f"{JOINTS}_Result")):
    error_code: int32
    error_string: str


@final
@dataclass
class JointsSendRequest(IdlStruct, typename=_name("control_msgs", "action", f"{JOINTS}_SendGoal_Request")):
    guid: uint64
    seq: int64
    goal_id: Uuid
    goal: JointsGoal


@final
@dataclass
class JointsSendResponse(IdlStruct, typename=_name("control_msgs", "action", f"{JOINTS}_SendGoal_Response")):
    guid: uint64
    seq: int64
    accepted: bool
    stamp: Time


@final
@dataclass
class JointsResultRequest(IdlStruct, typename=_name("control_msgs", "action", f"{JOINTS}_GetResult_Request")):
    guid: uint64
    seq: int64
    goal_id: Uuid


@final
@dataclass
class JointsResultResponse(IdlStruct, typename=_name("control_msgs", "action", f"{JOINTS}_GetResult_Response")):
    guid: uint64
    seq: int64
    status: int8
    result: JointsResult


@final
@dataclass
class ParameterValue(IdlStruct, typename=_name("rcl_interfaces", "msg", "ParameterValue")):
    type: uint8
    bool_value: bool
    integer_value: int64
    double_value: float64
    string_value: str
    byte_array_value: sequence[uint8]
    bool_array_value: sequence[bool]
    integer_array_value: sequence[int64]
    double_array_value: sequence[float64]
    string_array_value: sequence[str]


@final
@dataclass
class Parameter(IdlStruct, typename=_name("rcl_interfaces", "msg", "Parameter")):
    name: str
    value: ParameterValue


@final
@dataclass
class ListResult(IdlStruct, typename=_name("rcl_interfaces", "msg", "ListParametersResult")):
    names: sequence[str]
    prefixes: sequence[str]


@final
@dataclass
class SetResult(IdlStruct, typename=_name("rcl_interfaces", "msg", "SetParametersResult")):
    successful: bool
    reason: str


@final
@dataclass
class ListRequest(IdlStruct, typename=_name("rcl_interfaces", "srv", "ListParameters_Request")):
    guid: uint64
    seq: int64
    prefixes: sequence[str]
    depth: uint64


@final
@dataclass
class ListResponse(IdlStruct, typename=_name("rcl_interfaces", "srv", "ListParameters_Response")):
    guid: uint64
    seq: int64
    result: ListResult


@final
@dataclass
class GetRequest(IdlStruct, typename=_name("rcl_interfaces", "srv", "GetParameters_Request")):
    guid: uint64
    seq: int64
    names: sequence[str]


@final
@dataclass
class GetResponse(IdlStruct, typename=_name("rcl_interfaces", "srv", "GetParameters_Response")):
    guid: uint64
    seq: int64
    values: sequence[ParameterValue]


@final
@dataclass
class SetRequest(IdlStruct, typename=_name("rcl_interfaces", "srv", "SetParameters_Request")):
    guid: uint64
    seq: int64
    parameters: sequence[Parameter]


@final
@dataclass
class SetResponse(IdlStruct, typename=_name("rcl_interfaces", "srv", "SetParameters_Response")):
    guid: uint64
    seq: int64
    results: sequence[SetResult]


TYPES: dict[str, Any] = {
    "tf2_msgs/TFMessage": TFMessage,
    "sensor_msgs/JointState": JointState,
    "rosgraph_msgs/Clock": Clock,
    "rcl_interfaces/Log": Log,
    "std_msgs/String": String,
    "geometry_msgs/Point": Point,
    "maya_interfaces/MayaPrimitive": Primitive,
    "std_srvs/Trigger": (TriggerRequest, TriggerResponse),
    "maya_interfaces/MayaCommand": (CommandRequest, CommandResponse),
}

_RELIABLE = Policy.Reliability.Reliable(100_000_000)
_WIRE = Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False)


def qos(depth: int, *, late: bool = False) -> Qos:
    """Return the quality that rmw_cyclonedds uses by default."""
    kept = Policy.Durability.TransientLocal if late else Policy.Durability.Volatile
    return Qos(_RELIABLE, kept, Policy.History.KeepLast(depth), _WIRE)


def until(fact: Callable[[], Any], what: str) -> Any:
    """Return the first true value of `fact`."""
    end = time.monotonic() + PATIENCE
    while not (found := fact()):
        if time.monotonic() > end:
            raise TimeoutError(what)
        NEVER.wait(0.002)
    return found


class Peer:
    """A participant, with clients of services as they are needed."""

    def __init__(self, domain: int, namespace: str) -> None:
        self.participant = DomainParticipant(domain)
        self._namespace = namespace
        self._numbers = itertools.count(1)
        self._clients: dict[str, tuple[DataWriter[Any], DataReader[Any]]] = {}
        self._readers: dict[str, DataReader[Any]] = {}
        self._answers: dict[tuple[str, int], Any] = {}
        self._goals: dict[str, Any] = {}
        self.discovered = self.reader("ros_discovery_info", ParticipantEntities, late=True, depth=100)
        self._alive = ReadCondition(self.discovered, SampleState.Any | ViewState.Any | InstanceState.Alive)
        self.readers = BuiltinDataReader(self.participant, BuiltinTopicDcpsSubscription)
        self.writers = BuiltinDataReader(self.participant, BuiltinTopicDcpsPublication)

    def alive(self) -> list[Any]:
        """Return what the participants that are alive say of their nodes."""
        return self.discovered.read(100, condition=self._alive)

    def reader(self, topic: str, kind: Any, *, late: bool = False, depth: int = 10) -> DataReader[Any]:
        return DataReader(self.participant, Topic(self.participant, topic, kind), qos(depth, late=late))

    def client(self, service: str) -> tuple[DataWriter[Any], DataReader[Any]]:
        """Return the writer and the reader of a service that was called."""
        return self._clients[service]

    def call(self, service: str, kinds: tuple[Any, Any], **request: Any) -> Any:
        """Call a service, and return its response."""
        return self.answer(service, self.send(service, kinds, **request))

    def send(self, service: str, kinds: tuple[Any, Any], **request: Any) -> int:
        """Send a request as soon as the service is matched on both sides, and return its number."""
        if service not in self._clients:
            asked, answered = kinds
            topic = Topic(self.participant, f"rq{self._namespace}{service}Request", asked)
            reader = self.reader(f"rr{self._namespace}{service}Reply", answered, depth=100)
            self._clients[service] = (DataWriter(self.participant, topic, qos(10)), reader)
        writer, reader = self._clients[service]
        until(
            lambda: writer.get_matched_subscriptions() and reader.get_matched_publications(), f"a server of {service}"
        )
        number = next(self._numbers)
        writer.write(kinds[0](guid=os.getpid(), seq=number, **request))
        return number

    def answer(self, service: str, number: int) -> Any:
        """Wait for the response to a request, and return it; a second response to any request is an error."""
        _, reader = self._clients[service]

        def taken() -> Any:
            for one in reader.take(100):
                if one.guid == os.getpid():
                    if (service, one.seq) in self._answers:
                        raise ValueError(f"{service} has answered request {one.seq} twice")
                    self._answers[service, one.seq] = one
            return self._answers.get((service, number))

        return until(taken, f"an answer of {service}")


def uuid_of(number: int) -> Uuid:
    numbers: Any = list(number.to_bytes(16, "big"))
    return Uuid(numbers)


def primitive(values: dict[str, Any]) -> Primitive:
    return Primitive(values["command"], Point(*values.get("target", (0.0, 0.0, 0.0))), values.get("open", False))


JOINTS_ACTION = "/controller/follow_joint_trajectory"

NO_VALUE: dict[str, Any] = {
    "type": 0, "bool_value": False, "integer_value": 0, "double_value": 0.0, "string_value": "",
    "byte_array_value": [], "bool_array_value": [], "integer_array_value": [], "double_array_value": [],
    "string_array_value": [],
}  # fmt: skip


def duration(seconds: float) -> Duration:
    return Duration(int(seconds // 1), round(seconds % 1 * 1e9))


def joints_goal(
    points: list[Any],
    names: str = "abc",
    path: dict[str, float] | None = None,
    end: dict[str, float] | None = None,
    delay: float = 0.0,
    start: float = 0.0,
) -> JointsGoal:
    """Return a goal: tolerances by joint of the path and of the end, and the allowed delay [s]."""
    begun = duration(start)
    head, nobody = Header(Time(begun.sec, begun.nanosec), ""), Header(Time(0, 0), "")
    none: Any = []
    rows: Any = [TrajectoryPoint(point[1:], none, none, none, duration(point[0])) for point in points]
    joints: Any = list(names)
    paths: Any
    ends: Any
    paths, ends = ([Tolerance(name, most, 0.0, 0.0) for name, most in (one or {}).items()] for one in (path, end))
    nothing = MultiTrajectory(nobody, none, none)
    return JointsGoal(Trajectory(head, joints, rows), nothing, paths, none, ends, none, duration(delay))


class Commands:
    """The commands that a line on stdin may name."""

    def __init__(self, peer: Peer) -> None:
        self.peer = peer
        self.ids = itertools.count(1)
        self._last: dict[str, DataReader[Any]] = {}
        self._all: dict[str, DataReader[Any]] = {}
        self._writers: list[DataWriter[Any]] = []
        self._publishers: dict[str, DataWriter[Any]] = {}

    def trigger(self, service: str) -> Any:
        answer = self.peer.call(service, (TriggerRequest, TriggerResponse))
        return {"success": answer.success, "message": answer.message}

    def command(self, task: dict[str, Any]) -> Any:
        return self.command_result(**self.begin_command(task))

    def begin_command(self, task: dict[str, Any]) -> Any:
        """Send a request, and return its number without waiting for the response."""
        kinds = (CommandRequest, CommandResponse)
        return {"number": self.peer.send("/maya_command", kinds, task=primitive(task))}

    def command_result(self, number: int) -> Any:
        answer = self.peer.answer("/maya_command", number)
        return {"success": answer.success, "code": answer.code, "message": answer.message}

    def send(self, task: dict[str, Any]) -> Any:
        number = next(self.ids)
        goal_id = uuid_of(number)
        answer = self.peer.call(
            "/task/_action/send_goal", (SendRequest, SendResponse), goal_id=goal_id, goal=TaskGoal(primitive(task))
        )
        return {"accepted": answer.accepted, "id": number}

    def send_joints(self, points: list[Any], **given: Any) -> Any:
        """Send a trajectory of points (time, a, b, c), and return the number of the goal."""
        number = next(self.ids)
        goal = joints_goal(points, **given)
        kinds = (JointsSendRequest, JointsSendResponse)
        answer = self.peer.call(f"{JOINTS_ACTION}/_action/send_goal", kinds, goal_id=uuid_of(number), goal=goal)
        return {"accepted": answer.accepted, "id": number}

    def joints_result(self, id: int) -> Any:
        kinds = (JointsResultRequest, JointsResultResponse)
        answer = self.peer.call(f"{JOINTS_ACTION}/_action/get_result", kinds, goal_id=uuid_of(id))
        return {"status": answer.status, **asdict(answer.result)}

    def list_parameters(self, prefixes: list[str], depth: int = 0) -> Any:
        kinds = (ListRequest, ListResponse)
        answer = self.peer.call("/maya/list_parameters", kinds, prefixes=prefixes, depth=depth)
        return asdict(answer.result)

    def get_parameters(self, names: list[str]) -> Any:
        answer = self.peer.call("/maya/get_parameters", (GetRequest, GetResponse), names=names)
        return [asdict(value) for value in answer.values]

    def set_parameter(self, name: str, type: int, **value: Any) -> Any:
        given: dict[str, Any] = {**NO_VALUE, "type": type, **value}
        whole = ParameterValue(**given)
        parameters: Any = [Parameter(name, whole)]
        answer = self.peer.call("/maya/set_parameters", (SetRequest, SetResponse), parameters=parameters)
        return asdict(answer.results[0])

    def all(self, topic: str, type: str, late: bool = False) -> Any:
        """Return the messages on a topic since the last call; the first call only begins to read."""
        if topic not in self._all:
            self._all[topic] = self.peer.reader(f"rt{topic}", TYPES[type], late=late, depth=10_000)
            until(self._all[topic].get_matched_publications, f"a writer of {topic}")
        return [asdict(one) for one in self._all[topic].take(10_000)]

    def result(self, id: int) -> Any:
        goal_id = uuid_of(id)
        answer = self.peer.call("/task/_action/get_result", (ResultRequest, ResultResponse), goal_id=goal_id)
        return {"status": answer.status, **asdict(answer.result)}

    def cancel(self, id: int, action: str = "/task") -> Any:
        info = GoalInfo(uuid_of(id), Time(0, 0))
        answer = self.peer.call(f"{action}/_action/cancel_goal", (CancelRequest, CancelResponse), goal_info=info)
        return {"code": answer.return_code, "canceling": len(answer.goals_canceling)}

    def last(self, topic: str, type: str, late: bool = False) -> Any:
        if topic not in self._last:
            self._last[topic] = self.peer.reader(f"rt{topic}", TYPES[type], late=late, depth=1)
        (found,) = until(lambda: self._last[topic].read(1), f"a message on {topic}")
        return asdict(found)

    def publish(self, topic: str, task: dict[str, Any]) -> Any:
        if topic not in self._publishers:  # a message dies with its writer
            kind = Topic(self.peer.participant, f"rt{topic}", Primitive)
            self._publishers[topic] = DataWriter(self.peer.participant, kind, qos(10))
        until(self._publishers[topic].get_matched_subscriptions, f"a reader of {topic}")
        self._publishers[topic].write(primitive(task))
        return {}

    def junk(self, topic: str, count: int, seed: int) -> Any:
        """Send payloads that are no messages, as far as the library sends them; return how many it sent."""
        rng = random.Random(seed)
        writer = DataWriter(self.peer.participant, Topic(self.peer.participant, f"rt{topic}", Primitive), qos(count))
        self._writers.append(writer)
        until(writer.get_matched_subscriptions, f"a reader of {topic}")
        whole = Primitive("home", Point(0.0, 0.0, 0.0), False).serialize(use_version_2=False)
        sent = 0
        for number in range(count):
            junk = (
                whole.replace(b"home", bytes(rng.randrange(128, 256) for _ in range(4))),  # no UTF-8
                whole[:4] + rng.randbytes(rng.randrange(60)),
                whole[: 4 + rng.randrange(len(whole) - 8)],
            )[number % 3]
            sent += ddspy_write(writer._ref, junk.ljust((len(junk) + 3) & ~3, b"\0")) == 0
        return {"sent": sent}

    def impostor(self, topic: str, count: int) -> Any:
        """Write messages whose type has the right name and other members; return how many readers have matched."""
        kind: Any = make_idl_struct(
            "MayaPrimitive_", _name("maya_interfaces", "msg", "MayaPrimitive"), {"number": uint64}
        )
        writer = DataWriter(self.peer.participant, Topic(self.peer.participant, f"rt{topic}", kind), qos(count))
        self._writers.append(writer)
        for number in range(count):
            writer.write(kind(number=number))
        return {"matched": len(writer.get_matched_subscriptions())}

    def graph(self, within: float = 0.0) -> Any:
        """Return the nodes, and every endpoint of others with its type and user data, in `within` seconds if any."""
        if within:
            NEVER.wait(within)
        alive = self.peer.alive()
        found = alive if within else until(self.peer.alive, "nodes")
        gids: dict[str, list[str]] = {}
        for one in found:
            for node in one.node_entities_info_seq:
                ends = [bytes(gid.data).hex() for gid in (*node.reader_gid_seq, *node.writer_gid_seq)]
                gids[f"{node.node_namespace.rstrip('/')}/{node.node_name}"] = ends
        found_ends: dict[str, Any] = {}
        for form, builtin in (("reader", self.peer.readers), ("writer", self.peer.writers)):
            for end in builtin.read(1000):
                if end.qos is None:
                    continue  # it has gone
                data = end.qos[Policy.Userdata].data.decode() if Policy.Userdata in end.qos else ""
                if end.participant_key != self.peer.participant.guid:
                    kept = end.qos[Policy.Durability] == Policy.Durability.TransientLocal
                    sure = isinstance(end.qos[Policy.Reliability], Policy.Reliability.Reliable)
                    found_ends[end.key.bytes.hex()] = [form, end.topic_name, end.type_name, data, sure, kept]
        return {"nodes": gids, "ends": found_ends}


def main() -> None:
    """Obey until stdin ends."""
    peer = Peer(int(os.environ["ROS_DOMAIN_ID"]), sys.argv[1] if len(sys.argv) > 1 else "")
    commands = Commands(peer)
    for line in sys.stdin:
        asked = json.loads(line)
        try:
            said = getattr(commands, asked.pop("do"))(**asked)
        except Exception as error:  # noqa: BLE001 - the test fails with it
            said = {"error": repr(error)}
        print(json.dumps(said), flush=True)


if __name__ == "__main__":
    main()
