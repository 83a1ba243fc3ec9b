"""The action /task of node primitive_server: each goal is forwarded to the node that decides who may move the robot.

This module loads nothing of the robot, so that the node starts fast.
"""

from __future__ import annotations

from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager

from maya_ros.graph.outcome import error_of
from maya_ros.graph.protocol import Feedback, GoalRefused, GoalStatus, Graph, Message
from maya_ros.graph.table import TASK
from maya_un.cancellation import run_to_rest
from maya_un.errors import NodeGone

INNER = "/robot_controller/task"
"""The action by which primitive_server executes primitives, so that one node decides who may move the robot."""

DECIDING_NODE = "robot_controller"
"""The node that decides who may move the robot."""


@asynccontextmanager
async def tasks_forwarded(graph: Graph) -> AsyncGenerator[None]:
    """Serve /task while the block runs; the robot layer carries out each goal."""

    async def act(goal: Message, feedback: Feedback) -> Message:
        gone = NodeGone(node=DECIDING_NODE)
        try:
            ended = await run_to_rest(graph.do(INNER, TASK.type, goal, feedback))
        except NodeGone:  # it names the action, not the node
            raise gone from None
        if not ended.result:
            raise gone
        if ended.outcome is GoalStatus.REJECTED:
            raise GoalRefused(ended.result)
        error = error_of(ended.result, INNER)
        if error is not None:
            raise error
        return ended.result

    served = graph.act(TASK.name, TASK.type, act)
    try:
        yield
    finally:
        served.close()
