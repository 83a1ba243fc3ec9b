"""The settings of the configuration, one by one, as the model declares them: names, units, ranges, meanings."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from maya_un.config.model import Config

_UNIT = re.compile(r" (?<!\[)\[([^\[\]]+)\](?!\])")
_ANGLE_OR_LENGTH = "rad or m"


class Setting(NamedTuple):
    """A setting: its dotted `name`, its `section`, its meaning in English, its `unit` ("" for none), its JSON schema.

    `optional` settings may have no value; in a file they are left out.
    """

    name: str
    section: str
    meaning: str
    unit: str
    schema: Mapping[str, Any]
    optional: bool


class DescribedSection(NamedTuple):
    """A section of the configuration: its dotted `name`, and its meaning in English."""

    name: str
    meaning: str


def settings() -> list[Setting]:
    """Return all settings, in the order of the model; the list of zones is one setting."""
    return [one for one in _parts() if isinstance(one, Setting)]


def sections() -> list[DescribedSection]:
    """Return the sections that have settings, in the order of the model."""
    used = {setting.section for setting in settings()}
    return [one for one in _parts() if isinstance(one, DescribedSection) and one.name in used]


def _parts() -> Iterator[Setting | DescribedSection]:
    whole = Config.model_json_schema()
    yield from _of_section("", whole, whole["$defs"])


def _of_section(
    section: str, schema: Mapping[str, Any], models: Mapping[str, Any]
) -> Iterator[Setting | DescribedSection]:
    if section:
        yield DescribedSection(section, str(schema["description"]).split("\n\n")[0])
    for key, of in schema["properties"].items():
        name = f"{section}.{key}" if section else key
        if "$ref" in of:
            yield from _of_section(name, models[of["$ref"].rpartition("/")[2]], models)
        else:
            yield _setting(name, section, of)


def _setting(name: str, section: str, schema: Mapping[str, Any]) -> Setting:
    text = str(schema["description"])
    found = _UNIT.search(text)
    unit = "" if found is None else found[1]
    if unit == _ANGLE_OR_LENGTH:
        unit = "rad" if section == "axes.a" else "m"
    kinds = schema.get("anyOf", [schema])
    values = [kind for kind in kinds if kind.get("type") != "null"]
    return Setting(name, section, _UNIT.sub("", text, count=1), unit, values[0], len(values) < len(kinds))


def flat(values: Mapping[str, Any], section: str = "") -> dict[str, Any]:
    """Return the values of nested keys by their dotted names."""
    found: dict[str, Any] = {}
    for key, value in values.items():
        name = f"{section}.{key}" if section else key
        found |= flat(value, name) if isinstance(value, Mapping) else {name: value}
    return found


def nested(changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings by their dotted names as nested tables; raises `ValueError` for a setting within another one."""
    keys: dict[str, Any] = {}
    for name, value in changes.items():
        *sections, last = name.split(".")
        table = keys
        for section in sections:
            table = table.setdefault(section, {})
            if not isinstance(table, dict):
                raise ValueError(name)  # noqa: TRY004 - a wrong name, not a wrong type of an argument
        if last in table:
            raise ValueError(name)
        table[last] = value
    return keys
