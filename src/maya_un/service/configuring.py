"""The configuration for clients: describe its settings, check another one, and write it for the next start."""

from __future__ import annotations

import tomllib
from collections.abc import Generator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from dmc41x3.i18n import phrase, translations
from maya_un.config import Config
from maya_un.config.base import Flaw
from maya_un.config.files import alone, checked, merged, replace, shown, text_of, toml_reason, written
from maya_un.config.settings import Setting, flat, sections, settings
from maya_un.errors import InvalidConfig, InvalidRequest
from maya_un.process.computation import MOST_TEXT
from maya_un.process.spec.json_object import decode_object
from maya_un.schema.configuration import (
    ConfigCheck,
    ConfigSchema,
    ConfigSectionInfo,
    SettingDifference,
    SettingInfo,
    SettingMistake,
)
from maya_un.service.access.operations import LOCAL, Caller
from maya_un.service.computing import Computing

Request = bytes | Mapping[str, Any]
"""An object with either the `text` of a configuration file, or nested `settings` that change the present file."""


class ConfigService:
    """Checks and writes the file of the configuration that is in force, `config`; None without a file."""

    def __init__(self, config: Config, file: Path | None, computing: Computing) -> None:
        self._config = config
        self._file = file
        self._computing = computing

    def schema(self) -> ConfigSchema:
        """Return the sections and settings of the configuration."""
        return schema()

    async def check(self, request: Request, by: Caller = LOCAL) -> ConfigCheck:
        """Return the mistakes of a configuration, or its differences; raises `InvalidRequest`, `FileUnreadable`."""
        return await self._computing.value(by, check, request, self._file, self._config)

    async def write(self, request: Request, by: Caller = LOCAL) -> ConfigCheck:
        """Write a configuration to the file, whole or not at all; it is in force from the next start.

        Return its differences. Raises `InvalidConfig` with the first mistake, `InvalidRequest` without a file,
        `FileUnreadable` and `FileUnwritable`.
        """
        if self._file is None:
            raise InvalidRequest(key="config", reason="this robot runs without a configuration file")
        return await self._computing.value(by, write, request, self._file, self._config)


@cache
def schema() -> ConfigSchema:
    """Return the sections and settings of the configuration."""
    defaults = flat(Config().model_dump(mode="json"))
    return ConfigSchema(
        tuple(ConfigSectionInfo(one.name, translations(one.meaning)) for one in sections()),
        tuple(_info(one, defaults[one.name]) for one in settings()),
    )


def _info(setting: Setting, default: object) -> SettingInfo:
    of = setting.schema
    return SettingInfo(
        name=setting.name,
        section=setting.section,
        type=of["type"],
        unit=setting.unit,
        description=translations(setting.meaning),
        default=default,
        optional=setting.optional,
        minimum=of.get("minimum"),
        exclusive_minimum=of.get("exclusiveMinimum"),
        maximum=of.get("maximum"),
        exclusive_maximum=of.get("exclusiveMaximum"),
        choices=tuple(of.get("enum", ())),
        pattern=of.get("pattern"),
    )


class _Draft(NamedTuple):
    """The text of another configuration, and the configuration, or its flaws."""

    text: str
    config: Config | None
    flaws: list[Flaw]


def check(request: Request, file: Path | None, now: Config) -> Generator[None, None, ConfigCheck]:
    """Return the check of a configuration; for a worker."""
    draft = _draft(request, file)
    yield
    return _told(draft, now)


def write(request: Request, file: Path, now: Config) -> Generator[None, None, ConfigCheck]:
    """Write a configuration, and return its check; for a worker."""
    yield
    with alone(file):
        draft = _draft(request, file)
        if draft.flaws:
            first = draft.flaws[0]
            raise InvalidConfig(key=first.key or "text", value=shown(first.value), reason=first.reason)
        replace(file, draft.text)
    return _told(draft, now)


def _draft(request: Request, file: Path | None) -> _Draft:
    body = decode_object(request) if isinstance(request, bytes) else request
    try:
        match body:
            case {"text": str(text)} if len(body) == 1 and len(text) <= MOST_TEXT:
                return _parsed(text)
            case {"settings": dict(changes)} if len(body) == 1:
                return _changed(changes, file)
            case _:
                reason = phrase(
                    "the body has a `text` of at most {most} characters, or an object of `settings`", most=MOST_TEXT
                )
                raise InvalidRequest(key="body", reason=reason)
    except RecursionError as error:
        raise InvalidRequest(key="body", reason="it is nested too deeply") from error


def _parsed(text: str) -> _Draft:
    try:
        keys = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        return _Draft(text, None, [Flaw("", text[:40], toml_reason(text, error))])
    return _Draft(text, *checked(keys))


def _changed(changes: dict[str, Any], file: Path | None) -> _Draft:
    before = "" if file is None else text_of(file)
    keys = {} if file is None else written(file)
    config, flaws = checked(_with(keys, changes))
    if config is None:
        return _Draft(before, None, flaws)
    return _parsed(merged(before, changes))


def _with(keys: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return nested keys with changes, as `merged` does with a text."""
    found = dict(keys)
    for name, value in changes.items():
        below = found.pop(name, None)
        if isinstance(value, Mapping):
            found[name] = _with(below if isinstance(below, Mapping) else {}, value)
        elif value is not None:
            found[name] = value
    return found


def _told(draft: _Draft, now: Config) -> ConfigCheck:
    if draft.config is None:
        return ConfigCheck(tuple(SettingMistake(one.key, shown(one.value), one.reason) for one in draft.flaws))
    return ConfigCheck((), _differences(now, draft.config), _differences(Config(), draft.config))


def _differences(before: Config, after: Config) -> tuple[SettingDifference, ...]:
    old, new = (flat(config.model_dump(mode="json")) for config in (before, after))
    return tuple(SettingDifference(name, old[name], new[name]) for name in new if old[name] != new[name])
