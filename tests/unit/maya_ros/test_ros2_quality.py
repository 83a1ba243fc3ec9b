"""The quality of service of topics and services on DDS."""

from __future__ import annotations

import pytest

pytest.importorskip("cyclonedds", reason="there is no DDS for this machine")

from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from maya_ros.graph.table import EVENT, JOINTS, QUEUE_STATUS
from maya_ros.ros2.dds import _qos, _writing_qos
from maya_ros.ros2.names import quality
from maya_ros.ros2.types import message_type
from tests.system.strangers import LOOPBACK, own_domain


def test_writer_keeps_as_many_messages_for_late_readers_as_its_history_has() -> None:
    kept = Policy.DurabilityService(0, Policy.History.KeepLast(QUEUE_STATUS.queue_size), -1, -1, -1)
    assert _writing_qos(quality(QUEUE_STATUS), "x;")[Policy.DurabilityService] == kept
    assert Policy.DurabilityService not in _writing_qos(quality(JOINTS), "x;")


def test_late_reader_gets_the_history_of_a_topic(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    kind, kept = message_type(EVENT.type), quality(EVENT)
    domain = own_domain()
    one, other = DomainParticipant(domain), DomainParticipant(domain)
    writer = DataWriter(one, Topic(one, "rt/late", kind.cls), _writing_qos(kept, "x;"))
    for number in range(5):
        writer.write(kind.sample({"data": str(number)}))
    reader = DataReader(other, Topic(other, "rt/late", kind.cls), _qos(kept, "y;"))
    got: list[str] = []
    while len(got) < 5:
        got += [sample.data for sample in reader.take(10)]
    assert got == ["0", "1", "2", "3", "4"]
    for participant in (one, other):
        participant.__del__()
