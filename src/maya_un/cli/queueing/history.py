"""`maya history`: past jobs with owner, origin and duration."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from dmc41x3.i18n import translate
from maya_un.cli import output
from maya_un.cli.client import ServiceClient, called
from maya_un.cli.queueing import text
from maya_un.cli.settings import OutputSettings
from maya_un.client import requests
from maya_un.client.request import Request
from maya_un.errors import InvalidCommandLine

USUAL = 20
"""Default number of listed jobs."""

_PAGE = 1000


class HistoryFilter(NamedTuple):
    """Number and selection of jobs; None for no restriction."""

    number: int = USUAL
    owner: str | None = None
    states: Sequence[str] = ()
    text: str | None = None


def history(wanted: HistoryFilter, settings: OutputSettings, *, as_csv: bool) -> int:
    """Print the last jobs, newest first, as a table or with `as_csv` as CSV; raises `InvalidCommandLine`."""
    if as_csv and settings.json:
        raise InvalidCommandLine(reason="--csv and --json cannot be combined", command="maya history")
    with called({"state": "--state", "owner": "--owner", "text": "--text", "limit": "N"}):
        jobs = _found(ServiceClient.find(), wanted)
    if as_csv:
        output.say(_csv(jobs).rstrip("\n"))
        return output.DONE
    shown = text.past(jobs, settings.language) if jobs else translate("Nothing has been done yet.", settings.language)
    return output.answer({"jobs": jobs}, shown, settings)


def _found(client: ServiceClient, wanted: HistoryFilter) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = []
    while len(found) < wanted.number:
        below = found[-1]["id"] if found else None
        page = client.ask(_page(wanted, below, min(_PAGE, wanted.number - len(found))))
        found += page
        if not page:
            break
    return found


def _page(wanted: HistoryFilter, below: int | None, limit: int) -> Request[Any]:
    return requests.jobs(state=wanted.states, owner=wanted.owner, text=wanted.text or "", below=below, limit=limit)


def _csv(jobs: Sequence[Mapping[str, Any]]) -> str:
    written = io.StringIO()
    columns = list(jobs[0]) if jobs else ["id"]
    writer = csv.DictWriter(written, columns, lineterminator="\n")
    writer.writeheader()
    for job in jobs:
        writer.writerow({**job, "depends_on": " ".join(str(number) for number in job["depends_on"])})
    return written.getvalue()
