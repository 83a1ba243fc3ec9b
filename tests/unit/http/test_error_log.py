from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from dmc41x3.loops import run_virtual
from maya_un.http.log import keep_quiet, log_path, written_down


@pytest.fixture(autouse=True)
def own_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))


def test_the_log_has_the_traceback_and_the_sentence_has_the_log() -> None:
    with pytest.raises(ZeroDivisionError) as caught:
        _ = 1 / 0
    sentence = str(written_down(caught.value))
    assert str(log_path()) in sentence
    assert "Traceback" not in sentence
    assert "Traceback" in log_path().read_text()


def test_unwritable_log_raises_no_second_error(tmp_path: Path) -> None:
    (tmp_path / "maya").write_text("in the way")
    assert "cannot be written" in str(written_down(ValueError("first")))


def test_half_a_character_is_written_down_too() -> None:
    assert "cannot be written" not in str(written_down(ValueError("\ud800")))
    assert "ud800" in log_path().read_text()


def test_error_of_an_unawaited_task_goes_to_the_log(capsys: pytest.CaptureFixture[str]) -> None:
    async def main() -> None:
        loop = asyncio.get_running_loop()
        keep_quiet(loop)
        loop.call_exception_handler({"message": "a task ended by a defect", "exception": ValueError("defect")})
        loop.call_exception_handler({"message": "words only"})

    run_virtual(main())
    assert capsys.readouterr() == ("", "")
    assert "defect" in log_path().read_text()
    assert "words only" in log_path().read_text()
