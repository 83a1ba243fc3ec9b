"""Errors become results, and results errors again."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from maya_ros.graph.outcome import error_of, failure, success, trigger_failure
from maya_ros.graph.protocol import Message
from maya_un.errors import MayaError, NotHomed, ServiceFailed, by_code


def test_success_is_no_error() -> None:
    assert error_of(success()) is None
    assert error_of({"success": True, "message": "anything"}) is None


@pytest.mark.parametrize("as_result", [failure, trigger_failure])
def test_error_keeps_its_code_and_sentence(as_result: Callable[[MayaError], Message]) -> None:
    error = error_of(as_result(NotHomed(command="maya home")))
    assert isinstance(error, NotHomed)
    assert str(error) == str(NotHomed(command="maya home"))


def test_every_code_is_known_on_the_other_side() -> None:
    for code, leaf in by_code().items():
        result = {"success": False, "code": str(code), "message": "a sentence: with a colon"}
        for said in (result, {"success": False, "message": f"{code}: a sentence: with a colon"}):
            error = error_of(said)
            assert type(error) is leaf
            assert str(error) == "a sentence: with a colon"


@pytest.mark.parametrize(
    "result",
    [
        {"success": False, "message": "it hurts"},
        {"success": False, "code": "", "message": "it hurts"},
        {"success": False, "code": "1", "message": "it hurts"},
        {"success": False, "code": "x", "message": "it hurts"},
        {"message": "it hurts"},
    ],
)
def test_error_without_our_code_is_a_failed_service(result: dict[str, object]) -> None:
    error = error_of(result, "/x")
    assert isinstance(error, ServiceFailed)
    assert error.details == {"service": "/x", "reason": "it hurts"}
    assert isinstance(error_of({}, "/x"), ServiceFailed)
