"""ROS' own classes and our converter make the same bytes of plain messages."""

from __future__ import annotations

import json
from collections.abc import Sequence
from random import Random
from typing import Any

import pytest

from maya_ros.graph import types
from maya_ros.graph.catalogue import ANY, SCALAR, Field, is_base, spec
from maya_ros.graph.table import TABLE, Kind
from tests.campaign import Campaign
from tests.ros.workspace import outputs_of

pytestmark = pytest.mark.system

STANDARD = (
    "std_msgs/Bool", "std_msgs/Byte", "std_msgs/Char", "std_msgs/ColorRGBA", "std_msgs/Duration", "std_msgs/Empty",
    "std_msgs/Float32", "std_msgs/Float64MultiArray", "std_msgs/Header", "std_msgs/Int8", "std_msgs/Int16",
    "std_msgs/Int64", "std_msgs/String", "std_msgs/Time", "std_msgs/UInt8MultiArray", "std_msgs/UInt16",
    "std_msgs/UInt32", "std_msgs/UInt64", "geometry_msgs/PoseWithCovarianceStamped", "sensor_msgs/Image",
    "sensor_msgs/JointState", "diagnostic_msgs/DiagnosticArray", "visualization_msgs/MarkerArray",
    "trajectory_msgs/JointTrajectory", "actionlib_msgs/GoalStatusArray",
)  # fmt: skip

_RANGES = {
    "int8": (-(2**7), 2**7), "byte": (-(2**7), 2**7), "uint8": (0, 2**8), "char": (0, 2**8),
    "int16": (-(2**15), 2**15), "uint16": (0, 2**16), "int32": (-(2**31), 2**31), "uint32": (0, 2**32),
    "int64": (-(2**63), 2**63), "uint64": (0, 2**64),
}  # fmt: skip


def in_the_table() -> list[tuple[str, str]]:
    """Return every type of the table, with the form in which it stands there."""
    found: list[tuple[str, str]] = [("message", kind) for kind in STANDARD]
    for row in TABLE:
        match row.form:
            case Kind.TOPIC:
                found.append(("message", row.type))
            case Kind.SERVICE:
                found += [("request", row.type), ("response", row.type)]
            case Kind.ACTION:
                parts = ("ActionGoal", "ActionResult", "ActionFeedback", "Goal", "Result", "Feedback")
                found += [("message", row.type + part) for part in parts]
    return sorted(set(found))


def drawn(kind: str, rng: Random) -> dict[str, Any]:
    """Return a random message of a type."""
    return {field.name: _field(field, rng) for field in spec(kind).fields}


def _field(field: Field, rng: Random) -> Any:
    if field.length == SCALAR:
        return _value(field.type, rng)
    return [_value(field.type, rng) for _ in range(rng.randrange(4) if field.length == ANY else field.length)]


def _value(kind: str, rng: Random) -> Any:
    if kind in _RANGES:
        low, beyond = _RANGES[kind]
        return rng.choice((low, beyond - 1, 0 if low else beyond // 2, rng.randrange(low, beyond)))
    if kind == "time":
        return {"secs": rng.randrange(2**32), "nsecs": rng.randrange(10**9)}
    if kind == "duration":
        return {"secs": rng.randrange(-(2**31), 2**31), "nsecs": rng.randrange(10**9)}
    if kind == "float32":
        return rng.choice((0.0, -1.5, 2.0**-20, 2.0**100))
    simple = {"bool": rng.random() < 0.5, "string": "".join(rng.choices("aé€𝄞\n '", k=3)), "float64": rng.gauss(0, 1e9)}
    return simple[kind] if is_base(kind) else drawn(kind, rng)


def known_as(form: str, kind: str) -> str:
    """Return the name of a message, which for half a service is longer."""
    return kind if form == "message" else f"{kind}{form.capitalize()}"


def converted(questions: Sequence[tuple[str, str, object]]) -> list[dict[str, Any]]:
    """Return what ROS' classes, in the Python of nodes, make of messages."""
    return outputs_of("tests.ros.converting", "".join(json.dumps(question) + "\n" for question in questions))


def test_messages_go_through_ros_unchanged(campaign: Campaign) -> None:
    cases = range(campaign.size(ci=5, long=200))
    asked = [
        (form, kind, drawn(known_as(form, kind), campaign.rng(case))) for form, kind in in_the_table() for case in cases
    ]
    answers = converted(asked)
    assert len(answers) == len(asked)
    for (form, kind, message), answer in zip(asked, answers, strict=True):
        name = known_as(form, kind)
        assert answer["bytes"] == types.serialize(name, types.conform(name, message)).hex(), name
        assert types.conform(name, answer["back"]) == types.conform(name, message), name


def test_missing_field_of_a_message_has_its_default() -> None:
    asked = [(form, kind, {}) for form, kind in in_the_table()]
    for (form, kind, _), answer in zip(asked, converted(asked), strict=True):
        assert answer["back"] == types.default(known_as(form, kind))


MISFITS: tuple[tuple[str, object], ...] = (
    ("geometry_msgs/Point", {"x": 0.0, "u": 1.0}),
    ("geometry_msgs/Point", {"x": "far"}),
    ("geometry_msgs/Point", [0.0, 0.0, 0.0]),
    ("std_msgs/UInt8", {"data": 256}),
    ("std_msgs/UInt8", {"data": 1.5}),
    ("std_msgs/String", {"data": 5}),
    ("std_msgs/Bool", {"data": "yes"}),
    ("std_msgs/Time", {"data": {"secs": -1, "nsecs": 0}}),
    ("std_msgs/UInt8MultiArray", {"data": "no base64!"}),
    ("maya_controller/RawSensorData", {"position": [1, 2]}),
    ("maya_controller/RawSensorData", {"stop_code": "AQI="}),
    ("maya_process/ProcessQueue", {"tasks": [{"command": "pick"}, {"target": {"z": None, "w": 0.0}}]}),
)


def test_invalid_message_is_refused_with_the_code_of_messages() -> None:
    asked = [("message", kind, message) for kind, message in MISFITS]
    for (kind, _), answer in zip(MISFITS, converted(asked), strict=True):
        assert answer["error"] == 4018
        assert kind in answer["sentence"]


def test_bytes_may_be_base64_as_rosbridge_writes_them_and_unknown_types_are_named() -> None:
    octets = ("message", "maya_controller/RawSensorData", {"stop_code": "AQID"})
    known, unknown = converted([octets, ("message", "maya_robot/Elephant", {})])
    assert known["back"]["stop_code"] == [1, 2, 3]
    assert unknown["error"] == 4019
