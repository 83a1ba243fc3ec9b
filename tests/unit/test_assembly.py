from __future__ import annotations

from pathlib import Path

from maya_un.assembly.stack import stack
from maya_un.config import Config
from maya_un.process.journal.sqlite import SqliteJournal
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


class Noon:
    """A calendar for which it is always the same second."""

    def now(self) -> str:
        return "2026-11-21T12:00:00+00:00"

    def after(self, seconds: float) -> str:
        return self.now()


async def test_a_run_without_a_journal_has_the_number_of_its_date(tmp_path: Path) -> None:
    async with stack(Config(), live=False, calendar=Noon()) as layers:
        assert (await layers.service.status()).run == 20_261_121_120_000
    journal = await SqliteJournal.open(tmp_path / "maya.db")
    async with stack(Config(), live=False, calendar=Noon(), journal=journal) as layers:
        assert (await layers.service.status()).run == 1
    await journal.close()
