"""Notebook views of the messages."""

from __future__ import annotations

import re
import sys
from dataclasses import replace
from math import radians
from types import SimpleNamespace
from typing import Any

import pytest

from maya_un.client import notebook
from maya_un.schema.jobs import JobReport, PauseReason, QueueMode, QueueView, StepResult, TaskState
from maya_un.schema.previews import Distance, JobPreview, Reach, Refusal, StepPreview
from maya_un.schema.robot import Status
from maya_un.values import Joints, Limit, Mode, Notice, Point, State
from tests.unit.client.test_plans import LINE
from tests.unit.client.test_streaming import STATE

STEP = StepResult(1, "steps.0", "pick <left>", TaskState.FAILED, 2101, "no", 4.0, 4.25, None, None)
HERE = replace(STATE, joints=Joints(radians(30.0), 1.5, 1.25), point=Point(0.5, 1.2, 0.4))


def cells(html: str) -> list[str]:
    """Return what stands in the cells of a table, in order."""
    return re.findall(r"<t[hd]\b[^>]*>(.*?)</t[hd]>", html)


def test_state_is_shown_in_degrees_and_millimetres() -> None:
    shown = cells(notebook.state(HERE))
    assert shown[:8] == [
        "mode", "idle", "homed", "yes", "joints", "a 30.00°, b 1500.0 mm, c 1250.0 mm",
        "gripper point", "x 500.0 mm, y 1200.0 mm, z 400.0 mm",
    ]  # fmt: skip


def test_a_state_before_homing_and_in_a_fault() -> None:
    fault = replace(STATE, mode=Mode.FAULT, homed=False, fault=Notice(2303, "The abort input is active."), override=0.5)
    shown = cells(notebook.state(fault))
    assert "unknown until homed" in shown
    assert "50%" in shown
    assert shown[-2:] == ["fault 2303", "The abort input is active."]


def test_a_report_is_a_table_of_its_steps_and_nothing_in_it_is_html() -> None:
    report = JobReport(7, "<b>", TaskState.FAILED, 2101, "It <is> far.", 4.0, None, None, None, (STEP,), {}, (), LINE)
    html = notebook.report(report)
    assert "Job 7, &lt;b&gt;: failed (2101)" in html
    assert cells(html)[5:] == ["1", "pick &lt;left&gt;", "failed (2101)", "4.0", "4.2"]
    assert "It &lt;is&gt; far." in html


def test_preview_shows_the_duration_or_the_refusal() -> None:
    step = StepPreview(1, "steps.0", "pick left", 12.3456, (), 0.4, 0.9, None)
    good = notebook.preview(JobPreview(12.3456, 0.4, 0.9, (step,), None))
    assert "12.3 s" in good
    assert cells(good)[4:] == ["1", "pick left", "12.3", "0.400"]
    refusal = Refusal(2, "steps.1", "place tray", Notice(2101, "Too far."))
    assert "Step 2, place tray: Too far. (2101)" in notebook.preview(JobPreview(12.3, 0.4, 0.9, (step,), refusal))


def test_queue_shows_running_jobs_before_waiting_ones() -> None:
    running = replace(LINE, id=6, state=TaskState.RUNNING, done=1, steps=3, eta=12.0)
    shown = notebook.queue(QueueView(QueueMode.PAUSED, PauseReason.STOP, "ana", "", running, (LINE,), {}, None, None))
    assert "The queue is paused (stop, by ana)" in shown
    assert cells(shown)[6:] == ["6", "x", "running", "ana", "1/3", "12.0", "7", "x", "queued", "ana", "0/1", "–"]


def test_reach_shows_every_margin_or_the_reason() -> None:
    margins = (Distance(Limit.BOOM, "", radians(3.0), "rad"), Distance(Limit.ZONE, "rack", 0.25, "m"))
    there = Reach(True, Joints(0.0, 1.0, 1.5), None, Point(0.0, 1.2, 0.4), margins)
    assert cells(notebook.reach(there))[4:] == ["boom", "3.0°", "zone rack", "250 mm"]
    away = Reach(False, None, "it is too far", None)
    assert cells(notebook.reach(away)) == ["reachable", "no", "because", "it is too far", "nearest", "nothing"]


def test_in_a_notebook_messages_are_registered_with_its_formatters(monkeypatch: pytest.MonkeyPatch) -> None:
    known: dict[type, Any] = {}
    html = SimpleNamespace(for_type=known.__setitem__)
    shell = SimpleNamespace(display_formatter=SimpleNamespace(formatters={"text/html": html}))
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: shell))
    notebook.register()
    assert {State, Status, JobReport, JobPreview, QueueView, Reach} <= known.keys()
    assert known[State](STATE) == notebook.state(STATE)


def test_outside_a_notebook_nothing_is_registered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "IPython", raising=False)
    notebook.register()
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: None))
    notebook.register()
    assert "IPython" in sys.modules
