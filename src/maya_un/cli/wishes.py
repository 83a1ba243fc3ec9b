"""Wishes to the running robot: one primitive each, followed to its end."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor, wait

from maya_un.cli import output
from maya_un.cli.client import Client
from maya_un.cli.display import chosen
from maya_un.cli.follow import PATIENCE, animate, follow
from maya_un.cli.report import STEP_KEYS
from maya_un.cli.settings import Settings
from maya_un.cli.words import word

LONGEST_JOG = 3600.0
"""Longest wait for a jog [s]."""


def wish(primitive: Mapping[str, object], settings: Settings) -> int:
    """Have the running robot carry out a primitive; return the exit code.

    Raises `ServiceNotRunning` and whatever the service refuses at once.
    """
    client = Client.find()
    with chosen(settings) as display:
        since = client.get("/v1/status")["last_event"]
        accepted = client.post("/v1/tasks", primitive)
        report, interrupted = follow(client, accepted["id"], since, display, settings)
    step = report["steps"][0]
    if settings.json:
        output.emit({key: step[key] for key in STEP_KEYS})
    elif report["state"] == "done":
        output.say(word("done", settings.language))
    return output.INTERRUPTED if interrupted else output.concluded(report, settings)


def jog(axis: str, distance: float, settings: Settings) -> int:
    """Have one axis move by `distance` (rad or m) and wait for it; Ctrl-C stops it."""
    client = Client.find()
    body = {"axis": axis, "distance": distance}
    with chosen(settings) as display, ThreadPoolExecutor(1) as other:
        jogging = other.submit(client.post, "/v1/jog", body, LONGEST_JOG)
        try:
            while not wait({jogging}, PATIENCE).done:
                animate(client, display)
        except KeyboardInterrupt:
            display.note(word("interrupted", settings.language))
            client.post("/v1/stop")
            raise
    return output.answer(jogging.result(), word("done", settings.language), settings)


def at_once(name: str, told: str, settings: Settings) -> int:
    """Say "abort" or "recover" to the running robot; `told` is the key of the words for success."""
    return output.answer(Client.find().post(f"/v1/{name}"), word(told, settings.language), settings)
