"""Commands that send one primitive or one motion to the running robot and wait for its end."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor, wait
from typing import Any

from dmc41x3.cli.signals import as_ctrl_c
from dmc41x3.i18n import marked, translate, translate_phrase
from maya_un.cli import output
from maya_un.cli.client import COMPUTED, ServiceClient
from maya_un.cli.progress import chosen
from maya_un.cli.report import STEP_KEYS
from maya_un.cli.settings import OutputSettings
from maya_un.cli.units import units_of
from maya_un.cli.waiting import INTERRUPTION, PATIENCE, animate, follow
from maya_un.client import requests
from maya_un.client.request import Request


def request(primitive: Mapping[str, object], settings: OutputSettings) -> int:
    """Let the running robot carry out a primitive; return the exit code. Ctrl-C and SIGTERM cancel it.

    Raises `ServiceNotRunning` and immediate refusals of the service.
    """
    client = ServiceClient.find()
    with chosen(settings) as display, as_ctrl_c():
        since = client.ask(requests.status())["last_event"]
        accepted = client.ask(requests.task(primitive), timeout=COMPUTED)
        report, interrupted = follow(client, accepted["id"], since, display, settings)
    step = report["steps"][0]
    if settings.json:
        output.emit({key: step[key] for key in STEP_KEYS})
    elif report["state"] == "done":
        output.say(translate("Done.", settings.language))
    return output.INTERRUPTED if interrupted else output.concluded(report, settings)


def jog(axis: str, distance: float, settings: OutputSettings) -> int:
    """Move the robot along an axis by `distance` (rad or m) and wait for the end; Ctrl-C and SIGTERM stop it."""
    return travel(requests.jog_by(axis, distance), settings)


def travel(move: Request[Any], settings: OutputSettings) -> int:
    """Send the request of a motion of one axis and wait for the end; Ctrl-C and SIGTERM stop the robot."""
    client = ServiceClient.find()
    with chosen(settings) as display, as_ctrl_c(), ThreadPoolExecutor(1) as other:
        jogging = other.submit(client.ask, move)
        try:
            while not wait({jogging}, PATIENCE).done:
                animate(client, display)
        except KeyboardInterrupt:
            display.note(translate(INTERRUPTION, settings.language))
            client.ask(requests.stop())
            raise
    gone = jogging.result()
    return output.answer(gone, _moved(gone, settings), settings)


def _moved(gone: Mapping[str, Any], settings: OutputSettings) -> str:
    language = settings.language
    text = units_of(settings).joint(gone["axis"], gone["distance"])
    moved = (
        marked("Moved {axis} by {way}. It stopped because {reason}.")
        if gone["limit"]
        else marked("Moved {axis} by {way}.")
    )
    return translate(moved, language, axis=gone["axis"], way=text, reason=translate_phrase(gone["reason"], language))


def pause(settings: OutputSettings) -> int:
    """Stop the running robot on its path and hold all motion; raises `CannotPause`."""
    report = ServiceClient.find().ask(requests.pause())
    text = (
        marked("Pausing: at rest within {seconds:.2f} s. `maya resume` continues.")
        if report["was_moving"]
        else marked("Paused. `maya resume` continues.")
    )
    said = translate(text, settings.language, seconds=report["duration"])
    return output.answer(report, said, settings)


def speed(ratio: float, settings: OutputSettings) -> int:
    """Scale the speed of all motion of the running robot by `ratio` (0.01 to 1)."""
    answer = ServiceClient.find().ask(requests.speed(ratio))
    return output.answer(
        answer,
        translate("Speed {percent:g} % from now on.", settings.language, percent=100.0 * answer["ratio"]),
        settings,
    )


def recover(settings: OutputSettings, *, take_over: bool) -> int:
    """Clear the fault of the running robot; with `take_over`, take its controller from another program that owns it."""
    answer = ServiceClient.find().ask(requests.recover(take_over=take_over))
    return output.answer(answer, translate("Recovered: the fault is cleared.", settings.language), settings)


def abort(settings: OutputSettings) -> int:
    """Stop the running robot without deceleration; return the exit code."""
    return output.answer(
        ServiceClient.find().ask(requests.abort()),
        translate(
            "Aborted: the axes are at rest. If motors are off, `maya recover` switches them on.", settings.language
        ),
        settings,
    )


def resume(settings: OutputSettings) -> int:
    """Resume the motion of the running robot after a pause."""
    return output.answer(
        ServiceClient.find().ask(requests.resume()), translate("Resumed.", settings.language), settings
    )
