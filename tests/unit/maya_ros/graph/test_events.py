"""The texts of /maya_event, and how they are parsed."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_ros.graph.events import REFUSED, ControllerCondition, ReportedEvent, read, words
from maya_un.config import Config
from maya_un.errors import InvalidMessage
from maya_un.events import Event, GripperOpened, HomingBegun, MotionBegun
from maya_un.kinematics.workspace import Workspace
from maya_un.values import Joints, Mode, Notice
from tests.fakes import state_of

NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
RANGES = st.tuples(NUMBERS, NUMBERS)
STANDINGS = st.builds(
    ControllerCondition,
    st.sampled_from(Mode),
    st.booleans(),
    st.booleans(),
    st.booleans(),
    NUMBERS,
    st.none() | st.tuples(RANGES, RANGES, RANGES),
    st.none() | st.builds(Notice, st.integers(1, 9999), st.text()),
)
PLAIN = st.none() | st.booleans() | st.integers() | NUMBERS | st.text()


@given(st.sampled_from(words()), STANDINGS, st.integers(0, 9999), st.dictionaries(st.text(), PLAIN))
def test_published_event_is_read_back(
    word: str, standing: ControllerCondition, code: int, detail: dict[str, object]
) -> None:
    told = ReportedEvent(word, standing, code, detail)
    assert read(told.text()) == told
    assert told.text().split(" ")[0] == word
    assert "\n" not in told.text()


def test_it_is_one_word_a_space_and_one_compact_object() -> None:
    told = ReportedEvent(
        "idle", ControllerCondition(Mode.IDLE, homed=True, moving=False, gripper_closed=False), 0, {"to": "(1, 2)"}
    )
    assert told.text() == (
        'idle {"mode":"idle","homed":true,"moving":false,"gripper_closed":false,"override":1.0,'
        '"strokes":null,"fault":null,"code":0,"detail":{"to":"(1, 2)"}}'
    )


def test_the_words_are_those_of_the_interface_and_ours() -> None:
    manual = {
        "connected", "disconnected", "not_homed", "homing", "homed", "moving", "idle", "stopped", "gripper_open",
        "gripper_closed", "limit", "fault", "estop",
    }  # fmt: skip
    ours = set(words()) - manual
    assert manual <= set(words())
    assert {"paused", "resumed", "speed", "zones", "recovered", REFUSED} <= ours
    assert ours.isdisjoint({"phase", "job", "step", "lease", "queue", "storage", "recording"})
    assert {ControllerCondition(mode, False, False, False).word for mode in Mode} <= set(words())


def test_strokes_are_those_that_homing_measured() -> None:
    workspace = Workspace.of(Config())
    unhomed = ControllerCondition.of(state_of(None), workspace)
    assert (unhomed.mode, unhomed.homed, unhomed.strokes) == (Mode.NOT_HOMED, False, None)
    homed = ControllerCondition.of(state_of(Joints(0.0, 1.5, 1.3)), workspace)
    assert homed.strokes == (workspace.boom, workspace.line_b, workspace.line_c)


@pytest.mark.parametrize(
    ("event", "mode", "shown"),
    [
        (MotionBegun(), Mode.IDLE, Mode.MOVING),
        (HomingBegun(), Mode.NOT_HOMED, Mode.HOMING),
        (HomingBegun(), Mode.IDLE, Mode.HOMING),
        (MotionBegun(), Mode.PAUSED, Mode.PAUSED),
        (MotionBegun(), Mode.FAULT, Mode.FAULT),
        (GripperOpened(), Mode.IDLE, Mode.IDLE),
    ],
)
def test_motion_is_under_way_from_its_event(event: Event, mode: Mode, shown: Mode) -> None:
    standing = replace(ControllerCondition.of(state_of(None), Workspace.of(Config())), mode=mode)
    assert ReportedEvent.of(event, standing).standing.mode is shown


@pytest.mark.parametrize(
    "text",
    [
        "", "idle", "idle ", "idle {}", "idle []", "dance {}", "idle null", "idle {", "IDLE {}",
        'idle {"mode":"swimming","homed":true,"moving":false,"gripper_closed":false,"override":1.0,"strokes":null,'
        '"fault":null,"code":0,"detail":{}}',
        'idle {"mode":"idle","homed":true,"moving":false,"gripper_closed":false,"override":1.0,"strokes":[[1,2],[3]],'
        '"fault":null,"code":0,"detail":{}}',
        "idle " + "[" * 100_000,
    ],
)  # fmt: skip
def test_unknown_event_is_refused(text: str) -> None:
    with pytest.raises(InvalidMessage):
        read(text)


@given(st.text())
def test_any_text_is_read_or_refused(text: str) -> None:
    for whole in (text, f"idle {text}"):
        with suppress(InvalidMessage):
            read(whole)
