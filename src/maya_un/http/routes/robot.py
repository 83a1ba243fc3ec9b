"""Routes that move the robot, stop it or change its speed."""

from __future__ import annotations

from typing import Annotated

from fastapi import Query, Response

from maya_un.errors import (
    Busy,
    CannotPause,
    ControllerMoves,
    ControllerOwned,
    DatumContradicted,
    DatumRefused,
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
    GuardedMove,
    JogBy,
    JogHold,
    JogRelease,
    JogVector,
    Recovered,
    Released,
    Resumed,
    Speed,
    StatedPose,
    kind_of_jog,
)
from maya_un.schema.robot import DatumView, HeldJog, Jogged, SteeredJog
from maya_un.service.access.operations import Operation
from maya_un.service.service import Service
from maya_un.values import Joints, StopReport

TakeOver = Annotated[bool, Query(description="claim the controller from the program that owns it, if the axes rest")]
_TAG = "moving"

AnyJog = Annotated[
    JogBy | JogHold | JogVector | JogRelease, sent(JogBy, JogHold, JogVector, JogRelease, choose=kind_of_jog)
]
SpeedBody = Annotated[Speed, sent(Speed)]
Stated = Annotated[StatedPose, sent(StatedPose)]
Guarded = Annotated[GuardedMove, sent(GuardedMove)]

_JOGS = {
    "by a distance": {"axis": "r", "distance": 0.02},
    "while a key is held": {"axis": "r", "direction": 1, "hold": True, "press": "7f3a-12"},
    "while a stick is held": {"vector": [0.3, -0.4, 0.0], "hold": True, "press": "7f3a-12"},
    "let go": {"hold": False, "press": "7f3a-12"},
}
_POSE = {"a pose": {"joints": [0.1, 1.5, 1.3]}}
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

        With `hold` true, jog along the axis or along `vector` while the request is repeated at intervals below 0.5 s.
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


def add_datum(routes: Routes) -> None:
    """Add the routes for the datum that a person gives to a robot that cannot find its position alone."""

    async def shown(service: Service) -> DatumView:
        return service.datum()

    @routes.add("GET", "/v1/datum", Operation.READ, tag=_TAG, gives=DatumView, client="datum")
    async def datum(ask: Ask) -> Response:
        """Return whether homing needs a person, and the datum that a person gave."""
        return answer(await ask(shown))

    giving = (NotConnected, Faulted, Busy, Unreachable)

    @routes.add(
        "POST",
        "/v1/datum",
        Operation.DATUM,
        tag=_TAG,
        gives=DatumView,
        refuses=giving,
        examples=_POSE,
        client="give_datum",
        patience=AT_REST,
    )
    async def give_datum(ask: Ask, body: Stated) -> Response:
        """Take these joints as the robot's present position. The robot does not move.

        The event `datum_given` names the caller. Until a second point confirms the datum, motion is slow, and stays
        away from the ends of the strokes and from high tensions.
        """
        await ask(lambda service: service.direct.give_datum(Joints(*body.joints), ask.caller))
        return answer(await ask(shown))

    @routes.add(
        "POST",
        "/v1/datum/confirm",
        Operation.DATUM,
        tag=_TAG,
        gives=DatumView,
        refuses=(NotConnected, Faulted, Busy, NotHomed, DatumRefused, DatumContradicted),
        examples=_POSE,
        client="confirm_datum",
        patience=AT_REST,
    )
    async def confirm_datum(ask: Ask, body: Stated) -> Response:
        """Compare the position of the robot with a second point. The robot does not move.

        If they agree within 20 mm and 2 degrees, all motion is allowed. If not, the robot is not homed any more.
        """
        await ask(lambda service: service.direct.confirm_datum(Joints(*body.joints), ask.caller))
        return answer(await ask(shown))

    @routes.add(
        "POST",
        "/v1/datum/move",
        Operation.DATUM,
        tag=_TAG,
        gives=Jogged,
        refuses=(NotConnected, Faulted, Busy, Stopped, DatumRefused),
        examples={"line b": {"axis": "b", "distance": -0.02}},
        client="guarded_move",
        patience=LONGEST_MOTION,
    )
    async def guarded_move(ask: Ask, body: Guarded) -> Response:
        """Move one axis of a robot that is not homed, slowly and at most 50 mm or 5 degrees.

        It ends early at an active limit switch. With `homing.torque_readings`, it also ends when a line that it
        shortens carries twice the load.
        """
        return answer(await ask(lambda service: service.direct.guarded_move(body.axis, body.distance)))
