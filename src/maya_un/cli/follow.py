"""Following a job of the running robot to its end, over HTTP."""

from __future__ import annotations

from typing import Any

from dmc41x3.i18n import marked, translate
from maya_un.cli import waiting
from maya_un.cli.client import ServiceClient
from maya_un.cli.progress import Display, tell
from maya_un.cli.settings import OutputSettings
from maya_un.client import requests
from maya_un.events import event_of

PATIENCE = 0.2
"""How long the service keeps a question for news before it answers that there are none [s]."""

_ENDED = {"done", "failed", "cancelled"}

INTERRUPTION = marked("Interrupted: stopping on the path.")
"""Said when Ctrl-C stops the robot."""


def follow(
    client: ServiceClient, job: int, since: int, display: Display, settings: OutputSettings
) -> tuple[dict[str, Any], bool]:
    """Show events numbered above `since` and the motion under way until `job` has ended.

    Says what the job waits for where it does not go on. Returns its report and whether Ctrl-C ended it: then the job is
    cancelled, which stops the robot on its path.
    """
    try:
        return _to_the_end(client, job, since, display, settings.language), False
    except KeyboardInterrupt:
        display.note(translate(INTERRUPTION, settings.language))
        return client.ask(requests.cancel(job), timeout=60.0), True


def _to_the_end(client: ServiceClient, job: int, since: int, display: Display, language: str) -> dict[str, Any]:
    report: dict[str, Any] = client.ask(requests.report(job))
    said = ""
    while report["state"] not in _ENDED:
        why = waiting.reason(client, report, language)
        if why and why != said:
            display.wait(why)
        said = why
        events = client.ask(requests.events(since=since, wait=PATIENCE))
        for event in events:
            since = event["seq"]
            tell(event_of(event["kind"], event["detail"], event["code"]), display, language)
        if events:
            report = client.ask(requests.report(job))
        animate(client, display)
    return report


def animate(client: ServiceClient, display: Display) -> None:
    """Show how far the motion under way has come."""
    progress = client.ask(requests.status())["progress"]
    if progress is None:
        display.rest()
    else:
        display.motion(progress["phase"], progress["elapsed"], progress["duration"])
