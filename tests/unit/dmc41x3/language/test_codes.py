from __future__ import annotations

from dmc41x3.language.codes import ERROR_TEXTS, STOP_TEXTS, ErrorCode, StopCode


def test_every_named_error_has_words() -> None:
    assert [code for code in ErrorCode if code is not ErrorCode.NONE and not ERROR_TEXTS.get(code)] == []


def test_every_named_stop_has_words() -> None:
    assert [code for code in StopCode if not STOP_TEXTS.get(code)] == []


def test_words_fit_a_reply_line() -> None:
    for text in (*ERROR_TEXTS.values(), *STOP_TEXTS.values()):
        assert text == text.strip()
        assert text.isascii(), text
        assert text.isprintable(), text


def test_numbers_that_other_code_relies_on() -> None:
    assert ErrorCode.BEGIN_MOTOR_OFF == 20
    assert ErrorCode.BEGIN_WHILE_RUNNING == 21
    assert ErrorCode.BEGIN_AT_LIMIT == 22
    assert ErrorCode.SEGMENT_TOO_SHORT == 30
    assert (StopCode.FORWARD_LIMIT, StopCode.REVERSE_LIMIT, StopCode.STOPPED) == (2, 3, 4)
    assert (StopCode.OFF_ON_ERROR, StopCode.SEQUENCE_RUNNING, StopCode.SEQUENCE_DONE) == (8, 100, 101)
