"""The picture of the pendant: styled pieces of text, made of what is known of the robot."""

from __future__ import annotations

from math import degrees, hypot
from typing import TypeAlias

from dmc41x3.i18n import translate
from maya_un.cli.pendant.keys import STEPS, KeyStep
from maya_un.cli.pendant.session import PendantSession
from maya_un.errors import translated
from maya_un.values import Joints, Point

Piece: TypeAlias = tuple[str, str]
"""A style and a text."""

WARN = 0.02
"""A limit nearer than this [m] is shown as one that is near."""

SHOWN = 3
"""How many of the limits are shown."""

_ALIKE = {"idle": "", "moving": "class:moving", "homing": "class:moving", "stopping": "class:moving"}


def drawn(session: PendantSession, language: str) -> list[Piece]:
    """Return everything but the keys: mode and step, where the gripper is, the nearest limits, the notes."""
    pieces: list[Piece] = [
        ("class:head", "Maya   "),
        *_mode(session, language),
        ("", f"   {_step(STEPS[session.step])}\n\n"),
    ]
    pieces += _position(session, language)
    pieces += _limits(session, language)
    pieces.append(("", "\n"))
    pieces += [("class:note", f"{note}\n") for note in session.notes]
    return pieces


def _mode(session: PendantSession, language: str) -> list[Piece]:
    if session.trouble:
        return [("class:trouble", session.trouble)]
    if not session.status:
        return []
    state = session.status["state"]
    mode = [(_ALIKE.get(state["mode"], "class:trouble"), state["mode"].replace("_", " "))]
    if (fault := state["fault"]) is not None:
        mode.append(("class:trouble", f"  {translated(fault['code'], fault['message'], language)}"))
    return mode


def _step(step: KeyStep) -> str:
    return f"± {step.length * 1e3:g} mm / {degrees(step.angle):g}°"


def _position(session: PendantSession, language: str) -> list[Piece]:
    if not session.status:
        return []
    joints, point = session.joints, session.status["state"]["point"]
    if joints is None or point is None:
        return [("", f"{translate('position unknown until homed', language)}\n\n")]
    rows = zip(_joint_lines(joints), _place_lines(Point(*point)), strict=True)
    return [("", "".join(f"  {place:<20} {joint}\n" for joint, place in rows) + "\n")]


def _place_lines(point: Point) -> list[str]:
    named = zip("xyzr", (*point, hypot(point.x, point.y)), strict=True)
    return [f"{name} {value * 1e3:9.1f} mm" for name, value in named]


def _joint_lines(joints: Joints) -> list[str]:
    lengths = (f"{name} {value * 1e3:9.1f} mm" for name, value in (("b", joints.b), ("c", joints.c)))
    return [f"a {degrees(joints.a):9.2f}°", *lengths, ""]


def _limits(session: PendantSession, language: str) -> list[Piece]:
    nearest = session.nearest()
    if not nearest:
        return []
    pieces: list[Piece] = [("", f"{translate('nearest limits:', language)} ")]
    for distance in nearest[:SHOWN]:
        pieces += [("class:near" if distance.rank < WARN else "", str(distance)), ("", "   ")]
    return [*pieces, ("", "\n")]
