"""Configuration files: read, written with explanations, and edited key by key."""

from __future__ import annotations

import fcntl
import json
import os
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping, MutableMapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from dmc41x3.files import sync_folder, unreadable, unwritable, writable_place
from dmc41x3.i18n import phrase
from maya_un.config.base import Flaw, flaws
from maya_un.config.model import KINDS, Config
from maya_un.errors import FileUnreadable, FileUnwritable, InvalidConfig
from maya_un.manual import default_path
from maya_un.quantities import ANGLE, LENGTH, UNITS
from maya_un.validation import UNKNOWN, WHOLE, nearest


def load(path: Path | None = None, base: Config | None = None) -> Config:
    """Return the configuration of `path`, merged over `base`, by default the manual's values.

    Without `path` the default file is read, and a missing one means the defaults. A file named by `path` or by
    $MAYA_CONFIG must exist. Raises `FileUnreadable` (also for broken TOML) and `InvalidConfig` with key, value and
    reason.
    """
    named = path is not None or bool(os.environ.get("MAYA_CONFIG"))
    place = default_path() if path is None else path
    text = _read(place, missing_is_empty=not named)
    try:
        return parse(_keys(text, place), base)
    except InvalidConfig as error:
        key = str(error.details["key"])
        line = _line_of(text, key)
        if not line:
            raise
        where = phrase("{key} ({file}, line {line})", key=key, file=place.name, line=line)
        details = {**error.details, "file": place.name, "line": line}
        raise InvalidConfig.rebuilt(details, str(error.copy(key=where))) from error


def _line_of(text: str, key: str) -> int:
    """Return the line of a dotted key in TOML, from 1, or of the nearest part around it; 0 without any."""
    section, tables, nearest, found = "", 0, "", 0
    for number, line in enumerate(text.splitlines(), 1):
        header = _HEADER.match(line)
        if header is None:
            name = line.partition("=")[0].strip()
            at = f"{section}.{name}" if section else name
        else:
            brackets, at = header.groups()
            if brackets == "[[":
                at, tables = f"{at}.{tables}", tables + 1
            section = at
        if len(at) > len(nearest) and f"{key}.".startswith(f"{at}."):
            nearest, found = at, number
    return found


_HEADER = re.compile(r"\s*(\[\[?)\s*([^\]\s]+)\s*\]+\s*(?:#.*)?$")


def _read(place: Path, *, missing_is_empty: bool) -> str:
    try:
        return place.read_text(encoding="utf-8")
    except OSError as error:
        if missing_is_empty and isinstance(error, FileNotFoundError):
            return ""
        raise unreadable(place, error) from error
    except ValueError as error:
        raise FileUnreadable(path=place, reason=phrase("it is not TOML: {error}", error=error)) from error


def _keys(text: str, place: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # broken TOML, numbers and nesting beyond all bounds
        raise FileUnreadable(path=place, reason=toml_reason(text, error)) from error


def parse(keys: dict[str, Any], base: Config | None = None) -> Config:
    """Return the configuration for nested keys merged over `base` (the defaults); raises `InvalidConfig`."""
    config, found = checked(keys, base)
    if config is None:
        raise InvalidConfig(key=found[0].key, value=shown(found[0].value), reason=found[0].reason)
    return config


def checked(keys: dict[str, Any], base: Config | None = None) -> tuple[Config | None, list[Flaw]]:
    """Return the configuration for nested keys merged over `base` (the defaults), or None and all of its flaws."""
    try:
        return Config.model_validate(_overlay((base or Config()).model_dump(exclude_none=True), keys)), []
    except ValidationError as error:
        return None, [_as_written(_with_nearest(one), keys) for one in flaws(error, tuple(KINDS))]


def _as_written(found: Flaw, keys: Mapping[str, Any]) -> Flaw:
    """Return a flaw with the value that a person wrote, and the unit that is expected in place of a text."""
    from maya_un.config.settings import settings  # noqa: PLC0415 - only for a mistake

    unit = next((one.unit for one in settings() if one.name == found.key), "")
    said = _at(keys, found.key)
    if said is None and isinstance(found.value, float) and unit in _PEOPLES:
        peoples, factor = _PEOPLES[unit]
        return found._replace(value=f"{found.value * factor:.12g} {peoples}")
    if isinstance(said, str) and found.reason == WHOLE and unit:
        found = found._replace(reason=phrase("it is a whole number of {unit}", unit=unit))
    return found._replace(value=said) if isinstance(said, str | int | float) else found


def _at(keys: Mapping[str, Any], key: str) -> object:
    """Return the value at a dotted key, None without one."""
    value: object = keys
    for part in key.split("."):
        value = value.get(part) if isinstance(value, Mapping) else None
    return value


def _with_nearest(found: Flaw) -> Flaw:
    """Return a flaw; that of an unknown key names the nearest key of its section."""
    if found.reason != UNKNOWN:
        return found
    section, _, name = found.key.rpartition(".")
    model: Any = Config
    for part in filter(None, section.split(".")):
        model = model.model_fields[part].annotation if isinstance(model, type) and part in model.model_fields else None
    near = nearest(name, getattr(model, "model_fields", ()))
    return found if near is None else found._replace(reason=phrase("there is no such key; perhaps {name}", name=near))


def toml_reason(text: str, error: Exception) -> str:
    """Return why a text is not TOML; a unit outside quotes and a decimal comma have their own remedy."""
    for found in _VALUE.finditer(text):
        key, number, unit = found.groups()
        if unit in UNITS or (not unit and "," in number):
            right = number.replace(",", ".")
            right = f'"{right} {unit}"' if unit else right
            line = text.count("\n", 0, found.start(1)) + 1
            return phrase("line {line}: write {key} = {right}", line=line, key=key, right=right)
    twice = _TWICE.search(str(error))
    if twice is not None:
        table = ".".join(re.findall(r"'([^']*)'", twice[1]))
        return phrase("line {line}: the table [{table}] appears twice", line=twice[2], table=table)
    return phrase("it is not TOML: {error}", error=error)


_TWICE = re.compile(r"Cannot declare \((.*)\) twice \(at line (\d+)")
"""The words of the parser for a table that appears twice."""

_VALUE = re.compile(r"^[ \t]*([\w.-]+)[ \t]*=[ \t]*([+-]?\d+(?:[.,]\d+)?)[ \t]*([A-Za-zµ°%]*)[ \t]*(?:#.*)?$", re.M)
"""A key, a number, and perhaps a unit: alone in a line."""


def _overlay(base: dict[str, Any], top: dict[str, Any]) -> dict[str, Any]:
    merged = dict(base)
    for key, value in top.items():
        below = merged.get(key)
        merged[key] = _overlay(below, value) if isinstance(below, dict) and isinstance(value, dict) else value
    return merged


Setting = Callable[[str, object, str], str]
"""Writes a key, its value and its meaning as a line of TOML."""


def to_toml(config: Config, *, commented: bool = False) -> str:
    """Return the configuration as TOML, every key followed by its meaning and unit.

    With `commented`, the keys themselves are commented out, as a template.
    """
    prefix = "# " if commented else ""
    return _toml(config, lambda key, value, note: f"{prefix}{key} = {json.dumps(value)}  # {note}", prefix)


def for_people(config: Config, *, si: bool = False) -> str:
    """Return the configuration as TOML to be read: lengths in mm and angles in degrees, with `si` in m and rad.

    Numbers are rounded, so it is nearly the configuration, and not exactly.
    """
    return _toml(config, _rounded if si else _with_units)


def _rounded(key: str, value: object, note: str) -> str:
    return f"{key} = {json.dumps(_each(value, lambda number: float(f'{number:.12g}')))}  # {note}"


def _with_units(key: str, value: object, note: str) -> str:
    unit = next((unit for unit in _PEOPLES if f" [{unit}]" in note), None)
    if unit is None:
        return _rounded(key, value, note)
    peoples, factor = _PEOPLES[unit]
    shown = _each(value, lambda number: f"{number * factor:.12g} {peoples}")
    return f"{key} = {json.dumps(shown)}  # {note.replace(f' [{unit}]', '')}"


_PEOPLES = {kind.si: (kind.usual, 1.0 / kind.units[kind.usual]) for kind in (LENGTH, ANGLE)}
"""The units of people for those that a meaning of a key names, and their factors."""


def _each(value: object, change: Callable[[float], object]) -> object:
    """Return a value with its numbers changed, or each number of its list; whole numbers and texts stay."""
    if isinstance(value, tuple | list):
        return [_each(one, change) for one in value]
    return change(value) if isinstance(value, float) else value


def _toml(config: Config, setting: Setting, prefix: str = "") -> str:
    lines: list[str] = []
    _write(config, "", lines, setting)
    _write_zones(config, lines, setting, prefix)
    return "\n".join(lines).strip() + "\n"


def template() -> str:
    """Return a configuration file with every key commented out at its default."""
    head = "# Maya-UN configuration. Uncomment what differs from the manual's machine.\n\n"
    return head + to_toml(Config(), commented=True)


def _write(model: BaseModel, name: str, lines: list[str], setting: Setting) -> None:
    fields = type(model).model_fields
    values = {key: getattr(model, key) for key in fields if key != "zones"}  # `_write_zones` writes those
    leaves = {key: value for key, value in values.items() if not isinstance(value, BaseModel)}
    if leaves:
        lines.extend(["", f"[{name}]"])
    for key, value in leaves.items():
        note = fields[key].description or ""
        lines.append(f"# {key}: {note}" if value is None else setting(key, value, note))
    for key in fields:
        child = getattr(model, key)
        if isinstance(child, BaseModel):
            _write(child, f"{name}.{key}" if name else key, lines, setting)


def _write_zones(config: Config, lines: list[str], setting: Setting, prefix: str) -> None:
    for zone in config.zones:
        lines.extend(["", f"{prefix}[[zones]]"])
        for key, field in type(zone).model_fields.items():
            lines.append(setting(key, getattr(zone, key), field.description or ""))
    if not config.zones:
        lines.extend(["", f"# zones: {type(config).model_fields['zones'].description}"])
        for kind, model in KINDS.items():
            lines.append(f"#   of kind {kind}:")
            keys = model.model_fields.items()
            lines.extend(f"#     {key}: {_meaning(field)}" for key, field in keys if key != "kind")


def _meaning(field: FieldInfo) -> str:
    return f"{field.description}{'' if field.is_required() else f' (default {json.dumps(field.default)})'}"


def shown(value: object) -> str:
    """Return a refused value for a sentence; whole tables are too long for one."""
    return phrase("(a table)") if isinstance(value, dict) else json.dumps(value, default=str, ensure_ascii=False)


def text_of(path: Path) -> str:
    """Return a configuration file's text, "" if it does not exist; raises `FileUnreadable`."""
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        return ""
    except OSError as error:
        raise unreadable(path, error) from error
    except UnicodeDecodeError as error:
        raise FileUnreadable(path=path, reason="it is not UTF-8 text") from error


def edited(text: str, values: Mapping[str, float | None]) -> str:
    """Return TOML with dotted keys set to `values`, or removed if the value is None; otherwise as `merged`."""
    changes: dict[str, Any] = {}
    for key, value in values.items():
        *names, name = key.split(".")
        table = changes
        for section in names:
            table = table.setdefault(section, {})
        table[name] = value
    return merged(text, changes)


def merged(text: str, changes: Mapping[str, Any]) -> str:
    """Return TOML with nested keys set to the values of `changes`, or removed where the value is None.

    Comments, order and spacing stay. Missing tables are added. Raises `ValueError` for text that is not TOML and for a
    value in the place of a needed table.
    """
    import tomlkit  # noqa: PLC0415 - only programs that change a file need it

    document = tomlkit.parse(text)
    _merge(document, changes)
    return tomlkit.dumps(document)


def _merge(table: MutableMapping[str, Any], changes: Mapping[str, Any]) -> None:
    import tomlkit  # noqa: PLC0415
    from tomlkit.items import InlineTable  # noqa: PLC0415

    for name, value in changes.items():
        if value is None or value == []:  # an empty list of tables cannot be written
            table.pop(name, None)
        elif not isinstance(value, Mapping):
            table[name] = value
        elif name in table or _adds(value):
            if name not in table:
                only_tables = all(isinstance(one, Mapping) for one in value.values())
                inline = isinstance(table, InlineTable)  # it cannot hold a table with a head of its own
                table[name] = tomlkit.inline_table() if inline else tomlkit.table(is_super_table=only_tables)
            below = table[name]
            if not isinstance(below, MutableMapping):
                raise ValueError(phrase("{name} is no table", name=name))
            _merge(cast("MutableMapping[str, Any]", below), value)


def _adds(changes: Mapping[str, Any]) -> bool:
    """Return whether changes set a value, besides removing others."""
    return any(_adds(value) if isinstance(value, Mapping) else value is not None for value in changes.values())


def written(path: Path) -> Mapping[str, Any]:
    """Return the content of a configuration file, nested; empty if it does not exist. Raises `FileUnreadable`."""
    import tomllib  # noqa: PLC0415 - only programs that change a file need it

    try:
        return tomllib.loads(text_of(path))
    except ValueError as error:
        raise FileUnreadable(path=path, reason=phrase("it is not TOML: {error}", error=error)) from error


@contextmanager
def alone(path: Path) -> Iterator[None]:
    """Lock the files beside `path` against other processes that use this function, while the block runs.

    It does not wait: raises `FileUnwritable` if another process holds the lock.
    """
    folder = path.resolve().parent
    try:
        folder.mkdir(parents=True, exist_ok=True)
        handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    except OSError as error:
        raise unwritable(path, error) from error
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    except BlockingIOError as error:
        raise FileUnwritable(path=path, reason="another program is writing it; try again") from error
    finally:
        os.close(handle)


def replace(path: Path, text: str) -> None:
    """Write a file whole or not at all, so that it is on the disk when this returns; raises `FileUnwritable`.

    An existing file keeps its permissions; a link is followed within its folder.
    """
    place = writable_place(path)
    draft = place.with_name(f".{place.name}.new")
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        draft.unlink(missing_ok=True)  # left by a killed process
        try:
            with draft.open("x", encoding="utf-8") as file:
                file.write(text)
                file.flush()
                os.fsync(file.fileno())
            if place.exists():
                draft.chmod(place.stat().st_mode & 0o7777)
            draft.replace(place)
        finally:
            draft.unlink(missing_ok=True)
        sync_folder(place.parent)
    except OSError as error:
        raise unwritable(path, error) from error
