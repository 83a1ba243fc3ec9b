"""Changing single keys of a configuration file, and leaving alone whatever else people have written into it."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator, Mapping, MutableMapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

from dmc41x3.files import sync_folder, writable_place
from maya_un.errors import FileUnreadable, FileUnwritable


def text_of(path: Path) -> str:
    """Return a configuration file's text, "" where there is none; raises `FileUnreadable`."""
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        return ""
    except OSError as error:
        raise FileUnreadable(path=path, reason=error.strerror or str(error)) from error
    except UnicodeDecodeError as error:
        raise FileUnreadable(path=path, reason="it is not UTF-8 text") from error


def edited(text: str, values: Mapping[str, float | None]) -> str:
    """Return TOML with dotted keys set to `values`, or taken out where the value is None.

    Comments, order and spacing stay. Tables that are missing are added. Raises `ValueError` for text that is not TOML
    and where a table is needed but something else stands.
    """
    import tomlkit  # noqa: PLC0415 - only who changes a file needs it

    document = tomlkit.parse(text)
    for key, value in values.items():
        *sections, name = key.split(".")
        table = cast("MutableMapping[str, Any]", document)
        for depth, section in enumerate(sections):
            if section not in table:
                if value is None:
                    break
                table[section] = tomlkit.table(is_super_table=depth < len(sections) - 1)
            table = table[section]
            if not isinstance(table, MutableMapping):
                raise ValueError(f"{section} is no table")  # noqa: TRY004 - a parse error like the others
        else:
            if value is not None:
                table[name] = value
            elif name in table:
                del table[name]
    return tomlkit.dumps(document)


def written(path: Path) -> Mapping[str, Any]:
    """Return what a configuration file itself says, nested; nothing where there is none. Raises `FileUnreadable`."""
    import tomllib  # noqa: PLC0415 - only who changes a file needs it

    try:
        return tomllib.loads(text_of(path))
    except ValueError as error:
        raise FileUnreadable(path=path, reason=f"it is not TOML: {error}") from error


@contextmanager
def alone(path: Path) -> Iterator[None]:
    """Keep other processes that ask by this from changing files beside `path` while the block reads and writes them.

    Nobody waits: raises `FileUnwritable` where somebody else is at it.
    """
    folder = path.resolve().parent
    try:
        folder.mkdir(parents=True, exist_ok=True)
        handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    except OSError as error:
        raise FileUnwritable(path=path, reason=error.strerror or str(error)) from error
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    except BlockingIOError as error:
        raise FileUnwritable(path=path, reason="somebody else is writing it just now; try again") from error
    finally:
        os.close(handle)


def replace(path: Path, text: str) -> None:
    """Write a file whole or not at all, and have it on the disk when this returns; raises `FileUnwritable`.

    A file that stands there keeps its permissions; a link is followed within its folder.
    """
    place = writable_place(path)
    draft = place.with_name(f".{place.name}.new")
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        draft.unlink(missing_ok=True)  # of somebody who was killed
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
        raise FileUnwritable(path=path, reason=error.strerror or str(error)) from error
