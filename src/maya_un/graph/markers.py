"""/maya_markers: what rviz shows beside the model, as visualization_msgs/MarkerArray.

The lines coloured by their tension, the parts where they are known, the path under way, the workspace, the zones, and a
word where something is not as it should be. Markers carry no time, so rviz draws them by the newest frames; a part in
the gripper is tied to the gripper's frame and moves without a message. So only the lines are told while they move.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from maya_un.graph.protocol import Message
from maya_un.graph.shapes import LINE_LIST, Colour, Key, blended, key, line_list, plain_marker, removed, text
from maya_un.graph.surroundings import standing_part, way_markers, workspace_markers, zone_markers
from maya_un.graph.drawn import BASE, GRIPPER
from maya_un.kinematics.mechanism import Mechanism
from maya_un.kinematics.statics import tension
from maya_un.kinematics.workspace import Workspace
from maya_un.values import Joints, Mode, Point, State
