"""Shared by the tests of the servers."""

from __future__ import annotations

import logging

import pytest


@pytest.fixture(autouse=True)
def log_is_captured(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let caplog receive our log: where a service has kept its log before, the root logger gets none of it."""
    monkeypatch.setattr(logging.getLogger("maya_un"), "propagate", True)
