"""The description of a failed service."""

from __future__ import annotations

import pytest

from maya_un.errors import ServiceFailed

ONCE = "The service /x failed: it is busy."


@pytest.mark.parametrize(
    "reason", ["it is busy", "it is busy.", ONCE, f"{ONCE} [4020]", f"The service /x failed: {ONCE}."]
)
def test_a_failed_service_says_its_sentence_once(reason: str) -> None:
    assert str(ServiceFailed(service="/x", reason=reason)) == ONCE


def test_a_failed_service_names_another_that_failed_behind_it() -> None:
    inner = str(ServiceFailed(service="/y", reason="it is busy"))
    assert str(ServiceFailed(service="/x", reason=inner)) == "The service /x failed: The service /y failed: it is busy."
