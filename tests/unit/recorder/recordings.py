"""Recordings made up for tests."""

from __future__ import annotations

from dmc41x3.wire.transcript import WirePiece
from maya_un.config import Config
from maya_un.events import LimitHit, PhaseBegun
from maya_un.recorder.recording import Header, Recording, RecordingOrigin, SavingCause, Software, TwinSource
from maya_un.values import Joints, Mode, Notice, Point, Progress, State

UTC = 1_795_289_120_339_000_000
"""2026-11-21T19:25:20.339Z, in ns."""

TWIN = TwinSource(3, {"height": 2.35}, (1.0, 1.5, 1.5), {"cube": (0.4, 1.2, 0.4)}, 0.5)


def header(reason: str = "limit", *, utc: int = UTC, whole: float = 90.0, complete: bool = True) -> Header:
    origin = RecordingOrigin.of(Config(), "sim", speed=1.0, twin=TWIN)
    software = Software("0.1.0", "3.11.2", "Linux 6.1", "x86_64", 2)
    cause = SavingCause(7, "limit", 2301, "Axis b met its forward limit switch.")
    return Header(reason, 100.0, utc, whole, complete, "DMC4133 Rev 1.3k", origin, software, cause)


def state(time: float, *, homed: bool = True, fault: Notice | None = None) -> State:
    return State(
        time=time,
        mode=Mode.MOVING if fault is None else Mode.FAULT,
        homed=homed,
        counts=(6378, 1_500_000, 1_300_000),
        joints=Joints(0.3, 1.5, 1.3) if homed else None,
        point=Point(0.1, 1.0 / 3.0, 0.4) if homed else None,
        velocity=(0.0, -0.045, 0.01),
        moving=True,
        motors_on=(True, True, False),
        forward_limit=(False, True, False),
        reverse_limit=(False, False, True),
        stop_code=(1, 2, 100),
        gripper_closed=True,
        progress=Progress("down", 1.5, 4.25),
        fault=fault,
        override=0.5,
    )


RECORDING = Recording(
    header(),
    (state(90.0, homed=False), state(95.1), state(99.9, fault=Notice(2301, "Axis b met its forward limit switch."))),
    (
        PhaseBegun("down", seq=6, time=95.0),
        LimitHit("Axis b …", seq=7, time=95.1, code=2301, more={"axis": 1, "far": 0.5, "no": None}),
    ),
    (
        WirePiece(90.0, 1, "client", b"", "open"),
        WirePiece(90.0, 1, "client", b"MG TIME\r"),
        WirePiece(90.001, 1, "controller", b" 5.0000\r\n:"),
        WirePiece(95.05, 1, "controller", b"\xcd\xc1\xd9\xc1\x8d\x8a"),
        WirePiece(95.1, 1, "client", b"BGA\r"),
        WirePiece(95.102, 1, "controller", b"?"),
        WirePiece(99.0, 2, "controller", bytes(range(256))),
        WirePiece(99.9, 1, "client", b"TP\r"),
        WirePiece(100.0, 1, "controller", b"", "end"),
    ),
)
