from __future__ import annotations

from maya_un.assembly import stack
from maya_un.config import Config
from maya_un.robot.primitives.home import Home
from maya_un.robot.primitives.pick import Pick
from maya_un.values import Point

CUBE, CAN = Point(0.5, 1.1, 0.4), Point(1.0, 0.5, 0.4)


async def test_twin_reports_the_positions_of_its_parts_and_the_carried_one() -> None:
    async with stack(Config(), live=False, parts={"cube": CUBE, "can": CAN}) as layers:
        twin = layers.twin
        assert twin is not None
        assert (twin.parts, twin.carried) == ({"cube": CUBE, "can": CAN}, None)
        await layers.robot.run(Home())
        await layers.robot.run(Pick(CUBE))
        assert twin.carried == "cube"
        assert twin.parts["cube"].z > CUBE.z
        assert twin.parts["can"] == CAN
