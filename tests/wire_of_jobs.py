"""Print what goes over the wire in random jobs, a digest for each: `python -m tests.wire_of_jobs SEED JOBS`.

Two builds of the program that print the same sent the same bytes at the same times, and got the same answers.
"""

from __future__ import annotations

import asyncio
import sys
from collections import Counter
from contextlib import suppress
from hashlib import sha256
from random import Random
from typing import TYPE_CHECKING

from dmc41x3.loops import run_virtual
from dmc41x3.twin.wire.connections import LoopbackLink
from dmc41x3.twin.wire.server import VirtualController
from maya_un.errors import MayaError
from maya_un.motion import Blend, Path, Space
from maya_un.robot.primitives.approach import Approach
from maya_un.robot.primitives.gripper import Gripper
from maya_un.robot.primitives.pick import Pick
from maya_un.robot.primitives.place import Place
from maya_un.robot.robot import MayaRobot
from tests.machines import drawn_machine, homed
from tests.system.test_random_jobs import Trial, drawn_target, drawn_way

if TYPE_CHECKING:
    from dmc41x3.twin.network import Handle

MOTIONS = 1


async def carry_out_drawn_job(rng: Random) -> None:
    """Carry out some motions and primitives on a drawn machine; refused ones send what they send."""
    machine, place = drawn_machine(rng)
    async with homed(machine, place) as bench:
        trial, robot = Trial(bench, machine, rng, Counter()), MayaRobot(bench.controller, machine.config)
        for _ in range(rng.randint(1, MOTIONS)):
            with suppress(MayaError):
                if rng.random() < 0.5:
                    way = drawn_way(trial)
                    path = Path(Space(way.space), way.waypoints, tuple(Blend(*cut) for cut in way.cuts))
                    await bench.controller.follow(path, speed=rng.uniform(0.05, 1.0))
                else:
                    target = drawn_target(trial)
                    await robot.run(rng.choice((Approach(target), Pick(target), Place(target), Gripper(open=True))))


def digest_of_job(seed: str) -> str:
    """Carry out the job of a seed; return a digest of all bytes on the wire, with their times."""
    seen = sha256()

    def note(direction: bytes, data: bytes) -> None:
        seen.update(b"%s %s " % (direction, asyncio.get_running_loop().time().hex().encode("ascii")))
        seen.update(data)

    received, send = VirtualController.received, LoopbackLink.send

    def noted_received(self: VirtualController, handle: Handle, data: bytes) -> None:
        note(b">", data)
        received(self, handle, data)

    def noted_send(self: LoopbackLink, data: bytes) -> None:
        note(b"<", data)
        send(self, data)

    VirtualController.received, LoopbackLink.send = noted_received, noted_send
    try:
        run_virtual(carry_out_drawn_job(Random(seed)))
    finally:
        VirtualController.received, LoopbackLink.send = received, send
    return seen.hexdigest()


def main() -> None:
    seed, jobs = sys.argv[1], int(sys.argv[2])
    for job in range(jobs):
        print(digest_of_job(f"{seed} {job}"))


if __name__ == "__main__":
    main()
