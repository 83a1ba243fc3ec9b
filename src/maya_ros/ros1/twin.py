"""The twin in a graph: parts on its table from parameters, and a private service that shows its mechanics."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from maya_ros.graph.protocol import Graph, GraphHandle, Message
from maya_un.assembly.controller import Twin
from maya_un.config import Config, default_path
from maya_un.errors import InvalidValue
from maya_un.kinematics.mechanism import Mechanism
from maya_un.process.spec.job import load_job
from maya_un.process.spec.poses import PoseStore
from maya_un.process.spec.tasks import starting_parts
from maya_un.values import Point


def parts_on_table(config: Config, job: str, parts: Any) -> dict[str, Point]:
    """Return the positions of parts [m]: those at the start of the job file `job` ("" for none), and `parts`.

    `parts` is {NAME: [x, y, z]}. Raises `FileUnreadable`, `InvalidJob` and `InvalidValue`.
    """
    standing: dict[str, Point] = {}
    if job:
        store = PoseStore(Mechanism.of(config), default_path().with_name("poses.toml"))
        standing.update(starting_parts(load_job(Path(job)), config.cell.grasp_height, store.taught))
    if not isinstance(parts, Mapping):
        raise InvalidValue(key="parts", value=parts, reason="it must be a table of names and places")
    standing.update({str(name): _place(name, place) for name, place in parts.items()})
    return standing


def _place(name: object, place: Any) -> Point:
    try:
        x, y, z = place
        return Point(float(x), float(y), float(z))
    except (TypeError, ValueError):
        raise InvalidValue(key=f"parts/{name}", value=place, reason="a place is [x, y, z] in m") from None


SERVICE = "~twin"
"""Answers std_srvs/Trigger; its message is one JSON object."""


def serve_inspection(graph: Graph, twin: Twin) -> GraphHandle:
    """Serve the state of the mechanics: parts, the carried part, dropped parts, and the extremes of the motion.

    {"joints": [a, b, c], "point": [x, y, z], "parts": {name: [x, y, z]}, "carried": name or null, "closed": true,
    "drops": 0, "tension": 3.1, "slack": 0.0, "lowest": 0.4, "stalled": 0.0} in rad, m, s, tension in loads.
    """

    async def answer(_: Message) -> Message:
        return {"success": True, "message": json.dumps(inspect_twin(twin))}

    return graph.serve(SERVICE, "std_srvs/Trigger", answer)


def inspect_twin(twin: Twin) -> dict[str, object]:
    """Return the present state of the mechanics."""
    record = twin.mechanics.record
    whole = record.whole
    return {
        "joints": list(twin.mechanics.true_joints()),
        "point": list(twin.mechanics.gripper_point()),
        "parts": {name: list(place) for name, place in record.parts.items()},
        "carried": record.carried,
        "closed": record.gripper_closed,
        "drops": len(whole.drops),
        "tension": whole.tension,
        "slack": whole.slack,
        "lowest": whole.lowest,
        "stalled": whole.stall_time,
    }
