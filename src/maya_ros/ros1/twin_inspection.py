"""What the twin's mechanics know, for whoever judges from outside: a private service of hw_simulator."""

from __future__ import annotations

import json

from maya_ros.graph.protocol import Graph, GraphHandle, Message
from maya_un.assembly import Twin

SERVICE = "~twin"
"""Answers std_srvs/Trigger; its message is one JSON object."""


def witness(graph: Graph, twin: Twin) -> GraphHandle:
    """Serve what the mechanics know: where parts are, what is carried, what fell, and the extremes of the motion.

    {"joints": [a, b, c], "point": [x, y, z], "parts": {name: [x, y, z]}, "carried": name or null, "closed": true,
    "drops": 0, "tension": 3.1, "slack": 0.0, "lowest": 0.4, "stalled": 0.0} in rad, m, s, tension in loads.
    """

    async def answer(_: Message) -> Message:
        return {"success": True, "message": json.dumps(seen(twin))}

    return graph.serve(SERVICE, "std_srvs/Trigger", answer)


def seen(twin: Twin) -> dict[str, object]:
    """Return what the mechanics know now."""
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
