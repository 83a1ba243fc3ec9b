"""Names in a graph, as clients write them: with or without a leading slash."""

from __future__ import annotations

import re

from maya_un.errors import InvalidRequest

LONGEST = 255

_GOOD = re.compile(r"/?[A-Za-z][A-Za-z0-9_]*(/[A-Za-z0-9_]+)*")
_TYPE = re.compile(r"[A-Za-z][A-Za-z0-9_]*/([A-Za-z]+/)?[A-Za-z][A-Za-z0-9_]*")


def resolved(name: str, key: str) -> str:
    """Return the whole name of what a client calls `name` under `key`; raises `InvalidRequest`."""
    if len(name) > LONGEST or not _GOOD.fullmatch(name):
        raise InvalidRequest(key=key, reason="it is a name like /maya_event")
    return name if name.startswith("/") else f"/{name}"


def type_of(text: str, key: str) -> str:
    """Return a type as ROS 1 names it; raises `InvalidRequest`.

    Newer clients write "std_msgs/msg/String"; the part in the middle is left out.
    """
    if len(text) > LONGEST or not _TYPE.fullmatch(text):
        raise InvalidRequest(key=key, reason="it is a type like std_msgs/String")
    package, *_, name = text.split("/")
    return f"{package}/{name}"
