"""The start of a replay, and the initial commands to its twin."""

from __future__ import annotations

from dataclasses import replace

import pytest

from dmc41x3.language.record import AxisRecord, AxisStatus, DataRecord, decode, encode
from dmc41x3.wire.framing import RecordReply
from dmc41x3.wire.transcript import WirePiece
from maya_un.cli.recordings.replay import ReplayScene, commands_before, forget_stop_codes, scene_of
from maya_un.config import Config
from maya_un.events import HomingBegun
from maya_un.recorder.exchanges import RecordedExchange
from maya_un.recorder.recording import Recording
from tests.unit.recorder.recordings import RECORDING, header, state

MOVING = AxisRecord(status=AxisStatus.MOVING, reference=50)
REST = DataRecord(
    axes=(
        AxisRecord(reference=6378, position=6377, user=7),
        AxisRecord(reference=1_500_000, user=1),
        AxisRecord(reference=1_300_000, status=AxisStatus.MOTOR_OFF),
    ),
    outputs=(0b1000_0001, *(0,) * 9),
)


def sent(time: float, text: str) -> WirePiece:
    return WirePiece(time, 1, "client", f"{text}\r".encode())


def received(time: float, data: bytes) -> WirePiece:
    return WirePiece(time, 1, "controller", data)


def record_exchange(time: float, record: DataRecord) -> list[WirePiece]:
    return [sent(time, "QR"), received(time + 0.001, encode(record) + b":")]


OPENING = [WirePiece(1.0, 1, "client", b"", "open"), sent(1.0, "SPA=1000"), received(1.0, b":")]
REST_OF_IT = [
    *record_exchange(90.0, replace(REST, axes=(MOVING, *REST.axes[1:]))),
    *record_exchange(90.1, REST),
    sent(90.2, "BGS"),
    received(90.2, b":"),
]
LATER = Recording(
    replace(header(whole=90.0, complete=False), opening=1.0),
    (state(89.9), state(90.1)),
    (),
    (*OPENING, *REST_OF_IT),
)


def machine(recording: Recording) -> Recording:
    origin = replace(recording.header.origin, twin=None)
    return replace(recording, header=replace(recording.header, origin=origin))


def test_a_twin_recorded_whole_begins_at_its_power_up() -> None:
    scene = scene_of(RECORDING)
    assert (scene.begin, scene.record, scene.opening, scene.lacks) == (0.5, None, (), ())
    assert scene.pieces == RECORDING.wire
    assert commands_before(scene, Config()) == b""


def test_another_begins_with_the_first_record_at_rest() -> None:
    scene = scene_of(LATER)
    assert scene.begin == pytest.approx(90.101)
    assert scene.record == REST
    assert scene.pieces == tuple(REST_OF_IT[-2:])
    assert scene.opening == tuple(OPENING)
    assert (scene.homed, scene.lacks) == (True, ())


def test_missing_data_is_reported() -> None:
    (machines,) = scene_of(machine(LATER)).lacks
    assert machines.startswith("The replay uses the friction")
    (opening,) = scene_of(replace(LATER, wire=tuple(REST_OF_IT))).lacks
    assert opening.startswith("The replay does not know the registers")
    unhomed = replace(LATER, states=(state(89.9, homed=False), state(90.1, homed=False)))
    (place,) = scene_of(unhomed).lacks
    assert place.startswith("The replay does not know the position of the machine")


def test_counts_have_lengths_after_a_later_homing() -> None:
    states = (state(90.0, homed=False), state(95.0))
    over = replace(LATER, states=states)
    assert scene_of(over).homed
    homing = replace(over, events=(HomingBegun(seq=1, time=92.0),))
    assert not scene_of(homing).homed


def test_without_rest_there_is_no_scene() -> None:
    with pytest.raises(ValueError, match="at rest"):
        scene_of(replace(LATER, wire=(*OPENING, *REST_OF_IT[:2])))


def test_twin_gets_the_state_of_the_controller() -> None:
    lines = commands_before(scene_of(LATER), Config()).decode().split("\r")
    assert lines == [
        "SPA=1000",
        "DP 6378,1500000,1300000",
        "SHAB",
        *("SB 1", "CB 2", "CB 3", "CB 4", "CB 5", "CB 6", "CB 7", "SB 8"),
        *("ZAA=7", "ZAB=1", "ZAC=0"),
        *("mayahome=7", "mayaendb=2260000", "mayaendc=2300000"),
        "",
    ]


def test_controller_state_before_the_first_command_is_known() -> None:
    """Its program and its variables; values that the host set itself are left out."""
    pieces = (
        *(sent(0.0, "UL"), received(0.0, b"#A\r\nEN\r\n\x1a:")),
        *(sent(0.1, "MG mayahome"), received(0.1, b" 12.0000\r\n:")),
        *(sent(0.2, "speed=5"), received(0.2, b":")),
        *(sent(0.3, "MG speed"), received(0.3, b" 5.0000\r\n:")),
        *(sent(0.4, "MG _TPA"), received(0.4, b" 1.0000\r\n:")),
        *(sent(0.5, "MG nothing"), received(0.5, b"?")),
    )
    scene = ReplayScene(0.0, pieces, (), REST, homed=False)
    text = commands_before(scene, Config()).decode()
    assert text.endswith("ZAC=0\rDL\r#A\rEN\r\\\rmayahome=12.0000\r")


def test_why_axes_stopped_before_is_forgotten_until_they_move() -> None:
    stopped = replace(REST, axes=tuple(replace(axis, stop_code=3) for axis in REST.axes))
    moving = replace(stopped, axes=(*stopped.axes[:2], MOVING))
    records = [stopped, moving, stopped]
    exchanges = [
        RecordedExchange(float(n), 1, "QR", RecordReply(encode(record)), None) for n, record in enumerate(records)
    ]
    exchanges.insert(1, RecordedExchange(0.5, 1, "TP", None, None))
    forget_stop_codes(exchanges)
    codes = [
        [axis.stop_code for axis in decode(one.reply.data).axes]
        for one in exchanges
        if isinstance(one.reply, RecordReply)
    ]
    assert codes == [[1, 1, 1], [1, 1, 0], [1, 1, 3]]
