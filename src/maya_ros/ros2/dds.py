"""Nodes and endpoints of a ROS 2 graph on DDS, in the form that rmw_cyclonedds gives them.

ROS 2 has conventions on top of DDS: prefixes of topics (rt, rq, rr), type names, user data with the type hash, and the
topic ros_discovery_info, which tells which endpoints belong to which node. See REP 2011 and REP 2016, and
design/topic_and_service_names of ROS 2.

Two threads write, one for topics and one for replies, and one reads. So no slow reader of a topic delays a reply, and
nothing of DDS runs in the loop of the robot.
"""

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from cyclonedds.core import DDSException, GuardCondition, InstanceState, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.domain import DomainParticipant
from cyclonedds.internal import InvalidSample
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from maya_ros.ros2.names import SERVICE, Quality
from maya_ros.ros2.types import SampleType, message_type

_log = logging.getLogger("maya_ros.ros2")

DISCOVERY = "ros_discovery_info"
IN_TURN = 10
"""Most samples that one reader gives before the next one has its turn: no topic may delay a stop."""

_BLOCKED = duration(milliseconds=100)
"""Longest time for which a writer waits for a reader that acknowledges nothing."""

_COMMON = (Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False),)
_OURS = Policy.WriterDataLifecycle(autodispose=False)


def _qos(quality: Quality, user_data: str) -> Qos:
    """Return the policies of an endpoint with this user data."""
    return Qos(
        Policy.Reliability.Reliable(_BLOCKED),
        Policy.Durability.TransientLocal if quality.late else Policy.Durability.Volatile,
        Policy.History.KeepLast(quality.depth),
        Policy.Userdata(user_data.encode()),
        *_COMMON,
    )


def _writing_qos(quality: Quality, user_data: str) -> Qos:
    """Return the policies of a writer: without those of the durability service, later readers get one message."""
    kept = Policy.DurabilityService(0, Policy.History.KeepLast(quality.depth), -1, -1, -1)
    return _qos(quality, user_data) + (Qos(_OURS, kept) if quality.late else Qos(_OURS))


@dataclass(slots=True)
class Counts:
    """Numbers of messages that were not delivered: malformed ones, and those that a full queue displaced."""

    malformed: int = 0
    displaced: int = 0
    unsent: int = 0


class Outbox:
    """A thread that writes. Each writer has a queue; if it is full, a new message displaces the oldest one."""

    def __init__(self, name: str, counts: Counts) -> None:
        self._counts = counts
        self._waiting: deque[SampleWriter] = deque()
        self._changed = threading.Condition()
        self._ended = False
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def put(self, writer: SampleWriter, work: Callable[[], Any]) -> None:
        """Queue a sample, which `work` makes in the thread."""
        with self._changed:
            if len(writer.queue) == writer.queue.maxlen:
                self._counts.displaced += 1
                writer.queue.popleft()
            else:
                self._waiting.append(writer)
            writer.queue.append(work)
            self._changed.notify()

    @property
    def thread(self) -> int | None:
        """The thread that writes."""
        return self._thread.ident

    def close(self) -> None:
        """Write what is queued, and end the thread."""
        with self._changed:
            self._ended = True
            self._changed.notify()
        self._thread.join()

    def _run(self) -> None:
        while True:
            with self._changed:
                while not self._waiting and not self._ended:
                    self._changed.wait()
                if not self._waiting:
                    return
                writer = self._waiting.popleft()
                work = writer.queue.popleft()
            try:
                if writer.wanted:
                    writer.write(work())
            except DDSException:
                self._counts.unsent += 1
            except Exception:  # noqa: BLE001 - the thread must live on for the other writers
                self._counts.unsent += 1
                _log.exception("a message on %s was not sent", writer.name)


class SampleWriter:
    """A writer of samples, through an outbox."""

    def __init__(self, name: str, kind: SampleType, raw: DataWriter[Any], outbox: Outbox, quality: Quality) -> None:
        self.name = name
        self.queue: deque[Callable[[], Any]] = deque(maxlen=max(1, quality.depth))
        self._late = quality.late
        self._kind = kind
        self._raw = raw
        self._outbox = outbox

    def send(self, message: Mapping[str, Any], **header: int) -> None:
        """Queue a message of the graph; `header` is that of a reply. The message must not change afterwards."""

        def made() -> Any:
            sample = self._kind.sample(message)
            sample.__dict__.update(header)
            return sample

        self._outbox.put(self, made)

    def send_made(self, make: Callable[[], Mapping[str, Any]]) -> None:
        """Queue a message that `make` returns in the writing thread."""
        self._outbox.put(self, lambda: self._kind.sample(make()))

    def writes_in(self, thread: int | None) -> bool:
        """Return whether this writer writes in a thread."""
        return self._outbox.thread == thread

    @property
    def wanted(self) -> bool:
        """Whether somebody reads, or a later reader gets what is written now; else no sample need be made."""
        return self._late or self.read

    @property
    def read(self) -> bool:
        """Whether somebody reads now."""
        try:
            return bool(self._raw.get_matched_subscriptions())
        except IndexError:  # another reader came while the library asked for the number and then for the list
            return True

    def write(self, sample: Any) -> None:
        """Write a sample at once."""
        self._raw.write(sample)


@dataclass(slots=True)
class _Node:
    readers: list[bytes] = field(default_factory=list[bytes])
    writers: list[bytes] = field(default_factory=list[bytes])


class DdsGraph:
    """The part of a ROS 2 graph that this process holds: nodes with their endpoints in one namespace and domain.

    A name that `remappings` has is replaced: by a name in the namespace, or by a whole one that begins with a slash.
    Endpoints may be added at any time; `announce` follows. The reading thread calls what hears a sample.
    """

    def __init__(self, domain: int, namespace: str = "", remappings: Mapping[str, str] | None = None) -> None:
        self.counts = Counts()
        self._remappings = remappings or {}
        self._namespace = "/" + namespace.strip("/")
        self._nodes: dict[str, _Node] = {}
        self._heard: list[tuple[DataReader[Any], ReadCondition, Callable[[Any], None]]] = []
        self._participant = DomainParticipant(domain, Qos(Policy.Userdata(b"enclave=/;")))
        self._topics: dict[str, Topic[Any]] = {}
        self._writers: list[DataWriter[Any]] = []  # a writer that nobody holds leaves the graph
        self._news = Outbox("DDS topics", self.counts)
        self._replies = Outbox("DDS replies", self.counts)
        self._guard = GuardCondition(self._participant)
        self._wait = WaitSet(self._participant)
        self._wait.attach(self._guard)
        self._reading = threading.Thread(target=self._read, name="DDS reading", daemon=True)
        info = message_type("rmw_dds_common/msg/ParticipantEntitiesInfo")
        qos = _writing_qos(Quality(1, late=True), f"typehash={info.hash};")
        self._info = DataWriter(self._participant, Topic(self._participant, DISCOVERY, info.cls), qos)
        self._described = info

    def publisher(self, node: str, topic: str, kind: SampleType, quality: Quality) -> SampleWriter:
        """Add a publisher of a topic to a node."""
        return self._writer(node, f"rt{self._whole(topic)}", kind, quality, self._news, "")

    def subscription(
        self, node: str, topic: str, kind: SampleType, quality: Quality, heard: Callable[[Any], None]
    ) -> None:
        """Add a subscription to a node; `heard` gets each sample, in the reading thread."""
        self._reader(node, f"rt{self._whole(topic)}", kind, quality, heard, "")

    def service(
        self, node: str, name: str, kinds: tuple[SampleType, SampleType], heard: Callable[[Any], None]
    ) -> SampleWriter:
        """Add a service to a node, and return the writer of its replies; `heard` gets each request."""
        request, response = kinds
        whole = self._whole(name)
        writer = self._writer(node, f"rr{whole}Reply", response, SERVICE, self._replies, _service_id(whole))
        self._reader(node, f"rq{whole}Request", request, SERVICE, heard, _service_id(whole))
        return writer

    def start(self) -> None:
        """Begin to read."""
        self._reading.start()

    def announce(self) -> None:
        """Tell the graph which nodes there are, with their endpoints."""
        gid = self._participant.guid.bytes
        nodes = [
            {
                "node_namespace": self._namespace,
                "node_name": name,
                "reader_gid_seq": [{"data": list(one)} for one in node.readers],
                "writer_gid_seq": [{"data": list(one)} for one in node.writers],
            }
            for name, node in self._nodes.items()
        ]
        self._info.write(self._described.sample({"gid": {"data": list(gid)}, "node_entities_info_seq": nodes}))

    def close(self) -> None:
        """Take no more samples, write what is queued, and leave the graph: its nodes vanish at once."""
        self._guard.set(True)
        if self._reading.is_alive():
            self._reading.join()
        self._news.close()
        self._replies.close()
        self._participant.__del__()  # the library deletes an entity, with all that belongs to it, in no other way

    def _whole(self, name: str) -> str:
        own, inner, part = name.partition("/_action/")
        found = self._remappings.get(own, own.strip("/"))
        whole = found if found.startswith("/") else f"{self._namespace.rstrip('/')}/{found}"
        return f"{whole}{inner}{part}"

    def _topic(self, name: str, kind: SampleType) -> Topic[Any]:
        if name not in self._topics:
            self._topics[name] = Topic(self._participant, name, kind.cls)
        return self._topics[name]

    def _writer(
        self, node: str, topic: str, kind: SampleType, quality: Quality, outbox: Outbox, also: str
    ) -> SampleWriter:
        qos = _writing_qos(quality, f"typehash={kind.hash};{also}")
        raw = DataWriter[Any](self._participant, self._topic(topic, kind), qos)
        self._nodes.setdefault(node, _Node()).writers.append(raw.guid.bytes)
        self._writers.append(raw)
        return SampleWriter(topic, kind, raw, outbox, quality)

    def _reader(
        self, node: str, topic: str, kind: SampleType, quality: Quality, heard: Callable[[Any], None], also: str
    ) -> None:
        raw = DataReader[Any](
            self._participant, self._topic(topic, kind), _qos(quality, f"typehash={kind.hash};{also}")
        )
        self._nodes.setdefault(node, _Node()).readers.append(raw.guid.bytes)
        ready = ReadCondition(raw, SampleState.Any | ViewState.Any | InstanceState.Any)
        self._heard.append((raw, ready, heard))
        self._wait.attach(ready)

    def _read(self) -> None:
        """Take samples one by one, so that a malformed one disturbs no other."""
        while True:
            self._wait.wait(duration(infinite=True))
            if self._guard.read():
                return
            for reader, ready, heard in self._heard:
                for _ in range(IN_TURN):
                    if not ready.triggered:
                        break
                    self._take(reader, heard)

    def _take(self, reader: DataReader[Any], heard: Callable[[Any], None]) -> None:
        try:
            for sample in reader.take(1):
                if not isinstance(sample, InvalidSample):
                    heard(sample)
        except Exception as error:  # noqa: BLE001 - whatever a stranger sends, the next sample is read
            self.counts.malformed += 1
            _log.warning("a malformed sample on %s: %r", reader.topic.name, error)


def _service_id(name: str) -> str:
    """Return what tells that two endpoints are one service; any text that no other service has."""
    return "serviceid=" + ".".join(f"{byte:x}" for byte in name.encode()[:16].ljust(16, b"\0")) + ";"
