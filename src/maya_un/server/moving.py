"""The paths that move the robot directly, or change how fast it moves: jog, pause, resume, speed."""

from __future__ import annotations

from typing import Any

from fastapi import FastAPI, Response

from maya_un.errors import InvalidRequest, InvalidValue
from maya_un.server.bridge import Bridge
from maya_un.server.exchange import Body, answer

_LONGEST = 1e9


def add_moving(app: FastAPI, bridge: Bridge) -> None:
    """Add the paths."""

    @app.post("/v1/jog")
    async def jog(body: Body) -> Response:
        """Move along one axis by a distance and answer at its end; or, held, for as long as it is said again."""
        if "hold" not in body:
            axis, distance, speed, clip = _jog(body)
            return answer(await bridge.call(lambda service: service.jog(axis, distance, speed=speed, clip=clip)))
        axis, direction, speed, hold = _held(body)
        if hold:
            return answer(await bridge.call(lambda service: service.jog_hold(axis, direction, speed=speed)))
        await bridge.call(lambda service: service.jog_release())
        return answer({"released": True})

    @app.post("/v1/pause")
    async def pause() -> Response:
        """Stop on the path and hold all motion; tell how long and how far it still goes."""
        return answer(await bridge.call(lambda service: service.pause()))

    @app.post("/v1/resume")
    async def resume() -> Response:
        """Go on after a pause."""
        await bridge.call(lambda service: service.resume())
        return answer({"resumed": True})

    @app.post("/v1/speed")
    async def speed(body: Body) -> Response:
        """Scale the speed of all motion, also of what is under way."""
        _require_keys(body, {"ratio"}, set())
        ratio = _number(body, "ratio")
        await bridge.call(lambda service: service.speed(ratio))
        return answer({"ratio": ratio})


def _jog(body: dict[str, Any]) -> tuple[str, float, float, bool]:
    _require_keys(body, {"axis", "distance"}, {"speed", "clip"})
    return _axis(body), _number(body, "distance"), _speed(body), _flag(body, "clip", default=True)


def _held(body: dict[str, Any]) -> tuple[str, int, float, bool]:
    hold = _flag(body, "hold", default=True)
    keys = {"axis", "direction"}
    _require_keys(body, keys if hold else set(), {"hold", "speed"} if hold else {"hold", "speed", *keys})
    if not hold:
        return "", 0, 1.0, False
    direction = body["direction"]
    if isinstance(direction, bool) or direction not in (1, -1):
        raise InvalidValue(key="direction", value=repr(direction), reason="it is 1 or -1")
    return _axis(body), int(direction), _speed(body), True


def _require_keys(body: dict[str, Any], needed: set[str], allowed: set[str]) -> None:
    for key in sorted(needed - set(body)):
        raise InvalidRequest(key=key, reason="it is missing")
    for key in sorted(set(body) - needed - allowed):
        raise InvalidRequest(key=key, reason="there is no such key")


def _axis(body: dict[str, Any]) -> str:
    axis = body["axis"]
    if not isinstance(axis, str):
        raise InvalidValue(key="axis", value=repr(axis), reason="it is a, b, c, x, y, z or r")
    return axis


def _number(body: dict[str, Any], key: str) -> float:
    value = body[key]
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < _LONGEST:
        raise InvalidValue(key=key, value=repr(value), reason="it is a finite number")
    return float(value)


def _speed(body: dict[str, Any]) -> float:
    speed = _number(body, "speed") if "speed" in body else 1.0
    if not 0.0 < speed <= 1.0:
        raise InvalidValue(key="speed", value=speed, reason="it must lie above 0 and at most at 1")
    return speed


def _flag(body: dict[str, Any], key: str, *, default: bool) -> bool:
    value = body.get(key, default)
    if not isinstance(value, bool):
        raise InvalidValue(key=key, value=repr(value), reason="it is true or false")
    return value
