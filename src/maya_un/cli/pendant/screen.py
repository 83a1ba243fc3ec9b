"""The pendant on a screen: the display, the keys, and an input line for the name of a pose."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import Callable
from math import hypot
from typing import TypeAlias

from prompt_toolkit.application import Application
from prompt_toolkit.buffer import Buffer
from prompt_toolkit.filters import Condition
from prompt_toolkit.formatted_text import FormattedText
from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent
from prompt_toolkit.layout import ConditionalContainer, HSplit, Layout, VSplit, Window
from prompt_toolkit.layout.controls import BufferControl, FormattedTextControl
from prompt_toolkit.styles import Style

from dmc41x3.cli.signals import on_end
from dmc41x3.i18n import translate
from maya_un.cli import output
from maya_un.cli.client import ServiceClient
from maya_un.cli.configure import configuration
from maya_un.cli.pendant.session import MOVES, STEPS, KeyStep, PendantSession
from maya_un.cli.settings import OutputSettings
from maya_un.cli.units import OutputUnits, units_of
from maya_un.cli.words import mode_word
from maya_un.client import requests
from maya_un.errors import translated
from maya_un.kinematics.workspace import Workspace
from maya_un.values import Joints, Point

Piece: TypeAlias = tuple[str, str]
"""A style and a text."""

WARN = 0.02
"""A limit nearer than this [m] is highlighted."""

SHOWN = 3
"""Maximum number of limits shown."""

_ALIKE = {"idle": "", "moving": "class:moving", "homing": "class:moving", "stopping": "class:moving"}


def drawn(session: PendantSession, language: str, units: OutputUnits) -> list[Piece]:
    """Return all text except the keys: mode and step, the gripper position, the nearest limits, the notes."""
    pieces: list[Piece] = [
        ("class:head", "Maya   "),
        *_mode(session, language),
        ("", f"   {_step(STEPS[session.step], units)}\n\n"),
    ]
    pieces += _position(session, language, units)
    pieces += _limits(session, language, units)
    pieces.append(("", "\n"))
    pieces += [("class:note", f"{note}\n") for note in session.notes]
    return pieces


def _mode(session: PendantSession, language: str) -> list[Piece]:
    if session.trouble:
        return [("class:trouble", session.trouble)]
    if not session.status:
        return []
    state = session.status["state"]
    mode = [(_ALIKE.get(state["mode"], "class:trouble"), mode_word(state["mode"], language))]
    if (fault := state["fault"]) is not None:
        mode.append(("class:trouble", f"  {translated(fault['code'], fault['message'], language)}"))
    return mode


def _step(step: KeyStep, units: OutputUnits) -> str:
    return f"± {units.length(step.length)} / {units.angle(step.angle)}"


def _position(session: PendantSession, language: str, units: OutputUnits) -> list[Piece]:
    if not session.status:
        return []
    joints, point = session.joints, session.status["state"]["point"]
    if joints is None or point is None:
        return [("", f"{translate('position unknown until homed', language)}\n\n")]
    rows = zip(_joint_lines(joints, units), _place_lines(Point(*point), units), strict=True)
    return [("", "".join(f"  {place:<20} {joint}\n" for joint, place in rows) + "\n")]


def _place_lines(point: Point, units: OutputUnits) -> list[str]:
    named = zip("xyzr", (*point, hypot(point.x, point.y)), strict=True)
    return [f"{name} {units.length(value):>12}" for name, value in named]


def _joint_lines(joints: Joints, units: OutputUnits) -> list[str]:
    return [*(f"{axis} {units.joint(axis, value):>12}" for axis, value in joints._asdict().items()), ""]


def _limits(session: PendantSession, language: str, units: OutputUnits) -> list[Piece]:
    nearest = session.nearest()
    if not nearest:
        return []
    pieces: list[Piece] = [("", f"{translate('nearest limits:', language)} ")]
    for distance in nearest[:SHOWN]:
        pieces += [("class:near" if distance.rank < WARN else "", distance.text(units)), ("", "   ")]
    return [*pieces, ("", "\n")]


_STYLE = Style.from_dict(
    {
        "head": "bold",
        "moving": "ansigreen bold",
        "near": "ansiyellow bold",
        "note": "ansicyan",
        "trouble": "ansired bold",
        "keys": "ansibrightblack",
    }
)


def jog(settings: OutputSettings) -> int:
    """Move the running robot by keys until a person ends the session; return the exit code.

    Raises `ServiceNotRunning`.
    """
    client = ServiceClient.find()
    client.ask(requests.health())
    return asyncio.run(_Pendant(client, settings).show())


class _Pendant:
    """A session, and the application that displays it."""

    def __init__(self, client: ServiceClient, settings: OutputSettings) -> None:
        self._language = settings.language
        self._units = units_of(settings)
        self._session = PendantSession(client, Workspace.of(configuration(settings)), settings.language)
        self._naming = False
        self._name = Buffer(multiline=False, accept_handler=self._named)
        self._app: Application[int] = Application(
            layout=self._layout(),
            key_bindings=self._keys(),
            style=_STYLE,
            full_screen=True,
            refresh_interval=0.1,
        )

    async def show(self) -> int:
        """Display the session until it is ended; a running step is then stopped."""
        watching = asyncio.create_task(self._session.watch())
        try:
            with on_end(lambda: self._end(output.DONE), signal.SIGTERM):
                return await self._app.run_async(handle_sigint=False)
        finally:
            watching.cancel()
            await asyncio.wait({watching})
            await self._session.close()

    def _layout(self) -> Layout:
        def text() -> FormattedText:
            return FormattedText(drawn(self._session, self._language, self._units))

        asked = VSplit(
            [
                Window(
                    FormattedTextControl(
                        translate("Name of this pose (! after it replaces; Esc cancels): ", self._language)
                    ),
                    dont_extend_width=True,
                    height=1,
                ),
                Window(BufferControl(self._name), height=1),
            ]
        )
        keys = Window(
            FormattedTextControl(
                [
                    (
                        "class:keys",
                        translate(
                            "x y z r a b c  forward   X Y Z R A B C  back   arrows x, y   PgUp PgDn z   1 2 3  step\n"
                            "SPACE  STOP   t  teach a pose   q  end",
                            self._language,
                        ),
                    )
                ]
            ),
            height=2,
        )
        picture = Window(FormattedTextControl(text, focusable=True, show_cursor=False), wrap_lines=True)
        return Layout(HSplit([picture, ConditionalContainer(asked, Condition(lambda: self._naming)), keys]), picture)

    def _keys(self) -> KeyBindings:
        keys = KeyBindings()
        moving = Condition(lambda: not self._naming)
        for key, (axis, direction) in MOVES.items():
            keys.add(key, filter=moving)(self._mover(axis, direction))
        for key in STEPS:
            keys.add(key, filter=moving)(self._chooser(key))
        keys.add("t", filter=moving)(self._ask)
        keys.add("q", filter=moving)(lambda _: self._end(output.DONE))
        keys.add("escape", filter=~moving, eager=True)(self._leave)
        keys.add("space", eager=True)(lambda _: self._session.stop())
        keys.add("c-d")(lambda _: self._end(output.DONE))
        keys.add("c-c")(lambda _: self._end(output.INTERRUPTED))
        return keys

    def _mover(self, axis: str, direction: int) -> Callable[[KeyPressEvent], None]:
        return lambda _: self._session.move(axis, direction)

    def _chooser(self, key: str) -> Callable[[KeyPressEvent], None]:
        def choose(event: KeyPressEvent) -> None:
            self._session.step = key

        return choose

    def _ask(self, event: KeyPressEvent) -> None:
        self._naming = True
        event.app.layout.focus(self._name)

    def _leave(self, event: KeyPressEvent) -> None:
        self._name.reset()
        self._naming = False
        event.app.layout.focus_previous()

    def _named(self, buffer: Buffer) -> bool:
        """Teach the pose with the typed name; a trailing `!` replaces an existing pose."""
        text = buffer.text.strip()
        if text:
            self._session.teach(text.removesuffix("!"), replacing=text.endswith("!"))
        self._naming = False
        self._app.layout.focus_previous()
        return False

    def _end(self, code: int) -> None:
        if self._app.is_running:
            self._app.exit(result=code)
