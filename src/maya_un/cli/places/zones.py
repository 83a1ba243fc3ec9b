"""`maya zones`: the keep-out zones of the running robot. Changes last for its run; the configuration is permanent."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from dmc41x3.i18n import marked, phrase, translate
from maya_un.cli import output
from maya_un.cli.client import ServiceClient
from maya_un.cli.report import table
from maya_un.cli.settings import OutputSettings
from maya_un.client import requests
from maya_un.errors import InvalidCommandLine, InvalidValue
from maya_un.quantities import length

_COMMAND = "maya zones add"

_OF_THIS_RUN = marked(
    "This change lasts until `maya up` ends. Write permanent zones into the configuration, in [[zones]]."
)


def listed(settings: OutputSettings) -> int:
    """Print all zones in the notation of `add`; raises `ServiceNotRunning`."""
    zones = ServiceClient.find().ask(requests.zones())
    head = tuple(
        translate(text, settings.language)
        for text in (marked("zone"), marked("kind"), marked("arguments for zones add"))
    )
    rows = [(zone["name"], zone["kind"], _written(zone)) for zone in zones]
    text = table(head, rows) if rows else translate("There are no zones.", settings.language)
    note = translate(_OF_THIS_RUN, settings.language)
    return output.answer({"zones": zones, "note": note}, f"{text}\n{note}", settings)


def add(name: str, kind: str, pairs: Sequence[str], settings: OutputSettings) -> int:
    """Add a keep-out zone, with its lengths given as `key=value`, or replace the zone with the same name.

    Raises `InvalidCommandLine`, `InvalidValue`, `ServiceNotRunning`, and `Busy` during a motion.
    """
    given = [_pair(text) for text in pairs]
    if len(given) != len(dict(given)):
        raise InvalidCommandLine(reason="a key is given twice", command=_COMMAND)
    zone = {key: _value(key, text) for key, text in given}
    taken = ServiceClient.find().ask(requests.put_zone(name, {"kind": kind, **zone}))
    return _told(
        taken, translate("Added zone {name}: the robot keeps out of it.", settings.language, name=name), settings
    )


def remove(name: str, settings: OutputSettings) -> int:
    """Remove a keep-out zone; raises `NotFound`, `ServiceNotRunning`, and `Busy` during a motion."""
    answer = ServiceClient.find().ask(requests.remove_zone(name))
    return _told(
        answer, translate("Removed zone {name}: the robot may enter it.", settings.language, name=name), settings
    )


def _told(answer: Mapping[str, Any], text: str, settings: OutputSettings) -> int:
    note = translate(_OF_THIS_RUN, settings.language)
    return output.answer({**answer, "note": note}, f"{text} {note}", settings)


def _pair(text: str) -> tuple[str, str]:
    key, equals, value = text.partition("=")
    if not (key and equals and value):
        raise InvalidCommandLine(reason=phrase("{text!r} is not KEY=VALUE", text=text), command=_COMMAND)
    return key, value


def _value(key: str, text: str) -> bool | float | list[float]:
    if key == "lines":
        if text not in {"true", "false"}:
            raise InvalidValue(key=key, value=repr(text), reason="it must be true or false")
        return text == "true"
    numbers = [length(part, key) for part in text.split(",")]
    return numbers if "," in text else numbers[0]


def _written(zone: Mapping[str, Any]) -> str:
    return " ".join(f"{key}={_plain(value)}" for key, value in zone.items() if key not in {"name", "kind"})


def _plain(value: bool | float | Sequence[float]) -> str:
    if isinstance(value, bool):
        return json.dumps(value)
    return f"{value:g}" if isinstance(value, int | float) else ",".join(f"{one:g}" for one in value)
