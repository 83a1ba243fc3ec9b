"""`maya dmc terminal` as a person has it before them: keys in, the picture out, a twin over TCP behind it."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from math import nan
from pathlib import Path

import pytest

from scripts.tmux import Pane, pane
from tests.system.processes import MAYA, running

pytestmark = pytest.mark.system

PROGRAM = """\
#HELLO
MG "hello from thread",count
count=count+1
EN
#WAIT
WT 100000
EN
"""


@pytest.fixture(scope="module")
def twin() -> Iterator[str]:
    with running("dmc serve --port 0") as process:
        yield process.until("127.0.0.1:")


@pytest.fixture
def terminal(twin: str) -> Iterator[Pane]:
    with at(twin) as shown:
        yield shown


@contextmanager
def at(address: str, width: int = 100, height: int = 30) -> Iterator[Pane]:
    """Run a terminal that is ready to be typed at; its history is the test's own."""
    command = [MAYA, "dmc", "terminal", address]
    place = {"XDG_STATE_HOME": os.environ["XDG_STATE_HOME"]}
    with pane(command, width=width, height=height, environment=place) as shown:
        shown.until("Ctrl-D end")
        yield shown


def position(picture: str, axis: str) -> float:
    """Return the position of an axis in the panel; NaN while the screen is redrawn without one."""
    found = re.search(rf"^{axis} +(-?\d+) ", picture, re.MULTILINE)
    return nan if found is None else int(found[1])


def moving(picture: str, axis: str) -> bool:
    return re.search(rf"^{axis} .* moving ", picture, re.MULTILINE) is not None


def stopped(picture: str, axis: str) -> bool:
    """Return whether the panel shows a text; while the screen is redrawn, there may be no panel."""
    return re.search(rf"^{axis} (?!.* moving ).*4 stopped by ST", picture, re.MULTILINE) is not None


def test_answers_are_the_controllers_own(terminal: Pane) -> None:
    terminal.until("DMC4133 Rev")
    terminal.enter("x=5;MG x*2;DP 7,-8,9;TP")
    picture = terminal.until(" 7, -8, 9")
    assert "\n 10.0000\n:\n 7, -8, 9\n" in picture


def test_a_refusal_shows_code_and_words_in_red(terminal: Pane) -> None:
    terminal.enter("MOA;BGA")
    terminal.until("? 20 Begin not valid with motor off")
    line = next(line for line in terminal.picture(colours=True).splitlines() if "? 20" in line)
    assert line.startswith("\x1b[1m\x1b[31m? 20")
    terminal.enter("tp")
    terminal.until("(commands are written in capitals: TP)")


def test_completion_offers_mnemonics_operands_variables_and_labels(terminal: Pane, tmp_path: Path) -> None:
    (tmp_path / "hello.dmc").write_text(PROGRAM, encoding="ascii")
    terminal.enter(":download hello.dmc")
    terminal.until("Downloaded: 7 lines")
    terminal.enter("count=3")
    terminal.type("XQ #H")
    terminal.until("#HELLO")
    terminal.press("Tab")
    terminal.until(": XQ #HELLO")
    terminal.press("C-c")
    terminal.type("MG cou")
    terminal.until("variable")
    terminal.press("Tab")
    terminal.until(": MG count")
    terminal.press("C-c")
    terminal.type("MG _TP")
    terminal.until("axis C")
    terminal.press("Tab", "Enter")
    terminal.until(": MG _TPA")


def test_help_is_next_to_the_line_and_on_a_page(terminal: Pane) -> None:
    terminal.type("SPA=")
    terminal.until("SP  ")
    terminal.press("C-c")
    terminal.enter("help BG")
    terminal.until_true(lambda picture: re.search("^BG  .+", picture, re.MULTILINE) is not None, "help on BG")
    terminal.enter("?SH")
    terminal.until_true(lambda picture: re.search("^SH  .+", picture, re.MULTILINE) is not None, "help on SH")


def test_the_panel_follows_a_moving_axis_and_a_key_stops_it(terminal: Pane) -> None:
    terminal.enter(":watch _TPC*2")
    terminal.enter("SHC;SPC=2000;PRC=-100000;BGC")
    first = terminal.until_true(lambda picture: moving(picture, "C"), "C moving")
    start = position(first, "C")
    terminal.until_true(lambda picture: position(picture, "C") < start - 300, "C further on")
    terminal.until_true(lambda picture: re.search(r"_TPC\*2 -\d+\.0000", picture) is not None, "what is watched")
    terminal.press("F12")
    terminal.until("Stopping C.")
    terminal.until_true(lambda picture: stopped(picture, "C"), "C at rest, stopped by ST")


def test_keys_clear_the_line_and_hide_the_axes(terminal: Pane) -> None:
    terminal.type("BGA")
    terminal.until(": BGA")
    terminal.press("C-c")
    terminal.until_true(lambda picture: ": BGA" not in picture, "an empty line")
    terminal.press("C-c")
    terminal.until("Ctrl-C stops nothing.")
    terminal.press("F2")
    terminal.until_true(lambda picture: "velocity" not in picture, "no panel")
    terminal.press("F2")
    terminal.until("velocity")


@pytest.mark.waits("1 s in which a program of a twin at real speed prints fifty lines")
def test_messages_of_programs_do_not_tear_the_line(terminal: Pane, tmp_path: Path) -> None:
    lines = ["#TALK", "n=0", "#L", 'MG "line",n', "n=n+1", "WT 20", "JP #L,n<50", "EN"]
    (tmp_path / "talk.dmc").write_text("\n".join(lines) + "\n", encoding="ascii")
    terminal.enter(":download talk.dmc")
    terminal.until("Downloaded: 8 lines")
    terminal.enter("XQ #TALK")
    for letter in "MG 1+2+3+4+5+6":
        terminal.type(letter)
    terminal.until("« line 49.0000")
    terminal.until(": MG 1+2+3+4+5+6")
    above, _, below = terminal.history().partition(": XQ #TALK\n")[2].rpartition("« line 49.0000\n")
    assert [line for line in above.splitlines() if line != ":"] == [f"« line {n}.0000" for n in range(49)]
    assert below.startswith(": MG 1+2+3+4+5+6\n")
    terminal.press("Enter")
    terminal.until(" 21.0000")


def test_program_is_downloaded_and_uploaded(terminal: Pane, tmp_path: Path) -> None:
    (tmp_path / "there.dmc").write_text(PROGRAM, encoding="ascii")
    terminal.enter(":download there.dmc")
    terminal.until("Downloaded: 7 lines")
    terminal.enter(":upload back.dmc")
    terminal.until("Uploaded: 7 lines")
    assert (tmp_path / "back.dmc").read_text(encoding="ascii") == PROGRAM


def test_recording_is_made_during_a_session(terminal: Pane, tmp_path: Path) -> None:
    terminal.enter(":scope _TPA,_TEA --rate 20 --for 0.5 --csv axes.csv")
    terminal.enter("MG 6*7")
    terminal.until(" 42.0000")
    terminal.until(" samples, ")
    table = (tmp_path / "axes.csv").read_text(encoding="utf-8")
    assert table.startswith("time [s],_TPA [counts],_TEA [counts]\n0.000000,")


def test_a_lost_link_is_plain_to_see_and_can_be_made_again() -> None:
    with running("dmc serve --port 0") as first:
        address = first.until("127.0.0.1:")
        with at(address) as terminal:
            first.kill()
            terminal.until("LINK LOST")
            terminal.enter("TP")
            terminal.until("Not sent: TP.")
            terminal.press("F12")
            terminal.until("NOT STOPPED")
            with running(f"dmc serve --port {address.rpartition(':')[2]}") as again:
                again.until("127.0.0.1:")
                terminal.press("F5")
                terminal.until_true(
                    lambda _: terminal.history().count(f"DMC4133 Rev 1.3k at {address}") == 2, "the controller again"
                )
                terminal.enter("MG 6*7")
                terminal.until(" 42.0000")


def test_it_fits_a_small_screen_and_remembers_lines(twin: str) -> None:
    with at(twin, width=80, height=24) as first:
        assert all(f"\n{axis} " in first.picture() for axis in "ABC")
        first.enter("MG 6*7")
        first.until(" 42.0000")
        first.press("C-d")
        assert first.ended() == 0
    with at(twin, width=80, height=24) as second:
        second.press("Up")
        second.until(": MG 6*7")
