"""The page of docs that lists the graph, with the types of its messages; `gen_docs.py` writes it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import maya_ros.graph
from maya_ros.graph import types
from maya_ros.graph.events import REFUSED, words
from maya_ros.graph.goals import KEPT, PERIOD
from maya_ros.graph.servers.sensors import DRAWING_RATE
from maya_ros.graph.servers.tasks import FEEDBACK_RATE
from maya_ros.graph.table import PROGRAM, ROS2_TABLE, TABLE, Kind, Row
from maya_ros.ros2.names import FORMS, PARAMETER_SERVICES, SERVICE, name_of, quality

DEFINITIONS = Path(maya_ros.graph.__file__).parent / "definitions"
SUFFIXES = {"msg": "Message", "srv": "Service", "action": "Action"}
MANUAL = {
    "connected", "disconnected", "not_homed", "homing", "homed", "moving", "idle", "stopped", "gripper_open",
    "gripper_closed", "limit", "fault", "estop",
}  # fmt: skip

INTRODUCTION = """\
# The graph

The graph has the names, types and fields of the manual's chapter Communications, and some more. In ROS, `roslaunch
maya_process process.launch` starts it; without ROS, `maya up --rosbridge` serves it to rosbridge clients, and `maya up
--ros2` to ROS 2. Units are SI: m, rad, s. All behave the same, because one table in the code defines all names.

If users exist, a client needs a [role](roles.md) that includes the operation of the name.
"""

MORE = f"""
In ROS 1, robot_state_publisher makes /tf from `/joint_states` and the parameter `robot_description`. Rosbridge alone
has neither: to draw the robot, set the joints of [its description](../explanation/the-model.md) by `/joint_states`.
Markers are published on change, at most {DRAWING_RATE:g} times a second, and in full to each new subscriber.
A queue holds a number of messages for one reader; beyond that the oldest are dropped. Rates are in the reader's time,
even if the twin's clock runs faster.
"""

RULES = f"""\
## Who waits and who refuses

One goal or call runs at a time. A second one is refused with code 2104, and the first continues. `/send_task` and
`/start_queue` put tasks into the queue, which waits for direct goals and calls. A refused message of a topic is logged
and shown in `/diagnostics` ("last refused"); for `/controller/command` and `/controller/speed` it is published on
`/maya_event`, with the word `{REFUSED}`.

Every result carries `code` and `message`: a [code](errors.md) and its sentence, both empty on success. The std_srvs
services have no field for it: where `success` is false, `message` is the code, a colon, a space and the sentence.
`/controller/stop` and `/controller/pause` answer with an object: `{{"was_moving":true,
"duration":0.8,"distance":[0.1,0.0,0.0]}}`, the time [s] and the distance (rad, m, m) to rest.

## Actions

They are actions of ROS 1 (actionlib), with five topics each: `X/goal`, `X/cancel`, `X/status`, `X/feedback`,
`X/result`.

| a goal is | when |
|---|---|
| PENDING | it has arrived and nothing has begun; a motion waits here while motion is paused |
| ACTIVE | from its first feedback on, when something begins |
| REJECTED | it was refused, and nothing has moved |
| PREEMPTED | it was cancelled (code 2202) or somebody stopped the robot (2201): at rest, on its path |
| RECALLED | the same before anything had begun |
| ABORTED | it failed; the code gives the reason |
| SUCCEEDED | it is done |

A cancel names one goal, all goals up to a time, or with neither all goals. The robot stops on the path, and the result
follows when the axes are at rest. If a client that had subscribed to the results disconnects, its goals are cancelled.
The status of an ended goal is published for {KEPT:g} s more, {1 / PERIOD:g} times a second. Motions give feedback
{FEEDBACK_RATE:g} times a second; homings and primitives at every phase, primitives with positions in between.

## Paths

`/controller/follow` and `/controller/command` take a trajectory_msgs/JointTrajectory:

| joint_names | straight in |
|---|---|
| a, b, c, in any order | the joints [rad, m, m] |
| x, y, z | space [m] |
| a, d, z | angle, distance and height: around axis a [rad, m, m] |

The first point is the robot's position, to 1 mrad and 0.1 mm. The `effort` of a point between the ends defines its cut
corner: [before, after, fall, rise], the lengths [m] on either side and the shares (above 0, up to 1) of the time over
which the legs slow down and speed up. Without it the corner is sharp, and passed almost at rest. Velocities and
accelerations of the message are ignored, because the planner computes them. If the last `time_from_start` is above 0,
the motion takes at least that long.
"""

EVENTS = """\
## /maya_event

One word, a space, and one JSON object with the whole state. The last event is latched, so a late subscriber gets all of
it.

| key | what |
|---|---|
| mode | disconnected, not_homed, homing, idle, moving, paused, stopping, fault |
| homed, moving, gripper_closed | true or false |
| override | factor on the speed of all motion, 0.01 to 1 |
| strokes | ranges of a, b, c that homing measured, [[least, greatest], ...] (rad, m, m); null before it |
| fault | {"code", "message"}, null if there is none |
| code | of the event's own error, 0 without one |
| detail | the fields of the event |
"""

BYTES = """\
## By rosbridge

Numbers that are not finite are null. Arrays of uint8 may be sent as base64 text. A missing field is zero, empty or
false, and a header without a time gets the present one. Unknown fields, values of another type and integers out of
range are refused with code 4018 and the name of the field.
"""


def page() -> str:
    """Return the page."""
    return "\n".join(_lines())


def _lines() -> Iterator[str]:
    yield INTRODUCTION
    yield "## Names of the manual\n"
    yield from _table(row for row in TABLE if row.manual)
    yield "\n## Beyond the manual\n"
    yield from _table(row for row in TABLE if not row.manual)
    yield MORE
    yield RULES
    yield EVENTS
    events = [word for word in sorted(words()) if word != REFUSED]
    yield f"Words of the manual: {', '.join(word for word in events if word in MANUAL)}. Ours:"
    yield f"{', '.join(word for word in events if word not in MANUAL)}, {REFUSED}.\n"
    yield BYTES
    yield from _in_ros2()
    yield "## Types"
    yield from _definitions()


def _table(rows: Iterator[Row]) -> Iterator[str]:
    yield "| name | type | what | from | to | kept | asks for |"
    yield "|---|---|---|---|---|---|---|"
    for row in rows:
        kind = row.type if row.form is Kind.TOPIC else f"{row.form.value} {row.type}"
        sources, sinks = (", ".join(nodes) or "anyone" for nodes in (row.sources, row.sinks))
        yield f"| `{row.name}` | {kind} | {row.summary} | {sources} | {sinks} | {_kept(row)} | {_asks(row)} |"


ROS_2 = """\
## In ROS 2

The same names, with the types of the package `maya_interfaces` ([how to use
them](../how-to/maya-for-ros2-users.md)). All endpoints are reliable.
"""


def _in_ros2() -> Iterator[str]:
    yield ROS_2
    yield "| name | type | direction | keeps | for later readers |"
    yield "|---|---|---|---|---|"
    for row in (*TABLE, *ROS2_TABLE):
        kind = name_of(row.type, FORMS[row.form])
        if row.form is Kind.TOPIC:
            kept = quality(row)
            late = "yes (transient local)" if kept.late else "no (volatile)"
            yield f"| `{row.name}` | {kind} | {'to' if row.heard else 'from'} the robot | {kept.depth} | {late} |"
        else:
            yield f"| `{row.name}` | {kind} | {row.form.value} | {SERVICE.depth} | no (volatile) |"
    yield PARAMETERS.format(names=", ".join(f"`{name}`" for name in PARAMETER_SERVICES), node=PROGRAM)
    yield "| only in ROS 2 | what |"
    yield "|---|---|"
    yield from (f"| `{row.name}` | {row.summary} |" for row in ROS2_TABLE)
    yield ""


PARAMETERS = """
The node `/{node}` has parameters, by the services of rcl_interfaces: {names}.
"""


def _asks(row: Row) -> str:
    return "" if row.asks is None else f"`{row.asks}`"


def _kept(row: Row) -> str:
    if row.form is not Kind.TOPIC:
        return ""
    latched = "latched, " if row.latch else ""
    rate = f", {row.rate:g} Hz" if row.rate else ""
    return f"{latched}queue {row.queue_size}{rate}"


def _definitions() -> Iterator[str]:
    for file in sorted(DEFINITIONS.glob("*/*/*.*")):
        kind = f"{file.parent.parent.name}/{file.stem}"
        yield f"\n### {kind}\n"
        yield f"{SUFFIXES[file.suffix[1:]]}, md5 `{_sum(kind, file.suffix[1:])}`\n"
        yield f"```\n{file.read_text(encoding='utf-8').strip()}\n```"
    yield ""


def _sum(kind: str, form: str) -> str:
    if form == "srv":
        return types.service_md5sum(kind)
    return types.md5sum(kind + "Action" if form == "action" else kind)
