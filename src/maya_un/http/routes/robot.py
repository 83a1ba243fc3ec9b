"""Routes that move the robot, stop it or change its speed."""

from __future__ import annotations

from typing import Annotated

from fastapi import Query, Response

from maya_un.errors import (
    Busy,
    CannotPause,
    ControllerMoves,
    ControllerOwned,
    Faulted,
    NotConnected,
    NothingToRecover,
    NotHomed,
    NotPaused,
    PathRefused,
    Stopped,
    UnknownName,
    Unreachable,
)
from maya_un.http.exchange import answer, sent
from maya_un.http.request_context import Ask
from maya_un.http.routing import AT_REST, HURRY, LONGEST_MOTION, Routes
from maya_un.schema.bodies import (
    Aborted,
    JogBy,
    JogHold,
    JogRelease,
    JogVector,
    Recovered,
    Released,
    Resumed,
    Speed,
    kind_of_jog,
)
from maya_un.schema.robot import HeldJog, Jogged, SteeredJog
from maya_un.service.access.operations import Operation
from maya_un.values import StopReport

TakeOver = Annotated[bool, Query(description="claim the controller from the program that owns it, if the axes rest")]
_TAG = "moving"

AnyJog = Annotated[
    JogBy | JogHold | JogVector | JogRelease, sent(JogBy, JogHold, JogVector, JogRelease, choose=kind_of_jog)
]
SpeedBody = Annotated[Speed, sent(Speed)]

_JOGS = {
    "by a distance": {"axis": "r", "distance": 0.02},
    "while a key is held": {"axis": "r", "direction": 1, "hold": True, "press": "7f3a-12"},
    "while a stick is held": {"vector": [0.3, -0.4, 0.0], "hold": True, "press": "7f3a-12"},
    "let go": {"hold": False, "press": "7f3a-12"},
}
_NO_MOTION = (UnknownName, NotConnected, Faulted, NotHomed, Busy, Stopped, Unreachable, PathRefused)


def add_moving(routes: Routes) -> None:
    """Add the routes for jog, stop, abort, pause, resume, speed and recover."""

    @routes.add(
        "POST",
        "/v1/jog",
        Operation.JOG,
        tag=_TAG,
        gives=Jogged | HeldJog | SteeredJog | Released,
        refuses=_NO_MOTION,
        examples=_JOGS,
        patience=LONGEST_MOTION,
    )
    async def jog(ask: Ask, body: AnyJog) -> Response:
        """Jog along one axis by a `distance`; the response comes at the end of the motion.

        With `hold` true, jog along the axis or along `vector` while the request is repeated at least twice a second.
        `hold` false ends this jog. `press` names one press of the key: after its end, a request of the same press that
        arrives late moves nothing.
        """
        if isinstance(body, JogBy):
            how = body
            moved = ask(lambda service: service.jog(how.axis, how.distance, speed=how.speed, clip=how.clip))
            return answer(await moved)
        if isinstance(body, JogHold):
            held = body
            moving = ask(
                lambda service: service.jog_hold(held.axis, held.direction, speed=held.speed, press=held.press)
            )
            return answer(await moving)
        if isinstance(body, JogVector):
            steered = body
            return answer(await ask(lambda service: service.jog_vector(steered.vector, press=steered.press)))
        released = body.press
        await ask(lambda service: service.jog_release(released))
        return answer(Released())

    @routes.add("POST", "/v1/stop", Operation.STOP, tag=_TAG, gives=StopReport, refuses=(NotConnected,), patience=HURRY)
    async def stop(ask: Ask) -> Response:
        """Stop the robot on its path.

        Return the time and the distance to rest. If jobs wait, pause the queue.
        """
        return answer(await ask(lambda service: service.stop()))

    @routes.add("POST", "/v1/abort", Operation.ABORT, tag=_TAG, gives=Aborted, refuses=(NotConnected,), patience=HURRY)
    async def abort(ask: Ask) -> Response:
        """Stop without deceleration.

        The motors may go off; `recover` switches them on again.
        """
        await ask(lambda service: service.abort())
        return answer(Aborted())

    pausing = (NotConnected, Faulted, CannotPause)

    @routes.add("POST", "/v1/pause", Operation.PAUSE, tag=_TAG, gives=StopReport, refuses=pausing, client="pause")
    async def pause(ask: Ask) -> Response:
        """Stop on the path and hold all motion until `resume`.

        Return the time and the distance to rest.
        """
        return answer(await ask(lambda service: service.pause()))

    @routes.add(
        "POST",
        "/v1/resume",
        Operation.RESUME,
        tag=_TAG,
        gives=Resumed,
        refuses=(NotConnected, NotPaused),
        client="resume",
    )
    async def resume(ask: Ask) -> Response:
        """Resume motion after a pause."""
        await ask(lambda service: service.resume())
        return answer(Resumed())

    @routes.add(
        "POST", "/v1/speed", Operation.SPEED, tag=_TAG, gives=Speed, examples={"half": {"ratio": 0.5}}, client="speed"
    )
    async def speed(ask: Ask, body: SpeedBody) -> Response:
        """Scale the speed of all motion by `ratio` (0.01 to 1), also of the running motion."""
        await ask(lambda service: service.speed(body.ratio))
        return answer(body)

    recovering = (NotConnected, NothingToRecover, ControllerOwned, ControllerMoves)

    @routes.add(
        "POST",
        "/v1/recover",
        Operation.RECOVER,
        tag=_TAG,
        gives=Recovered,
        refuses=recovering,
        client="recover",
        patience=AT_REST,
    )
    async def recover(ask: Ask, take_over: TakeOver = False) -> Response:
        """Clear a fault after its cause is removed. The robot does not move.

        If another program owns the controller, the request is refused (1030 ControllerOwned). With `take_over`, Maya
        takes the controller from this program; this is refused while axes move (1032).
        """
        await ask(lambda service: service.recover(take_over=take_over))
        return answer(Recovered())
