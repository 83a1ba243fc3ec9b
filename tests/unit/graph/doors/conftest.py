"""What the tests of doors share."""

from __future__ import annotations

import logging

import pytest


@pytest.fixture(autouse=True)
def log_is_heard(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let caplog hear the house: where a service has kept its log before, the root logger hears nothing of it."""
    monkeypatch.setattr(logging.getLogger("maya_un"), "propagate", True)
