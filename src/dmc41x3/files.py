"""Read files, and write regular files completely or not at all, never through a link out of their folder.

This package, and those built on it, write files through this module, apart from databases, recordings and temporary
files. It imports nothing heavy, because commands that must start fast need it.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import TextIOWrapper
from pathlib import Path
from typing import BinaryIO, TextIO

from dmc41x3.errors import FileUnreadable, FileUnwritable
from dmc41x3.i18n import phrase

PRIVATE = 0o600
"""Permissions of a file that only its owner may read."""

_ORDINARY = 0o666
_SAFE = os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
_NUMBERS = 10_000
_STANDARD_OUTPUT = Path("-")


def writable_place(path: Path) -> Path:
    """Return the target of a write to `path`: a regular file, or a path that does not exist yet.

    A link is followed within its folder only. Raises `FileUnwritable`.
    """
    if not path.name or path.name in {".", ".."}:
        raise FileUnwritable(path=path, reason="this is not the name of a file")
    if path == _STANDARD_OUTPUT:
        raise FileUnwritable(path=path, reason="this command writes to a file, not to standard output")
    place = path
    try:
        if path.is_symlink():
            place = path.resolve()
            if not place.is_relative_to(path.parent.resolve()):
                raise FileUnwritable(
                    path=path, reason=phrase("it is a symbolic link to {place}; name that file instead", place=place)
                )
        if not stat.S_ISREG(place.lstat().st_mode):
            raise FileUnwritable(path=path, reason="it is not a regular file")
    except FileNotFoundError:
        return place
    except (OSError, RuntimeError, ValueError) as error:
        raise unwritable(path, error) from error
    return place


def open_own(path: Path, flags: int, mode: int = PRIVATE) -> int:
    """Open a regular file in its place with `flags` of os.open and return its descriptor; no link is followed.

    Raises `FileUnwritable`.
    """
    try:
        descriptor = os.open(path, flags | _SAFE, mode)
    except (OSError, ValueError) as error:
        raise unwritable(path, error) from error
    if stat.S_ISREG(os.fstat(descriptor).st_mode):
        return descriptor
    os.close(descriptor)
    raise FileUnwritable(path=path, reason="it is not a regular file")


def private_opener(path: str, flags: int) -> int:
    """Open a file for its owner alone, as `opener` of `open`; raises `OSError`."""
    descriptor = os.open(path, flags | _SAFE, PRIVATE)
    found = os.fstat(descriptor)
    if not stat.S_ISREG(found.st_mode):
        os.close(descriptor)
        raise OSError(phrase("{path} is not a regular file", path=path))
    if found.st_uid == os.getuid() and stat.S_IMODE(found.st_mode) != PRIVATE:
        os.fchmod(descriptor, PRIVATE)
    return descriptor


@contextmanager
def replacing_bytes(path: Path, mode: int = _ORDINARY) -> Iterator[BinaryIO]:
    """Yield a file that replaces `path` when the block ends; it is then flushed to the disk.

    It has the permissions of the replaced file, or `mode` without one; a private file is private in any case. If the
    block raises, the old file stays. Raises `FileUnwritable`.
    """
    place = writable_place(path)
    draft: Path | None = None
    try:
        draft, descriptor = _draft(place, mode)
        with os.fdopen(descriptor, "wb") as file:
            yield file
            file.flush()
            if mode != PRIVATE:
                with suppress(FileNotFoundError):
                    os.fchmod(file.fileno(), place.stat().st_mode & 0o7777)
            os.fsync(file.fileno())
        draft.replace(place)
        draft = None
        sync_folder(place.parent)
    except (OSError, ValueError) as error:
        raise unwritable(path, error) from error
    finally:
        if draft is not None:
            with suppress(OSError):
                draft.unlink()


@contextmanager
def replacing(path: Path, *, newline: str | None = None) -> Iterator[TextIO]:
    """Yield a file for text in UTF-8, as `replacing_bytes` does; `newline` is that of `open`."""
    with replacing_bytes(path) as file:
        text = TextIOWrapper(file, encoding="utf-8", newline=newline)
        yield text
        text.flush()
        text.detach()


def write(path: Path, content: str | bytes, mode: int = _ORDINARY, encoding: str = "utf-8") -> None:
    """Write a file whole or not at all, as `replacing_bytes` does; raises `FileUnwritable`."""
    data = content.encode(encoding) if isinstance(content, str) else content
    with replacing_bytes(path, mode) as file:
        file.write(data)


def sync_folder(folder: Path) -> None:
    """Make the names in a folder durable; raises `OSError`."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def read_bytes(path: Path, most: int | None = None) -> bytes:
    """Return the content of a file; raises `FileUnreadable`, also if it has more than `most` bytes."""
    try:
        with path.open("rb") as file:  # a device has no size, so the reading itself is bounded
            data = file.read() if most is None else file.read(most + 1)
    except OSError as error:
        raise unreadable(path, error) from error
    if most is not None and len(data) > most:
        raise FileUnreadable(path=path, reason=phrase("it is larger than {most} bytes", most=most))
    return data


def unreadable(path: object, error: Exception) -> FileUnreadable:
    """Return the error of a `path` that cannot be read, with the system's reason."""
    return FileUnreadable(path=path, reason=_reason(error))


def unwritable(path: object, error: Exception) -> FileUnwritable:
    """Return the error of a `path` that cannot be written, with the system's reason."""
    return FileUnwritable(path=path, reason=_reason(error))


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error)


def _draft(place: Path, mode: int) -> tuple[Path, int]:
    """Create a new file beside `place`; raises `OSError`."""
    for number in range(_NUMBERS):
        draft = place.with_name(f".{place.name[:200]}.{os.getpid()}-{number}.new")
        with suppress(FileExistsError):
            return draft, os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL | _SAFE, mode)
    raise FileExistsError(phrase("{place}: too many temporary files are beside it", place=place))
