"""A user's own program in the controller: it homes an axis, picks and places, and is followed line by line."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest

from dmc41x3.driver import Driver
from dmc41x3.loops import run
from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.plant import BenchPlant
from dmc41x3.twin.wire.server import VirtualController
from maya_un.errors import CommandRejected
from maya_un.machine.mechanics import MayaMechanics
from maya_un.machine.truth import StartPose, TrueConstants
from tests.virtual_time import elapse

PICK, PLACE = 8000, 16000
"""Pick and place positions of the boom [counts from the reverse switch]."""

PROGRAM = f"""\
'Home the boom on its reverse switch, then carry a part there, back and there
#AUTO
SB 1;'open
SH;hits=0;cycles=0
SPA=8000;ACA=40960;DCA=40960;SDA=409600
JS #HOME
IF (_JS<>1)
  MG "home not found"
  EN
ENDIF
#CYCLE
JS #CARRY({PICK},{PLACE})
JS #CARRY({PLACE},{PICK})
cycles=cycles+1
JP #CYCLE,cycles<2
JS #CARRY({PICK},{PLACE})
MG "done",cycles{{Z3.0}}
EN
'To the switch, off it, and to it again at a tenth of the speed
#HOME
IF (_LRA=0)
  PRA=2000;BGA;AMA
ENDIF
JGA=-4000;BGA;AMA
JP #LOST,_LRA=1
PRA=1000;BGA;AMA
JP #LOST,_LRA=0
JGA=-400;BGA;AMA
JP #LOST,_LRA=1
WT 200
DPA=0
MG "homed"
EN ,,1
#LOST
EN ,,0
'From one place to another: ^a, ^b
#CARRY
SPA=8000;PAA=^a;BGA
ADA=100;'on its way
AMA;MCA
CB 1;WT 300
PAA=^b;BGA;APA=(^a+^b)/2
half=_TPA
MCA
SB 1;WT 300
MG "put down",_RPA{{Z6.0}}
EN
#LIMSWI
hits=hits+1
RE 1
"""


@asynccontextmanager
async def served(machine: VirtualDmc) -> AsyncIterator[tuple[Driver, list[str]]]:
    """Connect a driver to a machine; the list takes the messages of programs."""
    virtual = VirtualController(machine)
    driver = await Driver.open(virtual.loopback(), timeout=5.0)
    said: list[str] = []
    driver.listen(said.append)
    await driver.subscribe()
    try:
        yield driver, said
    finally:
        await driver.close()
        await virtual.close()


@pytest.mark.parametrize("start", [0.4, 1.1, 0.0, -0.02])
async def test_a_program_homes_picks_and_places(start: float) -> None:
    truth = TrueConstants()
    pick, place = (
        MayaMechanics(truth, StartPose(a=counts / truth.scale[0])).gripper_point() for counts in (PICK, PLACE)
    )
    maya = MayaMechanics(truth, StartPose(a=start), {"part": pick})
    async with served(VirtualDmc(maya)) as (driver, said):
        await driver.download(PROGRAM)
        assert await driver.upload() == PROGRAM
        await driver.send("XQ #AUTO")
        await elapse(100.0)
        assert said == ["homed", *[f"put down {PLACE}", f"put down {PICK}"] * 2, f"put down {PLACE}", "done 2"]
        assert await driver.value("_XQ0") == -1.0
        assert await driver.value("hits") == 2.0
        assert abs(await driver.value("half") - (PICK + PLACE) / 2) < 30.0
        # Zero is where the switch is, as exactly as a tenth of the speed finds it.
        assert abs(maya.true_joints()[0] * truth.scale[0] - PLACE) < 20.0
        assert maya.parts["part"] == pytest.approx(place, abs=0.003)


async def test_a_trace_follows_the_program_line_by_line() -> None:
    async with served(VirtualDmc(BenchPlant())) as (driver, said):
        await driver.download("#A\nSHA;n=0\n#L;PRA=500;BGA;AMA\nn=n+1\nJP #L,n<2\nJS #S;EN\n#S\nMG n\nEN\n")
        await driver.batch(["TR 1", "XQ #A"])
        await elapse(5.0)
    loop = ["2 #L;PRA=500;BGA;AMA", "3 n=n+1", "4 JP #L,n<2"]
    assert said == ["1 SHA;n=0", *loop, *loop, "5 JS #S;EN", "7 MG n", " 2.0000", "8 EN"]


async def test_limits_and_following_errors_are_dealt_with_though_nothing_runs() -> None:
    plant = BenchPlant()
    machine = VirtualDmc(plant)
    async with served(machine) as (driver, said):
        await driver.download('#LIMSWI;MG "limit",_SCA{Z3.0},_SCB{Z3.0};RE\n#POSERR;MG "error",_TEB{Z5.0};MOC;RE\n')
        await driver.batch(["SH", "FLA=20000", "ERB=200", "JG 10000,10000", "BGAB"])
        await elapse(1.0)
        assert said == []
        plant.hold(1)
        await elapse(0.5)
        assert [line.split()[0] for line in said] == ["error"]
        assert await driver.value("_MOC") == 1.0
        await elapse(3.0)
        assert said[1:] == ["limit 2 0"]
        assert await driver.value("_NO") == 0.0


@pytest.mark.parametrize("loop", ["#A;n=n+1;JP #A", "#A;n=n+1;n=_TPA;SB 1;CB 1;JP #A", '#A;MG "x";JP #A'])
async def test_a_runaway_loop_leaves_the_machine_responsive(loop: str) -> None:
    async with served(VirtualDmc(BenchPlant())) as (driver, _):
        await driver.download(f"{loop}\n")
        await driver.batch(["n=0", "SHA", "PRA=51200", "SPA=10240", *[f"XQ #A,{thread}" for thread in range(8)], "BGA"])
        for _ in range(10):
            await elapse(0.05)
            assert await driver.send("WH") == "IHA"
        with pytest.raises(CommandRejected):
            await driver.download("EN\n")
        await driver.send("STA")
        await elapse(0.2)
        assert await driver.value("_BGA") == 0.0
        assert await driver.value("_NO") == 255.0
        await driver.send("HX")
        assert await driver.value("_NO") == 0.0
        await driver.download("EN\n")


@pytest.mark.parametrize(("command", "left"), [("HX", 0.0), ("HX 2", 1.0), ("ST", 0.0), ("AB", 0.0), ("AB 1", 5.0)])
async def test_programs_end(command: str, left: float) -> None:
    async with served(VirtualDmc(BenchPlant())) as (driver, said):
        await driver.download("#A;WT 100;JP #A\n")
        await driver.batch(["XQ #A", "XQ #A,2"])
        await elapse(1.0)
        await driver.send(command)
        assert await driver.value("_NO") == left
        await elapse(1.0)
        assert await driver.value("_NO") == left
        assert said == []


def test_over_tcp_byte_for_byte() -> None:
    async def main() -> None:
        virtual = VirtualController(VirtualDmc(BenchPlant()))
        reader, writer = await asyncio.open_connection(*await virtual.serve())
        writer.write(b"DL\r\n#A\r\nSHA;PRA=200;SPA=20000\r\nBGA;AMA\r\nMG _TPA\r\nEN\r\n\\")
        assert await reader.readexactly(2) == b"::"
        writer.write(b"UL\r")
        uploaded = await reader.readuntil(b"\x1a:")
        assert uploaded == b"#A\r\nSHA;PRA=200;SPA=20000\r\nBGA;AMA\r\nMG _TPA\r\nEN\r\n\x1a:"
        writer.write(b"CW 1;CF I;TR 1;XQ #A,3\r")
        assert await reader.readexactly(4) == b"::::"
        marked = await reader.readuntil(b"EN\r\n".translate(bytes(range(128, 256)) * 2))
        text = bytes(byte & 0x7F for byte in marked).decode()
        assert all(byte & 0x80 for byte in marked)
        assert text == "1 SHA;PRA=200;SPA=20000\r\n2 BGA;AMA\r\n3 MG _TPA\r\n 200.0000\r\n4 EN\r\n"
        writer.write(b"MG _XQ3\r")
        assert await reader.readuntil(b":") == b"-1.0000\r\n:"
        writer.close()
        await writer.wait_closed()
        await virtual.close()

    run(main())
