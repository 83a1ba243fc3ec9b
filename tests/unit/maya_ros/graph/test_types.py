"""Messages completed and checked, compared with ROS for the same types."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from maya_ros.graph import types
from maya_ros.graph.catalogue import Field, is_base, spec
from maya_ros.graph.table import TABLE, Kind
from maya_ros.graph.validation import INTEGERS
from maya_un.errors import InvalidMessage, UnknownInterface
from tests.unit.maya_ros.graph import golden_md5 as golden

JOINT_STATE = {
    "header": {"seq": 7, "stamp": {"secs": 12, "nsecs": 345}, "frame_id": "base é"},
    "name": ["a", "b"],
    "position": [0.5, -1.25],
    "effort": [math.inf],
}
DIAGNOSTICS = {
    "status": [{"level": 2, "name": "n", "message": "m", "hardware_id": "h", "values": [{"key": "k", "value": "v"}]}]
}
POINT = "geometry_msgs/Point"
RAW = "maya_controller/RawSensorData"


@pytest.mark.parametrize("kind", golden.MESSAGES)
def test_sums_of_messages_are_those_of_ros(kind: str) -> None:
    assert types.md5sum(kind) == golden.MESSAGES[kind]


@pytest.mark.parametrize("service", golden.SERVICES)
def test_sums_of_services_are_those_of_ros(service: str) -> None:
    assert types.service_md5sum(service) == golden.SERVICES[service]


def test_every_type_of_the_table_is_known() -> None:
    for row in TABLE:
        match row.form:
            case Kind.TOPIC:
                assert types.known(row.type)
            case Kind.SERVICE:
                assert all(map(types.known, types.halves(row.type)))
            case Kind.ACTION:
                assert types.action_of(row.type + "ActionGoal") == row.type


def test_every_type_has_a_message_that_says_nothing_and_conforms() -> None:
    for kind in types.kinds():
        nothing = types.default(kind)
        assert types.conform(kind, nothing) == nothing
        assert types.conform(kind, {}) == nothing
        assert tuple(nothing) == types.fields(kind)


def test_missing_fields_are_completed_in_a_copy_of_the_message() -> None:
    given_ = {"command": "pick", "target": {"x": 1}}
    whole = types.conform("maya_robot/MayaPrimitive", given_)
    assert whole == {"command": "pick", "target": {"x": 1.0, "y": 0.0, "z": 0.0}, "open": False}
    assert given_ == {"command": "pick", "target": {"x": 1}}
    assert types.conform(RAW, {})["position"] == [0, 0, 0]


def test_defaults_are_not_shared() -> None:
    types.default(RAW)["position"].append(1)
    types.default("geometry_msgs/PointStamped")["point"]["x"] = 7.0
    assert types.default(RAW)["position"] == [0, 0, 0]
    assert types.default("geometry_msgs/PointStamped")["point"]["x"] == 0.0


def test_null_is_nan_for_a_number_with_a_point() -> None:
    assert math.isnan(types.conform(POINT, {"x": None})["x"])
    assert math.isnan(types.conform("sensor_msgs/JointState", {"position": [1.0, None]})["position"][1])


def test_bytes_may_come_as_base64_or_as_bytes() -> None:
    for data in ("AQID", b"\x01\x02\x03", [1, 2, 3]):
        assert types.conform(RAW, {"stop_code": data})["stop_code"] == [1, 2, 3]


def test_times_carry_their_nanoseconds_over() -> None:
    assert types.conform("std_msgs/Time", {"data": {"secs": 1, "nsecs": 2_500_000_000}})["data"] == {
        "secs": 3,
        "nsecs": 500_000_000,
    }
    assert types.conform("std_msgs/Duration", {"data": {"nsecs": -1}})["data"] == {"secs": -1, "nsecs": 999_999_999}


def test_header_without_a_time_gets_one_from_the_clock() -> None:
    now = {"secs": 5, "nsecs": 6}
    assert types.conform("sensor_msgs/JointState", {}, stamp=now)["header"]["stamp"] == now
    told = {"header": {"stamp": {"secs": 1, "nsecs": 0}}}
    assert types.conform("sensor_msgs/JointState", told, stamp=now)["header"]["stamp"] == {"secs": 1, "nsecs": 0}
    assert types.conform(POINT, {}, stamp=now) == {"x": 0.0, "y": 0.0, "z": 0.0}


def test_now_is_a_time_only_with_a_clock() -> None:
    now = {"secs": 5, "nsecs": 6}
    assert types.conform("std_msgs/Time", {"data": "now"}, stamp=now) == {"data": now}
    for kind, said in (("std_msgs/Time", None), ("std_msgs/Duration", now)):
        with pytest.raises(InvalidMessage):
            types.conform(kind, {"data": "now"}, stamp=said)


def test_ros_2_names_of_a_time_are_understood_but_not_mixed() -> None:
    assert types.conform("std_msgs/Duration", {"data": {"sec": -1, "nanosec": 2}}) == {"data": {"secs": -1, "nsecs": 2}}
    with pytest.raises(InvalidMessage):
        types.conform("std_msgs/Time", {"data": {"secs": 1, "nanosec": 2}})


@pytest.mark.parametrize(
    ("kind", "data", "path"),
    [
        (POINT, [1.0, 2.0, 3.0], POINT),
        (POINT, None, POINT),
        (POINT, {"x": "1"}, f"x of {POINT}"),
        (POINT, {"x": True}, f"x of {POINT}"),
        (POINT, {"x": 10**400}, f"x of {POINT}"),
        (POINT, {"w": 1.0}, f"w of {POINT}"),
        ("std_msgs/String", {"data": 1}, "data of std_msgs/String"),
        ("std_msgs/String", {"data": None}, "data of std_msgs/String"),
        ("std_msgs/String", {"data": "\ud800"}, "data of std_msgs/String"),
        ("std_msgs/Bool", {"data": 1}, "data of std_msgs/Bool"),
        ("std_msgs/UInt8", {"data": 256}, "data of std_msgs/UInt8"),
        ("std_msgs/UInt8", {"data": -1}, "data of std_msgs/UInt8"),
        ("std_msgs/Int64", {"data": 2**63}, "data of std_msgs/Int64"),
        ("std_msgs/Int32", {"data": 1.0}, "data of std_msgs/Int32"),
        ("std_msgs/Int32", {"data": True}, "data of std_msgs/Int32"),
        ("std_msgs/Float32", {"data": 1e39}, "data of std_msgs/Float32"),
        ("std_msgs/Time", {"data": 1.5}, "data of std_msgs/Time"),
        ("std_msgs/Time", {"data": {"secs": -1}}, "data of std_msgs/Time"),
        ("std_msgs/Time", {"data": {"sec": 1, "nsecs": 2}}, "data of std_msgs/Time"),
        (RAW, {"position": [1, 2]}, f"position of {RAW}"),
        (RAW, {"moving": [True, False, 1]}, f"moving[2] of {RAW}"),
        (RAW, {"stop_code": "not base64!"}, f"stop_code of {RAW}"),
        (RAW, {"velocity": "AQID"}, f"velocity of {RAW}"),
        (
            "maya_process/ProcessQueue",
            {"tasks": [{}, {"target": {"z": []}}]},
            "tasks[1].target.z of maya_process/ProcessQueue",
        ),
        (
            "trajectory_msgs/JointTrajectory",
            {"points": [{"positions": [0.0, "x"]}]},
            "points[0].positions[1] of trajectory_msgs/JointTrajectory",
        ),
    ],
)
def test_invalid_field_is_refused_with_its_path(kind: str, data: object, path: str) -> None:
    with pytest.raises(InvalidMessage) as refused:
        types.conform(kind, data)
    assert refused.value.details["name"] == path


@pytest.mark.parametrize("kind", ["", "Point", "time", "geometry_msgs/Pint", "../x", "std_srvs/SetBool"])
def test_unknown_type_is_reported(kind: str) -> None:
    assert not types.known(kind) or is_base(kind)
    with pytest.raises(UnknownInterface):
        types.conform(kind, {})


def test_ros_2_writes_names_of_types_otherwise() -> None:
    assert types.conform("geometry_msgs/msg/Point", {"x": 1.0})["x"] == 1.0


def test_bytes_on_the_wire_are_those_of_ros() -> None:
    whole = types.conform("sensor_msgs/JointState", JOINT_STATE)
    assert types.serialize("sensor_msgs/JointState", whole).hex() == golden.JOINT_STATE
    diagnostics = types.conform("diagnostic_msgs/DiagnosticArray", DIAGNOSTICS)
    assert types.serialize("diagnostic_msgs/DiagnosticArray", diagnostics).hex() == golden.DIAGNOSTICS


def test_the_definition_of_a_type_holds_those_within_it() -> None:
    text = types.text("maya_process/ProcessQueue")
    parsed = get_types_from_msg(text.split("=" * 80)[0], "maya_process/msg/ProcessQueue")
    assert parsed["maya_process/msg/ProcessQueue"][1][0][0] == "tasks"
    assert text.count("MSG: ") == 2
    assert "string PICK=pick\n" in text
    assert types.service_text("std_srvs/SetBool") == "bool data\n---\nbool success\nstring message\n"


def test_details_are_those_of_rosapi() -> None:
    first, header, point, time = types.details("geometry_msgs/PointStamped")
    assert first == {
        "type": "geometry_msgs/PointStamped",
        "fieldnames": ["header", "point"],
        "fieldtypes": ["std_msgs/Header", "geometry_msgs/Point"],
        "fieldarraylen": [-1, -1],
        "examples": ["{}", "{}"],
        "constnames": [],
        "constvalues": [],
    }
    assert header["examples"] == ["0", "{}", ""]
    assert point["examples"] == ["0.0", "0.0", "0.0"]
    assert (time["type"], time["fieldnames"]) == ("time", ["secs", "nsecs"])
    (raw, *_) = types.details(RAW)
    assert raw["fieldarraylen"][:2] == [-1, 3]
    (primitive, *_) = types.details("maya_robot/MayaPrimitive")
    assert dict(zip(primitive["constnames"], primitive["constvalues"], strict=True))["PICK"] == "pick"
    for told in types.details("visualization_msgs/MarkerArray"):
        assert types.conform("rosapi/TypeDef", told) == told


def test_only_messages_to_an_action_are_of_an_action() -> None:
    assert types.action_of("maya_controller/HomeActionGoal") == "maya_controller/Home"
    assert types.action_of("std_msgs/String") == ""
    assert types.action_of("maya_controller/HomeGoal") == ""


# Every value of a type, drawn by its specification.

TEXT = st.text(max_size=8)
KINDS = st.sampled_from([kind for kind in types.kinds() if "/" in kind and "Interactive" not in kind])


def of_base(kind: str) -> st.SearchStrategy[Any]:
    if kind in INTEGERS:
        return st.integers(*INTEGERS[kind])
    return {
        "bool": st.booleans(),
        "string": TEXT,
        "float64": st.floats(allow_nan=False),
        "float32": st.floats(allow_nan=False, width=32),
        "time": st.fixed_dictionaries({"secs": st.integers(0, 2**32 - 1), "nsecs": st.integers(0, 999_999_999)}),
        "duration": st.fixed_dictionaries(
            {"secs": st.integers(-(2**31), 2**31 - 1), "nsecs": st.integers(0, 10**9 - 1)}
        ),
    }[kind]


def of_field(field: Field) -> st.SearchStrategy[Any]:
    one = of_base(field.type) if is_base(field.type) else messages(field.type)
    if field.length < 0:
        return one
    return st.lists(one, min_size=field.length, max_size=field.length or 2)


def messages(kind: str) -> st.SearchStrategy[dict[str, Any]]:
    return st.fixed_dictionaries({field.name: of_field(field) for field in spec(kind).fields})


@given(st.data())
def test_valid_message_is_unchanged_and_ros_reads_it_from_the_wire(data: st.DataObject) -> None:
    kind = data.draw(KINDS)
    message = data.draw(messages(kind))
    whole = types.conform(kind, message)
    assert whole == message
    package, name = kind.split("/")
    if f"{package}/msg/{name}" in STORE.fielddefs and types.fields(kind):
        read = STORE.deserialize_ros1(types.serialize(kind, whole), f"{package}/msg/{name}")
        assert bytes(STORE.serialize_ros1(read, f"{package}/msg/{name}")) == types.serialize(kind, whole)


STORE = get_typestore(Stores.ROS1_NOETIC)

JUNK = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | TEXT,
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(TEXT | st.sampled_from(["x", "header", "data"]), inner, max_size=3)
    ),
    max_leaves=10,
)


@given(st.data())
def test_anything_else_is_refused_with_a_code_and_never_half_taken(data: st.DataObject) -> None:
    kind = data.draw(KINDS)
    message = data.draw(messages(kind))
    if message:
        message[data.draw(st.sampled_from(sorted(message)))] = data.draw(JUNK)
    try:
        whole = types.conform(kind, message)
    except InvalidMessage:
        return
    assert types.conform(kind, whole) == whole or "nan" in repr(whole)
    types.serialize(kind, whole)
