"""Edges that other packages add to `maya up`: each is an entry point in the group `maya_un.edges`."""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import AbstractAsyncContextManager
from importlib.metadata import entry_points
from pathlib import Path
from socket import socket
from types import MappingProxyType
from typing import NamedTuple, Protocol, cast

from dmc41x3.i18n import phrase
from maya_un.assembly.stack import Stack
from maya_un.config import Config
from maya_un.errors import EdgeNotInstalled, InvalidValue
from maya_un.http.bridge import Bridge
from maya_un.http.origins import OriginPolicy

GROUP = "maya_un.edges"


class Ros2Options(NamedTuple):
    """The domain of a ROS 2 graph, the namespace of the robot in it, "" for none, and other names for its names."""

    domain: int
    namespace: str = ""
    remappings: Mapping[str, str] = MappingProxyType({})


LAST_DOMAIN = 232
"""The last domain of DDS whose ports exist."""

ROS_NAME = "/?[A-Za-z_][A-Za-z0-9_]*(?:/[A-Za-z_][A-Za-z0-9_]*)*"
"""The pattern of a name of ROS."""

DOMAIN = "ROS_DOMAIN_ID"
"""The environment variable with the domain, as in every program of ROS 2."""


def ros2_domain(text: str, key: str = DOMAIN) -> int:
    """Return the domain that `text` names; raises `InvalidValue` of `key`."""
    if not (text.isascii() and text.isdecimal()) or int(text) > LAST_DOMAIN:
        reason = phrase("it must be a number from 0 to {last}", last=LAST_DOMAIN)
        raise InvalidValue(key=key, value=text, reason=reason)
    return int(text)


def ros2_namespace(text: str, key: str) -> str:
    """Return `text` if it is a namespace of ROS 2; raises `InvalidValue` naming `key`."""
    if not re.fullmatch(rf"({ROS_NAME})?/?", text):
        raise InvalidValue(key=key, value=text, reason="it must be names with slashes between them")
    return text


class EndpointOptions(NamedTuple):
    """The places at which the graph of ROS is served, and the file that records which steps were carried out.

    `listener` is the socket of rosbridge, None for none; `edge` is its origin policy.
    """

    listener: socket | None
    edge: OriginPolicy
    steps: Path
    ros2: Ros2Options | None = None


class Edge(Protocol):
    """An edge of `maya up`; a module or an object with these two functions."""

    def endpoint(
        self, stack: Stack, bridge: Bridge, place: EndpointOptions, *, speed: float = 1.0
    ) -> AbstractAsyncContextManager[object]:
        """Serve `stack` at `place` while the block runs; `speed` is the speed of the stack's clock."""
        ...

    def configured(self, config: Config, speed: float) -> Config:
        """Return the configuration that this edge needs."""
        ...


def edge(name: str) -> Edge:
    """Return the edge that an installed package provides under `name`. Raises `EdgeNotInstalled`."""
    found = entry_points(group=GROUP)
    if name not in found.names:
        raise EdgeNotInstalled(edge=name)
    return cast("Edge", found[name].load())
