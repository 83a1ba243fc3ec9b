"""The tools of `maya dmc` as processes: ended by Ctrl-C, on a screen, and one after the other."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

from scripts.tmux import pane
from tests.system.processes import MAYA, done, running

pytestmark = pytest.mark.system


def test_a_capture_of_a_foreign_client_replays_without_a_difference(tmp_path: Path) -> None:
    file = tmp_path / "w.jsonl"
    with running(f"dmc capture sim --listen 0 --out {file}") as between:
        address = between.until("Listening on").split()[2]
        slow = "SPA=20"  # so that a delay of a second moves the axis by less than may differ
        assert done(f"dmc send {address} ID SHA {slow} PRA=1000 BGA QR")[0] == 0
        between.send(signal.SIGINT)
        assert between.end()[0] == 0
    code, said = done(f"dmc replay {file}")
    assert (code, said) == (0, "6 commands; 0 answers differ from the recording.\n")
    file.write_text(file.read_text(encoding="utf-8").replace("4103", "4105"), encoding="utf-8")
    file.write_text(file.read_text(encoding="utf-8").replace('"data": ":"', '"data": "?"'), encoding="utf-8")
    code, said = done(f"dmc replay {file}")
    assert code == 1
    assert "'SHA': '?' became ':'" in said


def test_a_program_that_runs_is_not_replaced(tmp_path: Path) -> None:
    file = tmp_path / "loop.dmc"
    file.write_text("#A\nWT500\nJP#A\n", encoding="ascii")
    with running("dmc serve --port 0") as twin:
        address = twin.until("127.0.0.1:")
        assert done(f"dmc download {address} {file} --run A")[0] == 0
        code, said = done(f"dmc download {address} {file}")
        assert (code, "error 2110" in said) == (1, True)
        assert done(f"dmc send {address} HX")[0] == 0
        assert done(f"dmc download {address} {file}")[0] == 0


@pytest.mark.waits("1 s in which a twin at real speed is recorded")
def test_ctrl_c_ends_a_recording_and_keeps_it(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    with running("dmc serve --port 0") as twin:
        address = twin.until("127.0.0.1:")
        with running(f"dmc watch {address} _IA2 --rate 20 --json") as beside:
            beside.until('"_IA2": 7.0')
            with running(f"dmc scope {address} --channels _TPA --for 3600 --csv {file}") as recording:
                beside.until('"_IA2": 6.0')  # it has a handle
                for _ in range(20):  # one second in which it records
                    beside.until("_IA2")
                recording.send(signal.SIGINT)
                code, said = recording.end()
    assert code == 0
    assert said.endswith(f"a second: {file}\n")
    assert len(file.read_text(encoding="utf-8").splitlines()) > 10


def test_watch_is_a_table_on_a_screen() -> None:
    with pane([MAYA, "dmc", "watch", "sim", "_TPA", "_TTB"], width=80, height=24) as shown:
        picture = shown.until("_TTB")
        assert [word for word in ("counts", "unit", "value") if word in picture] == ["counts", "unit", "value"]
        shown.press("C-c")
        assert shown.ended() == 0


@pytest.mark.parametrize("bad", ["#A\nMG 2\n#A\nEN\n", "#TOOLONGALABEL\nEN\n"])
def test_program_that_the_controller_refuses_leaves_the_one_before(tmp_path: Path, bad: str) -> None:
    good, new, back = tmp_path / "good.dmc", tmp_path / "new.dmc", tmp_path / "back.dmc"
    good.write_text("REM said on the host\n#A\n\tMG 1;'a tab\nEN\n", encoding="ascii")
    new.write_text(bad, encoding="ascii")
    with running("dmc serve --port 0") as twin:
        address = twin.until("127.0.0.1:")
        code, said = done(f"dmc download {address} {good}")
        assert (code, said.count("left out 1 line"), said.count("tabs by blanks in 1 line")) == (0, 1, 1)
        code, said = done(f"dmc download {address} {new}")
        assert (code, "Duplicate or bad label" in said, "Traceback" in said) == (1, True, False)
        assert done(f"dmc upload {address} {back}")[0] == 0
    assert back.read_text(encoding="ascii") == "#A\n MG 1;'a tab\nEN\n"
