"""The graph recorded by rosbag, and read again without ROS."""

from __future__ import annotations

from pathlib import Path

import pytest
from rosbags.rosbag1 import Reader

from tests.ros.harness import Ros

TOPICS = ("/maya_event", "/maya_position", "/joint_states")


def listened_to_by(ros: Ros, name: str) -> set[str]:
    """Return the topics that a node whose name begins so subscribes."""
    listeners = ros.ask_master("getSystemState")[1]
    return {topic for topic, nodes in listeners if any(node.startswith(name) for node in nodes)}


@pytest.mark.waits("12 s of homing at twenty times real speed, as rosbag lives in real time")
@pytest.mark.timeout(240)
def test_bag_holds_the_published_messages(ros: Ros, tmp_path: Path) -> None:
    ros.launch("maya_robot", "robot.launch")
    ros.until_nodes("/robot_controller", "/hw_simulator")
    bag = tmp_path / "graph.bag"
    recorder = ros.start("rosbag", "record", "-O", str(bag), *TOPICS)
    ros.until(lambda: listened_to_by(ros, "/record") == set(TOPICS), "a recorder that listens")
    driver = ros.driver()
    events = driver.subscribe("/maya_event", "std_msgs/String")
    events.until(lambda said: said["data"].startswith("not_homed"))
    assert driver.call("/maya_command", {"task": {"command": "home"}}, within=120.0)["success"]
    driver.subscribe("/maya_position", "geometry_msgs/Point").until()
    assert recorder.end() == 0
    with Reader(bag) as reader:
        counts = {connection.topic: connection.msgcount for connection in reader.connections}
        words = [bytes(raw[4:]).partition(b" ")[0] for at, _, raw in reader.messages() if at.topic == "/maya_event"]
    assert counts.keys() == set(TOPICS)
    assert min(counts.values()) > 0
    assert {b"not_homed", b"homing", b"homed"} <= set(words)
