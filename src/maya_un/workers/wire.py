"""The protocol between a worker and its pool: the length of a message in four bytes, then a pickle.

Both ends are processes of this program, over pipes that no other process has; no foreign pickle is ever read.
"""

from __future__ import annotations

import io
import os
import pickle
import select
import struct
from dataclasses import fields, is_dataclass
from enum import IntEnum
from typing import Any

_LENGTH = struct.Struct(">I")
_AT_ONCE = 1 << 20


class WorkerCommand(IntEnum):
    """Commands for a worker: prepare itself, begin a request, continue one, forget one."""

    PREPARE = 0
    BEGIN = 1
    GO_ON = 2
    FORGET = 3


class WorkerAnswer(IntEnum):
    """Answers of a worker.

    A request is running (`MORE`), has sent a piece of its result (`PART`), is done, was refused with an error of Maya,
    needed too much time or memory, or failed by a defect.
    """

    MORE = 0
    PART = 1
    DONE = 2
    REFUSED = 3
    TOO_LONG = 4
    TOO_LARGE = 5
    FAILED = 6


class _Pickler(pickle.Pickler):
    """Pickles compiled dataclasses too.

    pickle restores an object by setting its attributes, which a frozen dataclass refuses. Python gives such a class
    methods for this; mypyc does not.
    """

    def reducer_override(self, value: Any) -> Any:
        """Return how to restore an object of a compiled dataclass."""
        kind: Any = type(value)
        if hasattr(kind, "__mypyc_attrs__") and is_dataclass(kind):
            return _restored, (kind, tuple(getattr(value, field.name) for field in fields(kind)))
        return NotImplemented


def _restored(kind: Any, values: tuple[Any, ...]) -> Any:
    made = kind.__new__(kind)
    for field, value in zip(fields(kind), values, strict=True):
        object.__setattr__(made, field.name, value)
    return made


def pickled(value: object) -> bytes:
    """Return a pickle of a value, for the other end."""
    data = io.BytesIO()
    _Pickler(data, pickle.HIGHEST_PROTOCOL).dump(value)
    return data.getvalue()


class ClosedError(Exception):
    """The other end has gone."""


class StuckError(Exception):
    """The other end neither reads nor writes."""


def send(pipe: int, *message: Any, within: float | None = None) -> None:
    """Send a message through a pipe; raises `ClosedError`.

    With `within` the pipe must not block; raises `StuckError` if no data moves for `within` [s].
    """
    data = pickled(message)
    view = memoryview(_LENGTH.pack(len(data)) + data)
    try:
        while view:
            _await(pipe, select.POLLOUT, within)
            view = view[os.write(pipe, view[:_AT_ONCE]) :]
    except OSError as error:
        raise ClosedError from error


def receive(pipe: int, within: float | None = None) -> Any:
    """Wait for a message and return it; raises `ClosedError`, and `StuckError` if no data comes `within` [s]."""
    (length,) = _LENGTH.unpack(_exactly(pipe, _LENGTH.size, within))
    return pickle.loads(_exactly(pipe, length, within))


def _exactly(pipe: int, length: int, within: float | None) -> bytearray:
    data = bytearray()
    while len(data) < length:
        try:
            _await(pipe, select.POLLIN, within)
            some = os.read(pipe, min(length - len(data), _AT_ONCE))
        except OSError as error:
            raise ClosedError from error
        if not some:
            raise ClosedError
        data += some
    return data


def _await(pipe: int, event: int, within: float | None) -> None:
    """Wait until a pipe can be written or read, or is closed; raises `StuckError`."""
    if within is None:
        return
    poll = select.poll()
    poll.register(pipe, event)
    if not poll.poll(within * 1e3):
        raise StuckError
