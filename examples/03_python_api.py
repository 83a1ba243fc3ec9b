"""Maya from Python: connect, home, ask before moving, pick, place, read what happened.

Run it with `.venv/bin/python examples/03_python_api.py`. It takes a second: the twin runs in virtual time. With
`--speed 20` the same code runs twenty times as fast as the machine would. For the machine itself give `stack` its
address instead of "sim", and run it with `asyncio.run`: its time is the wall's.
"""

from __future__ import annotations

import argparse

from dmc41x3.loops import ScaledLoop, run, run_virtual
from maya_un.assembly.stack import stack
from maya_un.config import Config
from maya_un.errors import MayaError
from maya_un.robot.primitives import Gripper, Home, Pick, Place
from maya_un.values import Point

CUBE = Point(0.41, 1.13, 0.40)
TRAY = Point(1.18, 0.21, 0.40)


async def main(speed: float) -> None:
    async with stack(Config(), "sim", parts={"cube": CUBE}, speed=speed) as maya:
        robot, service = maya.robot, maya.service

        await robot.run(Home())
        print("homed at", tuple(round(value, 3) for value in maya.controller.state.point or ()))

        answer = await service.previews.reach(Point(0.41, 1.13, 2.20))
        print("reach:", answer.reachable, "-", answer.reason)

        preview = robot.preview(Pick(CUBE), robot.pose)
        print(f"a pick takes {preview.duration:.1f} s:", ", ".join(phase.name for phase in preview.phases))

        await robot.run(Pick(CUBE), on_phase=lambda phase: print("  ", phase))
        print("holding:", robot.holding)
        await robot.run(Place(TRAY), on_phase=lambda phase: print("  ", phase))

        try:
            await robot.run(Place(TRAY))
        except MayaError as error:
            print(f"refused with {error.code}:", error)

        report = await service.command(Gripper(open=True))
        print("a command through the queue:", report.steps[0].step, report.state)

        if maya.twin is not None:
            place = maya.twin.mechanics.parts["cube"]
            print("the cube stands at", tuple(round(value, 3) for value in place))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Maya from Python")
    parser.add_argument("--speed", type=float, help="run the twin this many times as fast as the machine")
    speed = parser.parse_args().speed
    if speed is None:
        run_virtual(main(1.0))
    else:
        run(main(speed), lambda: ScaledLoop(speed))
