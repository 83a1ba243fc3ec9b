"""What must hold before a node begins: a master answers, and no node of its name lives, which the master would end."""

from __future__ import annotations

import socket
from typing import cast
from urllib.parse import urlsplit
from xmlrpc.client import ServerProxy

import rosgraph
import rospy

from maya_un.errors import AlreadyRunning, MasterGone
from maya_un.ros.master import NO_ANSWER, REACH, BoundedTransport, master

_CALLER = "/maya"
"""The name under which a program asks that is no node yet."""


def require_master() -> None:
    """Raise `MasterGone` where no master answers; rospy would wait for one for ever."""
    try:
        master(_CALLER).getPid()
    except (*NO_ANSWER, rosgraph.MasterException):
        raise MasterGone(uri=rosgraph.get_master_uri()) from None


def require_sole(name: str) -> None:
    """Raise `AlreadyRunning` where the node that this one would be lives, or hangs; `name` may be given another.

    The master would end that one as soon as this one is there, be it able to do its work or not.
    """
    own = rospy.resolve_name(rospy.names.get_mappings().get("__name", name))
    try:
        uri = master(_CALLER).lookupNode(own)
        at = urlsplit(uri)
        socket.create_connection((at.hostname or "", at.port or 80), REACH).close()
    except (*NO_ANSWER, rosgraph.MasterException):
        return
    try:
        with ServerProxy(uri, BoundedTransport()) as other:
            _, _, process = cast("tuple[int, str, int]", other.getPid(_CALLER))
    except TimeoutError:
        raise AlreadyRunning(pid="?") from None
    except NO_ANSWER:
        return  # somebody else's port by now
    raise AlreadyRunning(pid=process)
