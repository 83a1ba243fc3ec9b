"""The package that users build beside their own code has the types that are on the wire."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("cyclonedds", reason="there is no DDS for this machine")

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from maya_ros.graph.table import TABLE
from maya_ros.ros2 import types
from maya_ros.ros2.names import FORMS, name_of
from tests.conventions.source import ROOT

PACKAGE = ROOT / "ros2" / "maya_interfaces"


def test_its_messages_have_the_hashes_that_are_on_the_wire() -> None:
    store = get_typestore(Stores.ROS2_JAZZY)
    files = sorted(PACKAGE.glob("msg/*.msg"))
    for file in files:
        text = file.read_text(encoding="utf-8").replace("MayaPrimitive[]", "maya_interfaces/MayaPrimitive[]")
        store.register(get_types_from_msg(text, f"maya_interfaces/msg/{file.stem}"))
    assert files
    for file in files:
        name = f"maya_interfaces/msg/{file.stem}"
        assert store.hash_rihs01(name) == types.message_type(name).hash


@pytest.mark.parametrize("form", ["msg", "srv", "action"])
def test_it_has_every_type_of_the_table(form: str) -> None:
    needed = {name_of(row.type, form) for row in TABLE if FORMS[row.form] == form}
    own = {Path(name).name for name in needed if name.startswith("maya_interfaces/")}
    assert own <= {file.stem for file in PACKAGE.glob(f"{form}/*.{form}")}


@pytest.mark.parametrize(
    ("kind", "hash_"),
    [
        ("std_msgs/String", "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"),
        ("geometry_msgs/Point", "RIHS01_6963084842a9b04494d6b2941d11444708d892da2f4b09843b9c43f42a7f6881"),
    ],
)
def test_hashes_are_those_of_jazzy(kind: str, hash_: str) -> None:
    assert types.message_type(kind).hash == hash_


def test_a_sample_has_the_bytes_of_the_specification() -> None:
    """CDR by hand (OMG DDS-XTypes 1.3, 7.4.3): encapsulation, aligned numbers, texts with their length and a zero."""
    kind = types.service_types("maya_robot/MayaCommand")[0]
    task = {"command": "pick", "target": {"x": 1.0, "y": 2.0, "z": -0.5}, "open": True}
    sample = kind.sample({"task": task})
    sample.__dict__.update(guid=7, seq=-1)
    by_hand = (
        bytes.fromhex("00010000")
        + (7).to_bytes(8, "little")
        + (-1).to_bytes(8, "little", signed=True)
        + bytes.fromhex("05000000 7069636b 00 00000000000000")  # "pick", and padding to a multiple of 8
        + bytes.fromhex("000000000000f03f 0000000000000040 000000000000e0bf 01")
    )
    assert sample.serialize(use_version_2=False).rstrip(b"\0") == by_hand
    assert kind.message(kind.cls.deserialize(by_hand + b"\0\0\0")) == {"task": task}


def test_what_only_ros_2_has_gets_its_default() -> None:
    kind = types.message_type("visualization_msgs/MarkerArray")
    assert kind.sample({"markers": [{"id": 3}]}).markers[0].mesh_file.filename == ""
