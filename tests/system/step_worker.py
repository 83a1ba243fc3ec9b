"""A program that carries out steps on a bus, to be killed: `python step_worker.py FILE`.

Lines on its input: a command of /step_command, or `end` to let the current task succeed. On its output: `ready`, `begun
COMMAND` when a task begins, `result JSON` for messages on /step_result, `problem TEXT` for log messages.
"""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path

from maya_ros.graph.bus import Bus
from maya_ros.graph.outcome import success
from maya_ros.graph.protocol import Feedback, Message
from maya_ros.graph.servers.steps import bridged
from maya_ros.graph.table import STEP_COMMAND, STEP_RESULT, TASK
from maya_un.http import dates
from maya_un.steps.store import StepStore


def say(line: str) -> None:
    """Write a line that is there at once."""
    print(line, flush=True)


async def main(path: Path) -> None:
    """Carry out steps until the input ends."""
    asyncio.get_running_loop().set_exception_handler(lambda _, context: say(f"problem {context['message']}"))
    bus = Bus()
    robot, cloud, bridge = bus.node("primitive_server"), bus.node("ros_coms"), bus.node("firebase_bridge")
    told_to_end = asyncio.Queue[None]()

    async def act(goal: Message, feedback: Feedback) -> Message:
        feedback({"phase": "begun"})
        say(f"begun {goal['task']['command']}")
        await told_to_end.get()
        return success()

    robot.act(TASK.name, TASK.type, act)
    cloud.subscribe(STEP_RESULT.name, STEP_RESULT.type, lambda message: say(f"result {message['data']}"))
    commands = cloud.advertise(STEP_COMMAND.name, STEP_COMMAND.type)
    store = await StepStore.open(path)
    async with bridged(bridge, store, dates.now):
        say("ready")
        lines = asyncio.StreamReader()
        await asyncio.get_running_loop().connect_read_pipe(lambda: asyncio.StreamReaderProtocol(lines), sys.stdin)
        async for line in lines:
            if line == b"end\n":
                told_to_end.put_nowait(None)
            else:
                commands.publish({"data": line.decode().strip()})
    await store.close()


if __name__ == "__main__":
    asyncio.run(main(Path(sys.argv[1])))
