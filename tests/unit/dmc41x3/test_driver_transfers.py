"""The driver's downloads, uploads and listeners, on the twin."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager

import pytest

from dmc41x3.driver import Driver
from dmc41x3.errors import CommandRejected, InvalidValue, LinkLost, LinkTimeout, ProgramDiffers
from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.plant import BenchPlant
from dmc41x3.twin.wire.server import VirtualController
from dmc41x3.wire.transport import LoopbackTransport
from tests.unit.dmc41x3.scripted import conversation
from tests.virtual_time import elapse

PROGRAM = "#MAIN;' all of it counts\ncount=0\n#LOOP\ncount=count+1\nWT 10\nJP#LOOP,count<1000\nEN\n"


class Altering:
    """A link that alters the answers of the controller."""

    def __init__(self, link: LoopbackTransport, alter: Callable[[bytes], bytes]) -> None:
        self._link = link
        self._alter = alter
        self.peer = link.peer
        self.write = link.write
        self.close = link.close

    async def read(self) -> bytes:
        return self._alter(await self._link.read())


def as_it_is(data: bytes) -> bytes:
    return data


@asynccontextmanager
async def twin(alter: Callable[[bytes], bytes] = as_it_is) -> AsyncIterator[tuple[Driver, VirtualController]]:
    controller = VirtualController(VirtualDmc(BenchPlant()))
    driver = await Driver.open(Altering(controller.loopback(), alter), timeout=2.0)
    try:
        yield driver, controller
    finally:
        await driver.close()
        await controller.close()


async def test_program_is_uploaded_as_it_was_sent() -> None:
    async with twin() as (driver, _):
        await driver.download(PROGRAM)
        assert await driver.upload() == PROGRAM
        await driver.send("XQ#MAIN")
        await elapse(1.0)
        assert await driver.value("count") > 50.0


async def test_an_empty_program_erases_the_old() -> None:
    async with twin() as (driver, _):
        await driver.download(PROGRAM)
        await driver.download("")
        assert await driver.upload() == ""


async def test_the_longest_program_passes() -> None:
    text = "".join(f"line{number:04d}={number}{' ' * 50}\n" for number in range(4000))
    async with twin() as (driver, _):
        await driver.download(text)
        assert await driver.upload() == text


async def test_no_line_of_a_program_runs_while_another_runs() -> None:
    async with twin() as (driver, controller):
        await driver.download(PROGRAM)
        await driver.batch(["SH", "XQ#MAIN"])
        with pytest.raises(CommandRejected) as caught:
            await driver.download("PRA=5000\nBGA\nspoilt=1\n")
        assert caught.value.details["tc"] == 17
        assert caught.value.details["command"] == "DL"
        assert not any(axis.moving for axis in controller.machine.unit.axes)
        assert "spoilt" not in controller.machine.unit.variables
        assert await driver.value("_PRA") == 0.0
        assert await driver.value("_XQ0") >= 0.0
        assert await driver.upload() == PROGRAM


async def test_requests_of_others_stay_out_of_a_download() -> None:
    async with twin() as (driver, _):
        answers = await asyncio.gather(
            driver.send("MG 1"), driver.download(PROGRAM), driver.send("MG 2"), *(driver.send("MG 3") for _ in range(9))
        )
        assert answers[:3] == ["1.0000", None, "2.0000"]
        assert await driver.upload() == PROGRAM


async def test_a_line_that_is_too_long_is_refused_before_anything_is_sent() -> None:
    async with twin() as (driver, _):
        await driver.download(PROGRAM)
        with pytest.raises(InvalidValue, match="line 1"):
            await driver.download(f"#A\n{'x' * 81}\n")
        assert await driver.upload() == PROGRAM


async def test_a_bad_label_has_its_code() -> None:
    async with twin() as (driver, _):
        with pytest.raises(CommandRejected) as caught:
            await driver.download("#A\nEN\n#A\nEN\n")
        assert caught.value.details["tc"] == 61
        assert await driver.send("MG 5") == "5.0000"


async def test_different_program_is_reported_with_its_line() -> None:
    async with twin(lambda data: data.replace(b"WT 10", b"WT 99")) as (driver, _):
        with pytest.raises(ProgramDiffers) as caught:
            await driver.download(PROGRAM)
        assert caught.value.details == {"line": 4, "sent": "'WT 10'", "found": "'WT 99'"}


async def test_arrays_keep_every_bit_and_print_four_decimals() -> None:
    async with twin() as (driver, controller):
        await driver.send("DM pos[6]")
        await driver.download_array("pos", [1.0, -2.5, 1 / 65536])
        await driver.download_array("pos", [7, 8], first=4)
        assert await driver.upload_array("pos") == [1.0, -2.5, 0.0, 0.0, 7.0, 8.0]
        assert await driver.value("pos[2]*65536") == 1.0
        await driver.download_array("pos", [])
        assert controller.machine.unit.error_code == 0


async def test_missing_and_too_short_arrays_are_refused() -> None:
    async with twin() as (driver, _):
        with pytest.raises(CommandRejected) as caught:
            await driver.download_array("nope", [1.0])
        assert caught.value.details["tc"] in (57, 82)
        await driver.send("DM pos[2]")
        with pytest.raises(InvalidValue, match="elements 0 to 2"):
            await driver.download_array("pos", [1.0, 2.0, 3.0])


async def test_a_large_array_passes() -> None:
    values = [float(number) for number in range(10_000)]
    async with twin() as (driver, _):
        await driver.send("DM big[10000]")
        await driver.download_array("big", values)
        assert await driver.upload_array("big") == values


async def test_burned_memory_is_sound() -> None:
    async with twin() as (driver, _):
        burned = await driver.burned()
        assert burned.damaged == ()


async def test_damaged_memory_is_reported() -> None:
    async with conversation(lambda _: b" 6.0000\r\n:") as (driver, _):
        assert (await driver.burned()).damaged == ("parameters", "program")


async def test_every_listener_gets_every_message_until_it_leaves() -> None:
    async with twin() as (driver, _):
        first: list[str] = []
        second: list[str] = []
        third: list[str] = []
        driver.on_message = first.append
        leave = driver.listen(second.append)
        driver.listen(third.append)
        await driver.subscribe()
        await driver.download('#A\nMG "one"\nEN\n')
        await driver.send("XQ#A")
        await elapse(0.1)
        leave()
        leave()
        await driver.send("XQ#A")
        await elapse(0.1)
        assert (first, second, third) == (["one", "one"], ["one"], ["one", "one"])


async def test_lines_to_keep_stay_and_the_others_are_replaced() -> None:
    async with twin() as (driver, _):
        await driver.download("#A\nEN\n#B\nEN\n")
        await driver.download("#A\nEN\n#C\nx=1\nEN\n", keep=2)
        assert await driver.upload() == "#A\nEN\n#C\nx=1\nEN\n"


async def test_a_refused_line_behind_those_to_keep_leaves_them() -> None:
    async with twin() as (driver, _):
        await driver.download("#A\nEN\n#B\nEN\n")
        with pytest.raises(CommandRejected):
            await driver.download("#A\nEN\n#A\nEN\n", keep=2)
        assert await driver.upload() == "#A\nEN\n"


async def test_link_lost_in_a_download_is_reported_and_ends_messages() -> None:
    async with twin() as (driver, controller):
        await driver.send("MG 1")
        download = asyncio.create_task(driver.download(PROGRAM))
        controller.cut()
        with pytest.raises(LinkLost):
            await download
        assert driver.lost.done()
        with pytest.raises(LinkLost):
            await driver.upload()


async def test_a_controller_that_falls_silent_in_a_download_is_given_up_in_time() -> None:
    async with conversation(lambda _: None) as (driver, _):
        before = asyncio.get_running_loop().time()
        with pytest.raises(LinkTimeout):
            await driver.download("EN\n")
        assert asyncio.get_running_loop().time() - before == 10.0
