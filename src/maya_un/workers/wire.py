"""The protocol between a worker and its pool.

A message has a head (its kind, the number of its request, the length of its payload) and a payload: a pickle or empty.
Both ends are processes of this program, over pipes that no other process has; no foreign pickle is ever read.
"""

from __future__ import annotations

import copyreg
import io
import os
import pickle
import select
import struct
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from enum import IntEnum
from functools import cache
from operator import attrgetter, methodcaller
from typing import Any

_Reduction = Callable[[Any], Any]

_HEAD = struct.Struct(">BQI")
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


def _restored(kind: Any, *values: Any) -> Any:
    """Return an object of a dataclass with the values of its fields."""
    made = kind.__new__(kind)
    for name, value in zip(_names(kind), values, strict=True):
        object.__setattr__(made, name, value)
    return made


@cache
def _names(kind: Any) -> tuple[str, ...]:
    return tuple(field.name for field in fields(kind))


def _by_fields(kind: Any) -> _Reduction:
    """Return how to reduce an object of a dataclass to the values of its fields."""
    names = _names(kind)
    if len(names) < 2:
        return lambda value: (_restored, (kind, *(getattr(value, name) for name in names)))
    values = attrgetter(*names)
    return lambda value: (_restored, (kind, *values(value)))


class _Reductions(dict[type, _Reduction]):
    """How to reduce an object for a pickle, by its class. pickle itself finds a known class here, without Python code.

    Dataclasses with slots, and compiled ones, are reduced to their fields. pickle restores other objects by setting
    their attributes, which a frozen dataclass refuses. Python's methods for this are slow, and mypyc has none.
    """

    def __missing__(self, kind: type[Any]) -> _Reduction:
        """Return how to reduce an object of a class that was not met before; raises `KeyError` for a class itself."""
        if issubclass(kind, type):
            raise KeyError(kind)
        fixed = "__slots__" in vars(kind) or hasattr(kind, "__mypyc_attrs__")
        if fixed and is_dataclass(kind) and kind.__reduce__ is object.__reduce__:
            reduction = _by_fields(kind)
        else:
            usual = methodcaller("__reduce_ex__", pickle.HIGHEST_PROTOCOL)
            reduction = copyreg.dispatch_table.get(kind, usual)
        self[kind] = reduction
        return reduction


class _Pickler(pickle.Pickler):
    dispatch_table = _Reductions()


def pickled(value: object) -> bytes:
    """Return a pickle of a value, for the other end."""
    data = io.BytesIO()
    _Pickler(data, pickle.HIGHEST_PROTOCOL).dump(value)
    return data.getvalue()


class ClosedError(Exception):
    """The other end has gone."""


class StuckError(Exception):
    """The other end neither reads nor writes."""


def send(pipe: int, what: int, number: int, payload: bytes = b"", within: float | None = None) -> None:
    """Send a message about the request `number` through a pipe; raises `ClosedError`.

    With `within` the pipe must not block; raises `StuckError` if no data moves for `within` [s].
    """
    view = memoryview(_HEAD.pack(what, number, len(payload)) + payload)
    try:
        while view:
            _await(pipe, select.POLLOUT, within)
            view = view[os.write(pipe, view[:_AT_ONCE]) :]
    except OSError as error:
        raise ClosedError from error


def receive(pipe: int, within: float | None = None) -> tuple[int, int, bytearray]:
    """Wait for a message; return what it is, the number of its request and its payload.

    Raises `ClosedError`, and `StuckError` if no data comes `within` [s].
    """
    what, number, length = _HEAD.unpack(_exactly(pipe, _HEAD.size, within))
    return what, number, _exactly(pipe, length, within)


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
