"""Reading the configuration file, and writing one that explains itself."""

from __future__ import annotations

import json
import os
import tomllib
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from maya_un.config.base import flaw
from maya_un.config.model import Config
from maya_un.config.zones import KINDS
from maya_un.errors import FileUnreadable, InvalidConfig
from maya_un.manual import default_path


def load(path: Path | None = None) -> Config:
    """Return the configuration of `path`, laid over the manual's defaults.

    Without `path` the default place is read, and the defaults alone serve where no file is there; a file that is
    named, by `path` or by $MAYA_CONFIG, must be there. Raises `FileUnreadable` (also for broken TOML) and
    `InvalidConfig` with key, value and reason.
    """
    named = path is not None or bool(os.environ.get("MAYA_CONFIG"))
    return parse(_read(default_path() if path is None else path, missing_is_empty=not named))


def _read(place: Path, *, missing_is_empty: bool) -> dict[str, Any]:
    try:
        return tomllib.loads(place.read_text(encoding="utf-8"))
    except OSError as error:
        if missing_is_empty and isinstance(error, FileNotFoundError):
            return {}
        raise FileUnreadable(path=place, reason=error.strerror or str(error)) from error
    except (ValueError, RecursionError) as error:  # broken TOML, broken UTF-8, numbers and nesting beyond all bounds
        raise FileUnreadable(path=place, reason=f"it is not TOML: {error}") from error


def parse(keys: dict[str, Any]) -> Config:
    """Return the configuration for nested keys laid over the defaults; raises `InvalidConfig`."""
    merged = _overlay(Config().model_dump(exclude_none=True), keys)
    try:
        return Config.model_validate(merged)
    except ValidationError as error:
        raise _refusal(error) from error


def _overlay(base: dict[str, Any], top: dict[str, Any]) -> dict[str, Any]:
    merged = dict(base)
    for key, value in top.items():
        below = merged.get(key)
        merged[key] = _overlay(below, value) if isinstance(below, dict) and isinstance(value, dict) else value
    return merged


def _refusal(error: ValidationError) -> InvalidConfig:
    found = flaw(error, tuple(KINDS))
    return InvalidConfig(key=found.key, value=_shown(found.value), reason=found.reason)


def to_toml(config: Config, *, commented: bool = False) -> str:
    """Return the configuration as TOML, every key with its meaning and unit behind it.

    With `commented`, the keys themselves are commented out, which makes a file to start from.
    """
    lines: list[str] = []
    prefix = "# " if commented else ""
    _write(config, "", lines, prefix)
    _write_zones(config, lines, prefix)
    return "\n".join(lines).strip() + "\n"


def template() -> str:
    """Return a configuration file with every key commented out at its default."""
    head = "# Maya-UN configuration. Uncomment what differs from the manual's machine.\n\n"
    return head + to_toml(Config(), commented=True)


def _write(model: BaseModel, name: str, lines: list[str], prefix: str) -> None:
    fields = type(model).model_fields
    leaves = {key: getattr(model, key) for key in fields if not isinstance(getattr(model, key), BaseModel | tuple)}
    if leaves:
        lines.extend(["", f"[{name}]"])
    for key, value in leaves.items():
        note = fields[key].description
        lines.append(f"# {key}: {note}" if value is None else f"{prefix}{key} = {json.dumps(value)}  # {note}")
    for key in fields:
        child = getattr(model, key)
        if isinstance(child, BaseModel):
            _write(child, f"{name}.{key}" if name else key, lines, prefix)


def _write_zones(config: Config, lines: list[str], prefix: str) -> None:
    for zone in config.zones:
        lines.extend(["", f"{prefix}[[zones]]"])
        for key, field in type(zone).model_fields.items():
            lines.append(f"{prefix}{key} = {json.dumps(getattr(zone, key))}  # {field.description}")
    if not config.zones:
        lines.extend(["", f"# zones: {type(config).model_fields['zones'].description}"])
        for kind, model in KINDS.items():
            lines.append(f"#   of kind {kind}:")
            keys = model.model_fields.items()
            lines.extend(f"#     {key}: {_meaning(field)}" for key, field in keys if key != "kind")


def _meaning(field: FieldInfo) -> str:
    return f"{field.description}{'' if field.is_required() else f' (default {json.dumps(field.default)})'}"


def _shown(value: object) -> str:
    """Return a refused value for a sentence; whole tables are too long for one."""
    return "(a table)" if isinstance(value, dict) else json.dumps(value, default=str, ensure_ascii=False)
