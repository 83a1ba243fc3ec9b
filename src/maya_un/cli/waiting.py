"""Reasons why a queue is paused and why a job waits, in every language."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from maya_un.cli.client import ServiceClient
from maya_un.client import requests

_WORDS: dict[str, tuple[str, str]] = {
    "because_asked": ("{by} paused it", "{by} la pausó"),
    "because_step": ("step mode", "modo paso a paso"),
    "because_stop": ("{by} stopped the robot", "{by} detuvo el robot"),
    "because_asked_unknown": ("somebody paused it", "alguien la pausó"),
    "because_stop_unknown": ("somebody stopped the robot", "alguien detuvo el robot"),
    "because_fault": ("a fault", "un fallo"),
    "because_restart": ("the program was restarted", "el programa se reinició"),
    "because_driver": ("the driver no longer responds", "el conductor ya no responde"),
    "because_storage": ("the disk cannot be written", "no se puede escribir en el disco"),
    "because_failure": ("a job failed", "un trabajo falló"),
    "waits_paused": (
        "Job {id} waits: the queue is paused ({reason}). `maya queue resume` continues it.",
        "El trabajo {id} espera: la cola está en pausa ({reason}). `maya queue resume` la continúa.",
    ),
    "waits_interrupted": (
        "Job {id} waits: job {other} was interrupted; say what becomes of it with `maya queue recover`.",
        "El trabajo {id} espera: el trabajo {other} se interrumpió; decida con `maya queue recover`.",
    ),
    "waits_held": (
        "Job {id} is held. `maya job release {id}` lets it wait for its turn.",
        "El trabajo {id} está retenido. `maya job release {id}` lo deja esperar su turno.",
    ),
    "waits_proposal": (
        "Job {id} is a proposal. An operator approves it with `maya job release {id}`.",
        "El trabajo {id} es una propuesta. Un operador la aprueba con `maya job release {id}`.",
    ),
    "waits_lease": (
        "Job {id} waits: {holder} drives the robot.",
        "El trabajo {id} espera: {holder} conduce el robot.",
    ),
    "waits_turn": (
        "Job {id} waits for its turn, number {position}.",
        "El trabajo {id} espera su turno, número {position}.",
    ),
}
"""Reasons why a queue is paused, and why a job waits, in every language."""


def because(view: Mapping[str, Any], language: str) -> str:
    """Return why the queue is paused; `view` is a QueueView as JSON has it."""
    key = f"because_{view['reason']}"
    if not view["by"] and f"{key}_unknown" in _WORDS:
        return _word(f"{key}_unknown", language)
    return _word(key, language, by=view["by"]) if key in _WORDS else str(view["reason"])


def reason(client: ServiceClient, report: Mapping[str, Any], language: str) -> str:
    """Return why a job does not go on by itself, "" where it does; `report` is a JobReport as JSON has it."""
    if report["state"] not in {"queued", "paused", "interrupted", "held"}:
        return ""
    view = client.ask(requests.queue())
    begun = report["state"] == "queued" and all(line["id"] != report["id"] for line in view["waiting"])
    return "" if begun else _reason(client, view, report, language)


def _reason(client: ServiceClient, view: Mapping[str, Any], report: Mapping[str, Any], language: str) -> str:
    number = report["id"]
    line = next((line for line in view["waiting"] if line["id"] == number), None)
    direct = line is not None and line["direct"]
    if report["state"] == "held":
        proposed = line is not None and line["proposal"]
        return _word("waits_proposal" if proposed else "waits_held", language, id=number)
    if view["recovery"] is not None and not direct:
        return _word("waits_interrupted", language, id=number, other=view["recovery"]["job"])
    if view["mode"] == "paused" and not direct:
        return _word("waits_paused", language, id=number, reason=because(view, language))
    lease = client.ask(requests.lease())
    if lease["holder"] and not lease["implicit"] and not lease["yours"]:
        return _word("waits_lease", language, id=number, **lease)
    under_way = view["running"]
    if line is not None and line["position"] and under_way is not None and under_way["id"] != number:
        return _word("waits_turn", language, id=number, position=line["position"])
    return ""


def _word(key: str, language: str, **details: object) -> str:
    english, spanish = _WORDS[key]
    return (spanish if language == "es" else english).format(**details)
