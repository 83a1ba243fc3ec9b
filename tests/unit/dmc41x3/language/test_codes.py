from __future__ import annotations

import pytest

from dmc41x3.language.codes import ERROR_TEXTS, STOP_TEXTS, ErrorCode, StopCode


@pytest.mark.parametrize("code", [code for code in ErrorCode if code is not ErrorCode.NONE])
def test_every_named_error_has_words(code: ErrorCode) -> None:
    assert ERROR_TEXTS[code]


@pytest.mark.parametrize("code", list(StopCode))
def test_every_named_stop_has_words(code: StopCode) -> None:
    assert STOP_TEXTS[code]


@pytest.mark.parametrize("text", [*ERROR_TEXTS.values(), *STOP_TEXTS.values()])
def test_words_fit_a_reply_line(text: str) -> None:
    assert text == text.strip()
    assert text.isascii()
    assert text.isprintable()


def test_numbers_that_other_code_relies_on() -> None:
    assert ErrorCode.BEGIN_MOTOR_OFF == 20
    assert ErrorCode.BEGIN_WHILE_RUNNING == 21
    assert ErrorCode.BEGIN_AT_LIMIT == 22
    assert ErrorCode.SEGMENT_TOO_SHORT == 30
    assert (StopCode.FORWARD_LIMIT, StopCode.REVERSE_LIMIT, StopCode.STOPPED) == (2, 3, 4)
    assert (StopCode.OFF_ON_ERROR, StopCode.SEQUENCE_RUNNING, StopCode.SEQUENCE_DONE) == (8, 100, 101)
