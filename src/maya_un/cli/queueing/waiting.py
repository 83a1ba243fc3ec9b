"""What a job waits for, said to whoever follows it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from maya_un.cli.client import Client
from maya_un.cli.queueing import text
from maya_un.cli.queueing.words import word


def reason(client: Client, report: Mapping[str, Any], language: str) -> str:
    """Return why a job does not go on by itself, "" where it does; `report` is a JobReport as JSON has it."""
    if report["state"] in {"queued", "paused", "interrupted", "held"}:
        return _reason(client, client.get("/v1/queue"), report, language)
    return ""


def _reason(client: Client, view: Mapping[str, Any], report: Mapping[str, Any], language: str) -> str:
    number = report["id"]
    line = next((line for line in view["waiting"] if line["id"] == number), None)
    if report["state"] == "held":
        proposed = line is not None and line["proposal"]
        return word("waits_proposal" if proposed else "waits_held", language, id=number)
    if view["recovery"] is not None:
        return word("waits_interrupted", language, id=number, other=view["recovery"]["job"])
    if view["mode"] == "paused":
        return word("waits_paused", language, id=number, reason=text.reason(view, language))
    lease = client.get("/v1/lease")
    if lease["holder"] and not lease["implicit"] and not lease["yours"]:
        return word("waits_lease", language, id=number, **lease)
    under_way = view["running"]
    if line is not None and line["position"] and under_way is not None and under_way["id"] != number:
        return word("waits_turn", language, id=number, position=line["position"])
    return ""
