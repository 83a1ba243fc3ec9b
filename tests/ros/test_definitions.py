"""catkin's results for the definitions are those of this project over the wire."""

from __future__ import annotations

import json
import re

import pytest

from maya_ros.graph import types
from maya_ros.graph.catalogue import halves, kinds, services
from maya_ros.graph.table import TABLE, Kind
from tests.ros.harness import Ros
from tests.ros.workspace import Workspace, python, run

CLASSES = """
import json, roslib.message, sys
wanted = json.loads(sys.argv[1])
def told(kind):
    return None if kind is None else [kind._md5sum, getattr(kind, "_full_text", "")]
print(json.dumps({
    "messages": {name: told(roslib.message.get_message_class(name)) for name in wanted["messages"]},
    "services": {name: told(roslib.message.get_service_class(name)) for name in wanted["services"]},
}))
"""
OURS = ("maya_controller/", "maya_robot/", "maya_process/")


@pytest.fixture(scope="module")
def classes(workspace: Workspace) -> dict[str, dict[str, tuple[str, str]]]:
    """Return md5 sum and whole text of catkin's classes, by form and type."""
    actions = {f"{row.type}{part}" for row in TABLE if row.form is Kind.ACTION for part in ("Action", "ActionGoal")}
    topics = {row.type for row in TABLE if row.form is Kind.TOPIC}
    parts_of_services = {half for service in services() for half in halves(service)}
    ours = {kind for kind in kinds() if kind.startswith(OURS)} - parts_of_services
    wanted = {
        "messages": sorted(topics | actions | ours),
        "services": sorted({row.type for row in TABLE if row.form is Kind.SERVICE}),
    }
    return json.loads(run([str(python()), "-c", CLASSES, json.dumps(wanted)], workspace.place, workspace.environment()))


def test_every_message_has_a_class_with_our_sum(classes: dict[str, dict[str, tuple[str, str]]]) -> None:
    made = {kind: definition_of and definition_of[0] for kind, definition_of in classes["messages"].items()}
    assert {"maya_controller/RawSensorData", "maya_robot/TaskActionFeedback", "maya_process/ProcessQueue"} <= set(made)
    assert made == {kind: types.md5sum(kind) for kind in made}


def test_every_service_has_a_class_with_our_sum(classes: dict[str, dict[str, tuple[str, str]]]) -> None:
    made = {service: definition_of and definition_of[0] for service, definition_of in classes["services"].items()}
    assert made == {service: types.service_md5sum(service) for service in made}
    assert set(made) <= set(services())


def bare(text: str) -> dict[str, list[str]]:
    """Return the fields of a whole text, in order behind the constants, by the type they make up.

    Comments, and packages before types, are left out.
    """
    fields: dict[str, list[str]] = {}
    own = ""
    for line in text.splitlines():
        words = re.sub(r"\s*=\s*", "=", line.partition("#")[0]).split()
        if words[:1] == ["MSG:"]:
            own = words[1]
        elif words and set(line) != {"="}:
            fields.setdefault(own, []).append(" ".join([words[0].rpartition("/")[2], *words[1:]]))
    return {own: sorted(lines, key=lambda line: line if "=" in line else "~") for own, lines in fields.items()}


def test_bag_holds_our_definitions(classes: dict[str, dict[str, tuple[str, str]]]) -> None:
    """A reader of a bag without our packages uses the text in it."""
    ours = {
        kind: bare(definition_of[1]) for kind, definition_of in classes["messages"].items() if kind.startswith(OURS)
    }
    assert ours == {kind: bare(types.text(kind)) for kind in ours}


def test_the_tools_show_our_types(ros: Ros) -> None:
    shown = ros.tool("rosmsg", "show", "-r", "maya_robot/MayaPrimitive")
    assert "geometry_msgs/Point target" in shown
    assert "bool success" in ros.tool("rossrv", "show", "maya_robot/MayaCommand")
