"""A program in the graph of ROS 2 for `bench_ros2*.py`, by DDS alone: it calls services, serves one, or reads topics.

ros2_peer.py calls          reads "COUNT SERVICE" from stdin, and answers with the median time of a call [s]
ros2_peer.py serves         serves /bench/empty, a std_srvs/Trigger, with nothing but the library
ros2_peer.py reads COUNT    has COUNT readers of /joint_states and COUNT of /maya_position
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from statistics import median
from typing import Any

from cyclonedds.core import InstanceState, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from tests.system import ros2_peer as stranger

KINDS = (stranger.TriggerRequest, stranger.TriggerResponse)

ASKED: dict[str, tuple[tuple[Any, Any], dict[str, Any]]] = {
    "/bench/empty": (KINDS, {}),
    "/controller/recover": (KINDS, {}),
    "/maya_command": (
        (stranger.CommandRequest, stranger.CommandResponse),
        {"task": stranger.primitive({"command": "can_teleop"})},
    ),
}
"""The types of each service, and the request to it."""


LOOPBACK = (
    '<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces></General>'
    '<Discovery><ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers></Discovery>'
    "</Domain></CycloneDDS>"
)
"""Nothing leaves this machine."""


def use_loopback() -> None:
    """Give this process and its children a graph of ROS 2 that no other computer sees."""
    os.environ["CYCLONEDDS_URI"] = LOOPBACK
    os.environ["ROS_DOMAIN_ID"] = "97"


@contextmanager
def running(*what: str) -> Iterator[subprocess.Popen[str]]:
    """Run this program for the length of the block."""
    command = [sys.executable, __file__, *what]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


def calls(peer: stranger.Peer) -> None:
    """Time calls; the client waits for an answer as rmw_cyclonedds does."""
    for line in sys.stdin:
        count, service = line.split()
        kinds, request = ASKED[service]
        peer.call(service, kinds, **request)
        print(median(_timed(peer, service) for _ in range(int(count))), flush=True)


def _timed(peer: stranger.Peer, service: str) -> float:
    (kind, _), request = ASKED[service]
    writer, reader = peer.client(service)
    ready = WaitSet(peer.participant)
    ready.attach(ReadCondition(reader, SampleState.Any | ViewState.Any | InstanceState.Any))
    start = time.perf_counter()
    writer.write(kind(guid=os.getpid(), seq=0, **request))
    while not reader.take(1):
        ready.wait(duration(seconds=10))
    return time.perf_counter() - start


def serves(peer: stranger.Peer) -> None:
    """Answer each request at once."""
    requests = peer.reader("rq/bench/emptyRequest", KINDS[0], depth=100)
    topic = Topic(peer.participant, "rr/bench/emptyReply", KINDS[1])
    replies: DataWriter[Any] = DataWriter(peer.participant, topic, stranger.qos(100))
    ready = WaitSet(peer.participant)
    ready.attach(ReadCondition(requests, SampleState.Any | ViewState.Any | InstanceState.Any))
    while True:
        ready.wait(duration(seconds=10))
        for asked in requests.take(10):
            replies.write(stranger.TriggerResponse(asked.guid, asked.seq, True, ""))


def reads(peer: stranger.Peer, count: int) -> None:
    """Hold readers that take nothing: each keeps its latest message."""
    kinds = {"/joint_states": stranger.JointState, "/maya_position": stranger.Point}
    held = [peer.reader(f"rt{name}", kind, depth=1) for name, kind in kinds.items() for _ in range(count)]
    for reader in held:
        stranger.until(reader.get_matched_publications, "a writer")
    print("ready", flush=True)
    sys.stdin.read()


def main() -> None:
    """Do what the arguments say."""
    peer = stranger.Peer(int(os.environ["ROS_DOMAIN_ID"]), "")
    match sys.argv[1:]:
        case ["calls"]:
            calls(peer)
        case ["serves"]:
            serves(peer)
        case ["reads", count]:
            reads(peer, int(count))
        case _:
            raise SystemExit(__doc__)


if __name__ == "__main__":
    main()
