"""What must hold before a node begins: a master answers, and no node of its name lives, which the master would end."""

from __future__ import annotations

import socket
from http.client import HTTPConnection, HTTPException
from typing import cast
from urllib.parse import urlsplit
from xml.parsers.expat import ExpatError
from xmlrpc.client import Error as XmlRpcError
from xmlrpc.client import ServerProxy, Transport

import rosgraph
import rospy

from maya_un.errors import AlreadyRunning, MasterGone

_REACH = 5.0
"""Who does not take a connection within this time is not there, who does not answer hangs [s]."""

_NO_ANSWER = (OSError, ValueError, HTTPException, XmlRpcError, ExpatError)


def require_master() -> None:
    """Raise `MasterGone` where no master answers; rospy would wait for one for ever."""
    uri = rosgraph.get_master_uri()
    try:
        _reached(uri)
        rosgraph.Master("/maya").getPid()
    except (*_NO_ANSWER, rosgraph.MasterException):
        raise MasterGone(uri=uri) from None


def require_sole(name: str) -> None:
    """Raise `AlreadyRunning` where the node that this one would be lives, or hangs; `name` may be given another.

    The master would end that one as soon as this one is there, be it able to do its work or not.
    """
    own = rospy.resolve_name(rospy.names.get_mappings().get("__name", name))
    try:
        uri = rosgraph.Master("/maya").lookupNode(own)
        _reached(uri)
    except (*_NO_ANSWER, rosgraph.MasterException):
        return
    try:
        with ServerProxy(uri, _Hurried()) as other:
            _, _, process = cast("tuple[int, str, int]", other.getPid("/maya"))
    except TimeoutError:
        raise AlreadyRunning(pid="?") from None
    except _NO_ANSWER:
        return  # somebody else's port by now
    raise AlreadyRunning(pid=process)


def _reached(uri: str) -> None:
    """Raise an error of `_NO_ANSWER` where nobody takes a connection."""
    at = urlsplit(uri)
    socket.create_connection((at.hostname or "", at.port or 80), _REACH).close()


class _Hurried(Transport):
    """Waits for an answer no longer than `_REACH`."""

    def make_connection(self, host: tuple[str, dict[str, str]] | str) -> HTTPConnection:
        """Return the connection that a request goes over."""
        connection = super().make_connection(host)
        connection.timeout = _REACH
        return connection
