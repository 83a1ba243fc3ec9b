"""Maya over HTTP from Python: the same program for a twin of its own and for the robot that runs.

Run it with `.venv/bin/python examples/06_client.py`: it starts a twin, fifty times as fast as the machine, and ends it
again. With `--running` it talks to the `maya up` that runs, twin or robot.
"""

from __future__ import annotations

import argparse

from maya_un import Client, JobBuilder
from maya_un.errors import MayaError

CUBE = (0.41, 1.13)
TRAY = (1.18, 0.21)


def main(maya: Client) -> None:
    maya.home()
    print("homed at", tuple(round(value, 3) for value in maya.state().point or ()))

    job = JobBuilder("one cube").part("cube", *CUBE).pick("cube").place(TRAY)
    print(f"it will take {maya.preview(job).duration:.0f} s")

    with maya.lease(note="an example"):
        run = maya.submit(job, notes="from examples/06_client.py")
        for report in run:
            print(report.state, [str(step.state) for step in report.steps])

    try:
        maya.place(TRAY)
    except MayaError as error:
        print(f"refused with {error.code}: {error}")

    for line in maya.history.page(limit=3):
        print(line.id, line.name, line.state, line.owner)
    x, y, z = maya.twin_parts()["cube"]
    print(f"the cube stands at ({x:.2f}, {y:.2f}, {z:.2f})")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Maya over HTTP from Python")
    parser.add_argument(
        "--running", action="store_true", help="with the robot that runs, rather than a twin of its own"
    )
    running = parser.parse_args().running
    with Client() if running else Client.twin(parts={"cube": CUBE}) as client:
        main(client)
