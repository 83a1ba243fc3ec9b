"""`maya lease`: show, take, release and offer the control lease.

All commands of this user use the lease. Without `--for`, the command itself renews the lease while it runs, so a closed
terminal or a lost connection frees the robot.
"""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import Any

from dmc41x3.i18n import marked, translate
from maya_un import credentials
from maya_un.cli import output
from maya_un.cli.access import files
from maya_un.cli.client import ServiceClient, called
from maya_un.cli.settings import OutputSettings
from maya_un.client import requests
from maya_un.errors import MayaError, ServiceNotAnswering

HEARTBEAT = 2.0
"""Period of renewing the lease [s]: a fifth of its duration, so that a few lost answers do not matter."""

_ANSWER = 2.0
"""Longest wait for the answer to a renewal [s]."""

_LINE = "\r\x1b[K"
_UNITS = (("d", 86400.0), ("h", 3600.0), ("min", 60.0))

_RELEASED = marked("You gave the lease back. Nobody drives now.")


def show(settings: OutputSettings) -> int:
    """Print the driver; raises `ServiceNotRunning`."""
    view = ServiceClient.find().ask(requests.lease())
    return output.answer(view, _described(view, settings.language), settings)


def take(note: str, patience: float | None, settings: OutputSettings, *, force: bool) -> int:
    """Take the lease for `patience` [s] without renewal; with None, for as long as this command runs.

    Raises `LeaseHeld`, `NotAllowed`, and `LeaseLost` after another user has taken it.
    """
    client = ServiceClient.find()
    lasting: dict[str, float] = {} if patience is None else {"patience": patience}
    with called({"patience": "--for", "note": "--note"}):
        taken = client.ask(requests.take_lease(note=note, force=force, **lasting))
    files.keep_lease(taken["id"], client.url)
    shown = {key: value for key, value in taken.items() if key != "id"}
    if patience is not None:
        text = translate(
            "You drive for {expires}. `maya lease release` gives the lease back sooner.",
            settings.language,
            expires=_lasts(patience),
        )
        return output.answer(shown, text, settings)
    output.answer(shown, translate("You drive now. Ctrl-C gives the lease back.", settings.language), settings)
    with _ended_like_by_hand():
        client.lease = taken["id"]
        return _drive(client, settings)


def release(settings: OutputSettings) -> int:
    """Release the lease; raises `LeaseNeeded` and related errors if it is not held."""
    held = credentials.held()
    view = ServiceClient.find().ask(requests.release_lease())
    if held is not None:
        credentials.forget(held.id)
    return output.answer(view, translate(_RELEASED, settings.language), settings)


def offer(name: str, settings: OutputSettings) -> int:
    """Offer the lease to `name` for a minute; raises `UnknownName`, `NotAllowed`, `LeaseHeld`."""
    view = ServiceClient.find().ask(requests.offer_lease(name))
    return output.answer(
        view,
        translate(
            "You offered the lease to {offered_to}, who can take it with `maya lease take` within one minute.",
            settings.language,
            **view,
        ),
        settings,
    )


def ask(settings: OutputSettings) -> int:
    """Ask for the lease; all users see the request."""
    view = ServiceClient.find().ask(requests.ask_for_lease())
    return output.answer(
        view,
        translate(
            "You asked for the lease. {holder} sees the request."
            if view["holder"]
            else "You asked for the lease. Nobody drives; operators see the request.",
            settings.language,
            **view,
        ),
        settings,
    )


def _drive(client: ServiceClient, settings: OutputSettings) -> int:
    """Renew the lease of the client until Ctrl-C, then release it."""
    wait, left = threading.Event(), 0.0
    try:
        while True:
            try:
                view = client.ask(requests.renew_lease(), timeout=_ANSWER)
                left = view["expires_in"] or 0.0
                _tell(_state(view, settings.language), settings)
            except ServiceNotAnswering:
                left = max(0.0, left - HEARTBEAT - _ANSWER)
                _tell(
                    translate(
                        "the service does not answer; it ends in {expires}", settings.language, expires=_lasts(left)
                    ),
                    settings,
                )
            wait.wait(HEARTBEAT)
    except KeyboardInterrupt:
        with suppress(MayaError):
            client.ask(requests.release_lease())
        _tell("", settings)  # after the release, because the terminal may be closed
        if not settings.json:
            output.say(translate(_RELEASED, settings.language))
        return output.DONE
    except MayaError:
        _tell("", settings)
        raise
    finally:
        credentials.forget(client.lease)


@contextmanager
def _ended_like_by_hand() -> Iterator[None]:
    """Make SIGTERM and a closed terminal end the block as Ctrl-C does."""
    before = {kind: signal.signal(kind, signal.default_int_handler) for kind in (signal.SIGTERM, signal.SIGHUP)}
    try:
        yield
    finally:
        for kind, handler in before.items():
            signal.signal(kind, handler)


def _tell(line: str, settings: OutputSettings) -> None:
    """Show the state in one line of a terminal, in place of the previous one."""
    if not settings.json and sys.stdout.isatty():
        print(f"{_LINE}{line}", end="", flush=True)


def _state(view: Mapping[str, Any], language: str) -> str:
    parts = [translate("driving for {since}", language, since=_lasts(view["since"])), *_others(view, language)]
    return " · ".join(parts)


def _described(view: Mapping[str, Any], language: str) -> str:
    if not view["holder"]:
        return "\n".join(
            [translate("Nobody drives. `maya lease take` takes the lease.", language), *_others(view, language)]
        )
    note = f": {view['note']}" if view["note"] else ""
    text = (
        marked("A command or job of {holder} is running ({source}).")
        if view["implicit"]
        else marked("{holder} has been driving for {since} ({source}){note}.")
    )
    lines = [translate(text, language, **{**view, "since": _lasts(view["since"]), "note": note})]
    if view["yours"]:
        lines.append(translate("You hold this lease, on this machine.", language))
    if view["expires_in"] is not None:
        lines.append(
            translate("It ends in {expires} unless it is renewed.", language, expires=_lasts(view["expires_in"]))
        )
    return "\n".join([*lines, *_others(view, language)])


def _others(view: Mapping[str, Any], language: str) -> list[str]:
    texts = {
        "offered_to": marked("It is offered to {offered_to}."),
        "asked_by": marked("{asked_by} would like to drive."),
    }
    return [translate(text, language, **view) for name, text in texts.items() if view[name]]


def _lasts(seconds: float) -> str:
    """Return a duration in the largest unit of which it contains at least two."""
    unit, size = next(((unit, size) for unit, size in _UNITS if seconds >= 2 * size), ("s", 1.0))
    return f"{seconds / size:.0f} {unit}"
