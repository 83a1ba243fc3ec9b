"""The configuration as messages: its settings, and the mistakes and differences of another one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class SettingInfo:
    """A setting: its dotted `name`, its `section`, its `type` in JSON, and its `unit` ("" for none).

    `description` is by language ("en", "es"). The value is at least `minimum` and at most `maximum`, or above and below
    the exclusive ones; it is one of the `choices` if there are any, and matches the regular expression `pattern`. An
    `optional` setting may have no value (null).
    """

    name: str
    section: str
    type: str
    unit: str
    description: dict[str, str]
    default: Any
    optional: bool = False
    minimum: float | None = None
    exclusive_minimum: float | None = None
    maximum: float | None = None
    exclusive_maximum: float | None = None
    choices: tuple[Any, ...] = ()
    pattern: str | None = None


@dataclass(frozen=True, slots=True)
class ConfigSectionInfo:
    """A section of the configuration: its dotted `name`, and its `description` by language."""

    name: str
    description: dict[str, str]


@dataclass(frozen=True, slots=True)
class ConfigSchema:
    """The sections and settings of the configuration, in the order of its file."""

    sections: tuple[ConfigSectionInfo, ...]
    settings: tuple[SettingInfo, ...]


@dataclass(frozen=True, slots=True)
class SettingMistake:
    """Why the `value` of a setting is refused; `name` is "" if the text is not TOML."""

    name: str
    value: str
    reason: str


@dataclass(frozen=True, slots=True)
class SettingDifference:
    """A setting whose value differs `before` and `after`; None is no value."""

    name: str
    before: Any
    after: Any


@dataclass(frozen=True, slots=True)
class ConfigCheck:
    """The check of a configuration: its `mistakes`, or its differences from that in force and from the defaults."""

    mistakes: tuple[SettingMistake, ...]
    from_now: tuple[SettingDifference, ...] = ()
    from_default: tuple[SettingDifference, ...] = ()
