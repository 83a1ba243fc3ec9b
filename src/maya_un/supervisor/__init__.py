"""Supervise robots from Python, over an MQTT broker.

    async with Supervisor("mqtt://localhost") as lab:
        await lab.robot("MAYA").pick(0.5, 1.1, 0.4)

`lab` is the connection, `step` one step of one robot, and `process` a file of steps for several robots, with its
record and its runner.
"""

from maya_un.supervisor.lab import Event, Robot, Supervisor
from maya_un.supervisor.step import Step

__all__ = ["Event", "Robot", "Step", "Supervisor"]
