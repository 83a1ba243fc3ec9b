"""The classes that ROS generates from definitions, found by the names of their types."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeVar

import genpy
import roslib.message

from maya_un.errors import UnknownInterface

MessageClass = genpy.Message

T = TypeVar("T")


class ServiceClass(NamedTuple):
    """A generated service class, with those of its request and response."""

    kind: type[genpy.Service]
    request: type[MessageClass]
    response: type[MessageClass]


def message_class(name: str) -> type[MessageClass]:
    """Return the class of a message type ("std_msgs/String"); raises `UnknownInterface`."""
    found = _found(roslib.message.get_message_class, name)
    if found is None:
        raise UnknownInterface(form="message type", name=name)
    return found


def service_class(name: str) -> ServiceClass:
    """Return the class of a service type ("std_srvs/Trigger"); raises `UnknownInterface`."""
    found = _found(roslib.message.get_service_class, name)
    if found is None:
        raise UnknownInterface(form="service type", name=name)
    return ServiceClass(found, found._request_class, found._response_class)


def _found(look: Callable[[str], T | None], name: str) -> T | None:
    """Return a class, None where nobody knows the name, or it is none."""
    try:
        return look(name)
    except ValueError:
        return None
