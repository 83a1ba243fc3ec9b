from __future__ import annotations

import asyncio
from collections.abc import Sequence
from contextlib import suppress

import pytest

from dmc41x3.driver import Driver
from dmc41x3.wire.transport import Transport
from maya_un.config import Config
from maya_un.config.files import parse
from maya_un.controller import watchdog_program
from maya_un.controller.controller import GalilController
from maya_un.controller.watchdog import BEATS
from maya_un.errors import (
    AbortInput,
    Faulted,
    GuardBlocked,
    GuardNotRunning,
    HostSilent,
    LimitReached,
    LinkLost,
    MachineError,
    MayaError,
    Stopped,
    UnexpectedReply,
)
from maya_un.testing import Rig, faults, rig
from maya_un.values import Mode
from tests.calm import CALM
from tests.unit.controller.bench import BEAT, FAR, HERE, commands_in, far_away, foreign, homed, now, when_sent
from tests.virtual_time import elapse

USERS = "#BLINK\r\nSB2\r\nWT100\r\nCB2\r\nWT100\r\nJP#BLINK\r\n"


async def guard_line(bench: Rig) -> float:
    return float((await foreign(bench, "MG_XQ7"))[0])


async def download(bench: Rig, program: str, *commands: str) -> None:
    driver = await Driver.open(bench.virtual.loopback(), timeout=2.0)
    await driver.download(program)
    await driver.batch(list(commands))
    await driver.close()


async def upload(bench: Rig) -> str:
    driver = await Driver.open(bench.virtual.loopback(), timeout=2.0)
    program = await driver.upload()
    await driver.close()
    return program


async def test_watchdog_runs_from_the_start_and_ends_with_us() -> None:
    async with rig(live=True) as bench:
        assert await guard_line(bench) > 0
        assert watchdog_program.text(0.5) == (await upload(bench)).splitlines()
        await bench.controller.close()
        assert await guard_line(bench) == -1


async def test_dry_run_has_no_watchdog() -> None:
    async with homed() as bench:
        await bench.controller.move(FAR)
        assert await guard_line(bench) == -1
        assert b"mayabeat" not in bench.sent


async def test_watchdog_time_of_zero_disables_it() -> None:
    async with rig(parse({"safety": {"guard_time": 0.0}}), live=True) as bench:
        assert await guard_line(bench) == -1


async def test_the_beat_is_twenty_times_as_fast_as_it_must_be() -> None:
    async with rig(live=True) as bench:
        del bench.sent[:]
        await elapse(10.0)
        beats = sum(command.startswith(BEAT) for command in commands_in(bytes(bench.sent)))
        assert beats == pytest.approx(10.0 * BEATS / 0.5, abs=2)


@pytest.mark.parametrize("command", ["HX7", "HX", "ST", "AB", "RS"])
@pytest.mark.parametrize("moving", [True, False])
async def test_killed_watchdog_is_noticed_and_nothing_moves_without_it(command: str, moving: bool) -> None:
    async with homed(live=True) as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        if moving:
            await elapse(5.0)
        else:
            await move
        await foreign(bench, command)
        if moving:
            await asyncio.wait({move})
            assert isinstance(move.exception(), MayaError)
        await elapse(1.0)  # a reset ends the connection too, so there is a new one by now
        assert bench.controller.state.mode is Mode.FAULT
        assert not bench.controller.state.moving
        with pytest.raises(Faulted):
            await bench.controller.move(HERE)
        rest = bench.mechanics.true_joints()
        await bench.controller.recover()
        assert await guard_line(bench) > 0
        await elapse(20.0)
        assert bench.mechanics.true_joints() == pytest.approx(rest, abs=5e-5)
        if bench.controller.state.homed:
            await bench.controller.move(HERE)


@pytest.mark.parametrize("command", ["HX7", "ST", "AB", "RS"])
async def test_watchdog_killed_at_the_last_moment_prevents_the_motion(command: str) -> None:
    async with homed(live=True) as bench:
        begun: list[float] = []

        def kill(_: str, way: str, data: bytes) -> None:
            if way == "rx" and b"LE" in data:
                begun.append(now())
                bench.virtual.tap = None
                assert handle is not None
                bench.virtual.machine.receive(handle, f"{command}\r".encode(), bench.virtual.machine.now)

        handle = bench.virtual.machine.connect()
        assert handle is not None
        bench.virtual.tap = kill
        rest = bench.mechanics.true_joints()
        with pytest.raises((GuardNotRunning, LinkLost)):
            await bench.controller.move(FAR)
        assert begun
        await elapse(1.0)
        assert bench.mechanics.true_joints() == pytest.approx(rest, abs=5e-5)


async def test_abort_input_is_named_before_the_watchdog_it_killed() -> None:
    async with homed(live=True) as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(5.0)
        bench.virtual.abort_input(True)
        with pytest.raises(MachineError) as caught:
            await move
        assert caught.value.code == 2303
        bench.virtual.abort_input(False)
        await bench.controller.recover()
        assert await guard_line(bench) > 0


async def test_our_own_stop_and_abort_leave_the_watchdog_alone() -> None:
    async with homed(live=True) as bench:
        for end in (bench.controller.stop, bench.controller.abort):
            move = asyncio.create_task(bench.controller.move(FAR))
            await elapse(3.0)
            await end()
            await asyncio.wait({move})
            assert move.exception() is not None
            assert await guard_line(bench) > 0
            if bench.controller.state.mode is Mode.FAULT:
                await bench.controller.recover()


def hardly_read() -> Config:
    """Return a machine whose record is read every 100 s, more seldom than a configuration file may ask for."""
    config = Config()
    return config.model_copy(update={"controller": config.controller.model_copy(update={"stream_rate": 0.01})})


async def test_limit_is_reported_by_the_controller_itself() -> None:
    async with homed(hardly_read(), live=True) as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(5.0)
        met = now()
        with faults.stuck_limit(bench.virtual, "C"), pytest.raises(LimitReached):
            await move
        assert now() - met < 1.5  # braking included; the record would have come after 100 s


async def test_silent_host_learns_of_the_stop_when_it_returns() -> None:
    async with homed(live=True) as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(5.01)
        # A beat as old as if nobody had been heard for 0.6 s, looked at before the next one comes.
        await foreign(bench, "HX7", "mayabeat=TIME-600", "XQ#MAYAGRD,7")
        with pytest.raises(HostSilent):
            await move
        assert bench.controller.state.mode is Mode.FAULT
        await bench.controller.recover()
        await bench.controller.move(HERE)


async def test_a_silent_host_at_rest_is_no_fault() -> None:
    async with homed(live=True) as bench:
        await foreign(bench, "mayaout=1")
        await elapse(0.2)
        assert await foreign(bench, "MG mayaout") == ["0.0000"]
        assert bench.controller.state.mode is Mode.IDLE
        await bench.controller.move(FAR)


async def test_users_program_stays_with_the_watchdog_after_it() -> None:
    async with rig() as bench:
        await download(bench, USERS)
        again = bench.controller
        await again.close()
        live = _live(bench)
        await live.open()
        assert (await upload(bench)).splitlines()[:6] == USERS.splitlines()
        await foreign(bench, "XQ#BLINK,0")
        await elapse(2.0)
        assert await guard_line(bench) > 0
        assert float((await foreign(bench, "MG_XQ0"))[0]) >= 0
        await live.close()
        assert float((await foreign(bench, "MG_XQ0"))[0]) >= 0


@pytest.mark.parametrize(
    ("program", "commands", "words"),
    [
        (USERS, ["XQ#BLINK,0"], "HX"),
        ("#LIMSWI\r\nRE\r\n", [], "JS#MAYALIM"),
        (
            "#X\r\nWT1000\r\nJP#X\r\n" + "".join(f"{line}\r\n" for line in watchdog_program.text(0.5)),
            ["XQ#X,7"],
            "HX 7",
        ),
    ],
)
async def test_a_program_in_the_way_keeps_us_from_connecting(program: str, commands: Sequence[str], words: str) -> None:
    async with rig() as bench:
        await download(bench, program, *commands)
        live = _live(bench)
        with pytest.raises(GuardBlocked, match=words):
            await live.open()
        await elapse(0.1)
        assert bench.virtual.connections == "A"
        assert (await upload(bench)).splitlines() == program.splitlines()


async def test_watchdog_with_another_time_is_replaced() -> None:
    async with rig() as bench:
        await download(
            bench, "".join(f"{line}\r\n" for line in watchdog_program.text(2.0)), "mayabeat=TIME", "mayaout=0"
        )
        await foreign(bench, "XQ#MAYAGRD,7")
        live = _live(bench)
        await live.open()
        assert (await upload(bench)).splitlines() == watchdog_program.text(0.5)
        assert await guard_line(bench) > 0
        await live.close()


async def test_users_lines_after_the_watchdog_stay_in_the_controller() -> None:
    async with rig() as bench:
        guard = "".join(f"{line}\r\n" for line in watchdog_program.text(0.5))
        await download(bench, guard + USERS)
        live = _live(bench)
        await live.open()
        assert (await upload(bench)).splitlines() == [*USERS.splitlines(), *guard.splitlines()]
        await live.close()


async def test_failed_installation_leaves_thread_7_alone() -> None:
    async with rig() as bench:
        guard = "".join(f"{line}\r\n" for line in watchdog_program.text(0.5))
        await download(bench, f"#X\r\nWT1000\r\nJP#X\r\n{guard}", "XQ#X,7")
        with pytest.raises(GuardBlocked):
            await _live(bench).open()
        assert await guard_line(bench) >= 0


async def test_deleted_variables_are_made_again() -> None:
    async with homed(live=True) as bench:
        await foreign(bench, "DA mayaout,mayabeat")
        await elapse(0.1)
        assert bench.controller.state.mode is Mode.FAULT
        await bench.controller.recover()
        await bench.controller.move(FAR)


@pytest.mark.parametrize("latency", [0.1, 0.2, 0.3])
async def test_slow_link_is_not_a_silent_host(latency: float) -> None:
    async with far_away(latency, 10.0) as bench:
        await bench.controller.move(FAR)
        await foreign(bench, "HX7")
        await elapse(2.0)
        await bench.controller.recover()
        await bench.controller.move(HERE)


async def test_a_silence_at_rest_just_before_a_motion_is_no_fault() -> None:
    async with homed(live=True) as bench:
        when_sent(bench, "QR", lambda: _act(bench, "mayaout=1"))
        await bench.controller.move(FAR)
        assert bench.controller.state.mode is Mode.IDLE


async def test_host_that_slept_through_the_motion_learns_why_it_stopped() -> None:
    async with homed(live=True) as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(5.0)
        guard = bench.controller._fault_monitor._guard
        assert guard is not None
        await guard._stop_beating()
        guard._beat = asyncio.create_task(elapse(1000.0))
        with pytest.raises(HostSilent):
            await move
        assert bench.controller.state.mode is Mode.FAULT


@pytest.mark.parametrize("form", ["VF -4.0", "VF 10.0"])
async def test_number_format_does_not_disturb_the_watchdog(form: str) -> None:
    async with homed(live=True) as bench:
        await foreign(bench, form)
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(5.0)
        await foreign(bench, "HX7")
        with pytest.raises(GuardNotRunning):
            await move
        await bench.controller.recover()
        await bench.controller.move(HERE)


async def test_answers_without_sense_prove_nothing() -> None:
    async with homed(live=True) as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(5.0)
        driver = bench.controller._monitor.link.driver
        driver.batch = _nonsense
        with pytest.raises(UnexpectedReply):
            await move


async def test_many_reports_are_not_many_questions() -> None:
    async with homed(hardly_read(), live=True) as bench:
        del bench.sent[:]
        for _ in range(100):
            bench.controller._fault_monitor._on_message("MAYA limit")
        await elapse(0.1)
        assert commands_in(bytes(bench.sent)).count("QR") == 1
        bench.controller._fault_monitor._on_message("MAYA error")
        await elapse(0.1)
        assert commands_in(bytes(bench.sent)).count("QR") == 2


async def test_a_download_cut_off_anywhere_leaves_the_users_program() -> None:
    whole = USERS.splitlines()
    for least in range(0, 700, 23):
        async with rig() as bench:
            await download(bench, USERS)
            live = _live(bench, least)
            with suppress(MayaError):
                await live.open()
            await live.close()
            found = (await upload(bench)).splitlines()
            assert found[: len(whole)] == whole
            again = _live(bench)
            await again.open()
            await again.close()


@pytest.mark.parametrize("after", [5.0, 60.0, 150.0])
async def test_homing_stopped_by_another_host_does_not_go_on(after: float) -> None:
    async with rig(CALM, live=True) as bench:
        home = asyncio.create_task(bench.controller.home())
        await elapse(after)
        await foreign(bench, "STABC")
        with pytest.raises(Stopped):
            await home
        rest = bench.mechanics.true_joints()
        await elapse(5.0)
        assert bench.mechanics.true_joints() == pytest.approx(rest, abs=5e-5)


@pytest.mark.parametrize("after", [3.01, 3.02, 3.03, 3.04])
async def test_silent_host_learns_that_its_guarded_move_was_stopped(after: float) -> None:
    async with rig(live=True) as bench:
        move = asyncio.create_task(bench.controller.guarded_move("b", 0.05))
        await elapse(after)
        await foreign(bench, "HX7", "mayabeat=TIME-600", "XQ#MAYAGRD,7")
        with pytest.raises(HostSilent):
            await move
        assert bench.controller.state.mode is Mode.FAULT


async def test_delayed_homing_learns_of_the_watchdog() -> None:
    async with rig(CALM, live=True) as bench:
        home = asyncio.create_task(bench.controller.home())
        await elapse(150.0)
        guard = bench.controller._fault_monitor._guard
        assert guard is not None
        await guard._stop_beating()
        guard._beat = asyncio.create_task(elapse(1000.0))
        with pytest.raises(HostSilent):
            await home


async def test_watchdog_killed_in_homing_is_not_taken_for_a_limit() -> None:
    async with rig(CALM, live=True) as bench:
        home = asyncio.create_task(bench.controller.home())
        await elapse(60.0)  # axis a has met its reverse switch by then
        await foreign(bench, "HX7")
        with pytest.raises(GuardNotRunning):
            await home


async def test_an_emergency_stop_while_recovering_switches_no_motor_on() -> None:
    async with homed(live=True) as bench:
        await foreign(bench, "HX7")
        await elapse(0.1)
        when_sent(bench, "XQ#", lambda: bench.virtual.abort_input(True))
        with pytest.raises(MachineError):
            await bench.controller.recover()
        bench.virtual.abort_input(False)
        await bench.controller.recover()
        when_sent(bench, "TM", lambda: bench.virtual.abort_input(True))
        await foreign(bench, "HX7")
        await elapse(0.1)
        with pytest.raises(AbortInput):
            await bench.controller.recover()
        assert await foreign(bench, "MG_MOA") == ["1.0000"]


async def _nonsense(commands: Sequence[str]) -> list[str]:
    return ["what?" for _ in commands]


def _act(bench: Rig, command: str) -> None:
    handle = bench.virtual.machine.connect()
    assert handle is not None
    bench.virtual.machine.receive(handle, f"{command}\r".encode(), bench.virtual.machine.now)


class _Cut:
    """A transport that ends after so many bytes of downloads."""

    def __init__(self, transport: Transport, left: int) -> None:
        self._transport = transport
        self._left = left
        self._over: asyncio.Future[bytes] = asyncio.get_running_loop().create_future()

    @property
    def peer(self) -> str:
        return self._transport.peer

    async def read(self) -> bytes:
        if self._over.done():
            return b""
        reading = asyncio.ensure_future(self._transport.read())
        await asyncio.wait({reading, self._over}, return_when=asyncio.FIRST_COMPLETED)
        if reading.done():
            return reading.result()
        reading.cancel()
        return b""

    def write(self, data: bytes) -> None:
        if data.startswith(b"DL"):
            data, self._left = data[: self._left], self._left - len(data)
        if not self._over.done():
            self._transport.write(data)
        if self._left <= 0 and not self._over.done():
            self._over.set_result(b"")

    async def close(self) -> None:
        await self._transport.close()


def _live(bench: Rig, cut: int | None = None) -> GalilController:
    async def dial() -> Transport:
        return bench.virtual.loopback() if cut is None else _Cut(bench.virtual.loopback(), cut)

    return GalilController(dial, "twin", bench.controller.config, live=True)
