"""The fast commands `stop` and `status`, which use only http.client."""

from __future__ import annotations

from typing import Any

from dmc41x3.address import REAL, ControllerAddress
from dmc41x3.i18n import phrase, translate
from maya_un import runtime
from maya_un.cli import output
from maya_un.cli.client import ServiceClient
from maya_un.cli.help import quick_help
from maya_un.cli.settings import OutputSettings
from maya_un.cli.units import units_of
from maya_un.cli.words import mode_word
from maya_un.client import requests
from maya_un.errors import InvalidCommandLine, MayaError, ServiceNotRunning, translated
from maya_un.vocabulary import PHASES, worded

STOP_BUDGET = 0.1
"""Longest wait for the service's answer to a stop [s]; then the controller is stopped directly."""

SERVICE_TIMEOUT = 2.0
"""The same limit for a twin in the service, which has no controller to stop directly [s]."""

CONTROLLER_TIMEOUT = 2.0
"""Longest wait for each answer of a controller that is stopped directly [s]."""


def run(command: str, arguments: list[str], settings: OutputSettings) -> int:
    """Carry out "stop" or "status" with the rest of its command line; return the exit code."""
    if {"--help", "-h"} & set(arguments):
        output.say(quick_help(command))
        return output.DONE
    return stop(arguments, settings) if command == "stop" else status(arguments, settings)


def stop(arguments: list[str], settings: OutputSettings) -> int:
    """Stop by the service, or directly at the controller if the service does not stop the robot in time.

    With --address the controller is stopped directly at once; for "real" the configuration is read first. Raises
    `ServiceNotRunning` without an address and a service.
    """
    address = _address(arguments, settings)
    if address is not None:
        return _directly(address, settings)
    running = runtime.find()
    if running is None:
        raise ServiceNotRunning
    budget = SERVICE_TIMEOUT if running.controller is None else STOP_BUDGET
    try:
        report: dict[str, Any] = ServiceClient.find().ask(requests.stop(), timeout=budget)
    except MayaError:
        if running.controller is None:
            raise
        return _directly(running.controller, settings)
    return output.answer({"service": True, **report}, _stopping(report, settings), settings)


def _address(arguments: list[str], settings: OutputSettings) -> ControllerAddress | None:
    match arguments:
        case []:
            return None
        case ["--address", address]:
            text = address
        case [word_] if word_.startswith("--address="):
            text = word_.removeprefix("--address=")
        case _:
            raise InvalidCommandLine(
                reason=phrase("{words} is not understood", words=" ".join(arguments)), command="maya stop"
            )
    from maya_un.cli.addresses import controller_address

    if text == REAL:
        from maya_un.cli.configure import configuration

        text = configuration(settings).controller.address
    return controller_address(text)


def _directly(address: ControllerAddress, settings: OutputSettings) -> int:
    from dmc41x3.wire import emergency

    outcome = emergency.stop(address, CONTROLLER_TIMEOUT)
    place = str(address)
    axes = outcome.decelerating
    text = translate(
        "Stop sent directly to the controller at {address}: {axes} began to brake."
        if axes
        else "Stop sent directly to the controller at {address}: nothing was moving.",
        settings.language,
        address=place,
        axes=axes,
    )
    value = {"service": False, "address": place, "was_moving": bool(axes), "axes": axes}
    return output.answer(value, text, settings)


def _stopping(report: dict[str, Any], settings: OutputSettings) -> str:
    if not report["was_moving"]:
        return _nothing_moved(report.get("job"), settings.language)
    return translate(
        "Stopping: at rest within {seconds:.2f} s, after {way}.",
        settings.language,
        seconds=report["duration"],
        way=units_of(settings).joints(tuple(map(abs, report["distance"]))),
    )


def _nothing_moved(job: int | None, language: str) -> str:
    """Return what a stop did while nothing moved: it ends a job that waits."""
    if job is None:
        return translate("Nothing was moving.", language)
    return translate("Nothing was moving. Job {id} was ended.", language, id=job)


def status(arguments: list[str], settings: OutputSettings) -> int:
    """Print the state of the running robot; raises as `ServiceClient.ask` does."""
    if arguments:
        raise InvalidCommandLine(
            reason=phrase("{words} is not understood", words=" ".join(arguments)), command="maya status"
        )
    found: dict[str, Any] = ServiceClient.find(timeout=2.0).ask(requests.status())
    return output.answer(found, _described(found, settings), settings)


def _described(found: dict[str, Any], settings: OutputSettings) -> str:
    language = settings.language
    state, fault = found["state"], found["state"]["fault"]
    controller = translate("controller {address}", language, address=found["address"])
    lines = [
        f"{mode_word(state['mode'], language)}   {controller}",
        _place(state, settings),
        translate("gripper closed" if state["gripper_closed"] else "gripper open", language),
    ]
    if state.get("override", 1.0) != 1.0:
        lines.insert(1, translate("speed {percent:g} %", language, percent=100.0 * state["override"]))
    if found.get("unconfirmed"):
        lines.append(translate("datum not confirmed: motion is slow until `maya datum confirm`", language))
    if found["progress"] is not None:
        lines.insert(1, _progress(found["progress"], language))
    limits = _active_limits(state)
    if limits:
        lines.append(translate("limit switches active: {names}", language, names=limits))
    if found["jobs"]:
        running = sum(job["state"] == "running" for job in found["jobs"])
        lines.append(
            translate(
                "{running} running, {waiting} waiting", language, running=running, waiting=len(found["jobs"]) - running
            )
        )
    asked = found.get("question")
    if asked is not None and asked["open"]:
        lines.append(translate("job {job} waits for an answer: {question}", language, **asked))
    if fault is not None:
        message = translated(fault["code"], fault["message"], language)
        lines.append(translate("fault {code}: {message}", language, code=fault["code"], message=message))
    return "\n".join(lines)


def _progress(progress: dict[str, Any], language: str) -> str:
    return translate(
        "{phase}: {elapsed:.1f} of {duration:.1f} s"
        if progress["duration"] > 0.0
        else "{phase}: since {elapsed:.1f} s",
        language,
        **{**progress, "phase": worded(PHASES, progress["phase"], language)},
    )


def _place(state: dict[str, Any], settings: OutputSettings) -> str:
    if state["joints"] is None:
        return translate("position unknown until homed", settings.language)
    units = units_of(settings)
    joints = units.joints(state["joints"])
    return joints if state["point"] is None else f"{joints}   {units.point(state['point'])}"


def _active_limits(state: dict[str, Any]) -> str:
    sides = (("forward_limit", "+"), ("reverse_limit", "−"))
    return " ".join(
        axis + sign for side, sign in sides for axis, active in zip("abc", state[side], strict=True) if active
    )
