"""The frames for /tf: for random poses and machines, they are those that the description has by its own rules."""

from __future__ import annotations

from functools import cache

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from maya_ros.graph.protocol import Message, header
from maya_ros.graph.urdf import BASE, NAMES, describe
from maya_ros.ros2.model import FrameTree
from maya_un.config import Config
from maya_un.kinematics import Floats
from tests.description import Tree
from tests.strategies import configuration

OTHER = configuration(geometry={"height": 2.6, "length": 2.0, "delta": 0.25, "gripper_height": 0.3})


@cache
def read(other: bool) -> tuple[FrameTree, Tree]:
    text = describe(OTHER if other else Config())
    return FrameTree(text), Tree(text)


def matrix(message: Message) -> Floats:
    """Return a geometry_msgs/TransformStamped as a homogeneous transform."""
    made = np.eye(4)
    turn, place = (message["transform"][part] for part in ("rotation", "translation"))
    made[:3, :3] = Rotation.from_quat([turn[axis] for axis in "xyzw"]).as_matrix()
    made[:3, 3] = [place[axis] for axis in "xyz"]
    return made


@given(other=st.booleans(), values=st.tuples(*(st.floats(-3.0, 3.0) for _ in NAMES)))
def test_every_frame_is_where_the_description_has_it(other: bool, values: tuple[float, ...]) -> None:
    frames, tree = read(other)
    state = {"header": header(1.5), "name": list(NAMES), "position": list(values)}
    moving, fixed = frames.moving(state)["transforms"], frames.fixed({"secs": 0, "nsecs": 0})["transforms"]
    above = {one["child_frame_id"]: one for one in (*moving, *fixed)}
    assert above.keys() == set(tree.links) - {BASE}
    assert all(one["header"]["stamp"] == {"secs": 1, "nsecs": 500_000_000} for one in moving)
    for link in tree.links:
        found, at = np.eye(4), link
        while at != BASE:
            found, at = matrix(above[at]) @ found, above[at]["header"]["frame_id"]
        np.testing.assert_allclose(found, tree.frame(link, dict(zip(NAMES, values, strict=True))), atol=1e-9)
