from __future__ import annotations

import pytest

from dmc41x3.language.commands import LINE_LIMIT
from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.plant import BenchPlant
from maya_un.controller import watchdog_program
from maya_un.errors import GuardBlocked

USERS = "#A\r\nPRA=1000;BGA\r\nAMA\r\nEN\r\n"


def lines(program: str) -> list[str]:
    return program.splitlines()


def test_empty_memory_holds_the_watchdog_alone() -> None:
    program = watchdog_program.merged("", 0.5)
    assert lines(program) == watchdog_program.text(0.5)
    assert program.endswith("\r\n")


def test_every_line_fits_the_controller() -> None:
    for seconds in (0.1, 0.5, 10.0, 500.0):
        for line in watchdog_program.text(seconds):
            assert len(line) <= LINE_LIMIT, line
            assert not line.startswith("#") or len(line) <= 8, line


def test_times_are_samples_of_a_1024th_of_a_second() -> None:
    program = watchdog_program.text(0.5)
    assert "mayaleft=mayabeat-TIME+512" in program
    assert "JP#MAYAOUT,(mayaleft<2)|(mayaleft>512)" in program


def test_watchdog_stands_after_the_users_program() -> None:
    program = watchdog_program.merged(USERS, 0.5)
    assert program.startswith(USERS)
    assert lines(program)[4:] == watchdog_program.text(0.5)
    span = watchdog_program.span(program)
    assert span is not None
    assert lines(program)[span.start] == "#MAYAGRD"
    assert span.stop == len(lines(program))


def test_only_configured_axes_are_stopped() -> None:
    assert "STABC" in watchdog_program.text(0.5)
    assert "STBD" in watchdog_program.text(0.5, "BD")
    assert not any(line == "ST" for line in watchdog_program.text(0.5))


@pytest.mark.parametrize("before", [0.25, 0.5, 2.0])
def test_older_watchdog_is_replaced(before: float) -> None:
    program = watchdog_program.merged(watchdog_program.merged(USERS, before), 0.5)
    assert program == watchdog_program.merged(USERS, 0.5)
    assert watchdog_program.without(program) == USERS


def test_line_ends_do_not_matter() -> None:
    assert watchdog_program.merged(USERS.replace("\r\n", "\r"), 0.5) == watchdog_program.merged(USERS, 0.5)


@pytest.mark.parametrize(
    ("program", "what"),
    [
        ("#LIMSWI\nRE\n", "JS#MAYALIM"),
        ("#POSERR\nMOA\nRE\n", "JS#MAYAERR"),
        ("#LIMSWI\nRE\n#OTHER\nJS#MAYALIM\nEN\n", "JS#MAYALIM"),
        ("#LIMSWI2\nJS#MAYALIM\nEN\n#LIMSWI\nRE\n", "JS#MAYALIM"),
        ("#LIMSWI\n'JS#MAYALIM\nRE\n", "JS#MAYALIM"),
        ("#MAYALIM\nEN\n", "#MAYALIM"),
        ("#MAYAX\nEN\n", "#MAYAX"),
        ("#A\nXQ#B,7\nEN\n", "thread 7"),
        ("#A\nXQ 3, 7\nEN\n", "thread 7"),
    ],
)
def test_foreign_program_is_refused_with_advice(program: str, what: str) -> None:
    with pytest.raises(GuardBlocked, match=what):
        watchdog_program.merged(program, 0.5)


def test_program_that_calls_ours_keeps_its_subroutine() -> None:
    program = watchdog_program.merged("#LIMSWI\nJS#MAYALIM\nMG_SCA\nRE\n", 0.5)
    assert [line for line in lines(program) if line.startswith("#LIMSWI")] == ["#LIMSWI"]
    assert [line for line in lines(program) if line.startswith("#POSERR")] == ["#POSERR"]


def test_memory_without_a_watchdog_has_no_lines_of_it() -> None:
    assert watchdog_program.span(USERS) is None
    assert watchdog_program.without(USERS) == USERS


def test_users_lines_after_the_watchdog_stay() -> None:
    more = "'mine\r\n#B\r\nSB2\r\nEN\r\n"
    program = watchdog_program.merged(watchdog_program.merged(USERS, 0.25) + more, 0.5)
    assert program == watchdog_program.merged(USERS + more, 0.5)


def test_lines_after_the_watchdog_do_not_belong_to_it() -> None:
    span = watchdog_program.span(watchdog_program.merged(USERS, 0.5) + "#B\r\nEN\r\n")
    assert span == watchdog_program.span(watchdog_program.merged(USERS, 0.5))


def test_watchdog_cut_off_anywhere_is_replaced() -> None:
    whole = watchdog_program.merged(USERS, 0.5)
    for end in range(len(USERS) + len("'Maya guard"), len(whole)):
        assert watchdog_program.merged(whole[:end], 0.5) == whole


def test_changed_watchdog_is_left_alone() -> None:
    changed = watchdog_program.merged(USERS, 0.5).replace("WT20,1", "WT2000,1")
    with pytest.raises(GuardBlocked, match="'Maya guard 512 samples"):
        watchdog_program.merged(changed, 0.5)


@pytest.mark.parametrize("own", ["", "#LIMSWI\nJS#MAYALIM\nRE\n", "#POSERR\nJS#MAYAERR\nRE\n"])
def test_watchdog_is_recognised_with_any_settings(own: str) -> None:
    program = watchdog_program.merged(own, 0.5, "ABD")
    assert watchdog_program.without(program).splitlines() == own.splitlines()


def test_watchdog_survives_the_wrap_of_time() -> None:
    """TIME counts to 2^31 - 1 and goes on at -2^31, after 24 days."""
    machine = VirtualDmc(BenchPlant())
    handle = machine.connect()
    assert handle is not None
    now = 2.0**31 / 1024.0 - 5.0
    program = "".join(f"{line}\r" for line in watchdog_program.text(0.5))
    machine.receive(handle, f"DL\r{program}\\mayabeat=TIME;mayaout=0;XQ#MAYAGRD,7\r".encode(), now)
    times: list[float] = []
    for _ in range(400):
        now += 0.025
        answer = machine.receive(handle, b"mayabeat=TIME\rMG_XQ7,mayaout,TIME\r", now)
        line, out, time = map(float, answer.decode().strip(":\r\n").split())
        assert (line > 0, out) == (True, 0.0), answer
        times.append(time)
    assert times[0] > 0 > times[-1]
    assert machine.receive(handle, b"MG mayaout\r", now + 0.52) == b" 1.0000\r\n:"
