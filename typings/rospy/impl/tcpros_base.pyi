from collections.abc import Callable
from socket import socket

from rospy.impl.tcpros_pubsub import TCPROSSub
from rospy.impl.transport import Transport

class TCPROSTransport(Transport):
    def __init__(self, protocol: TCPROSSub, name: str) -> None: ...
    def set_endpoint_id(self, endpoint_id: str) -> None: ...

class TCPROSServer:
    _tcp_server_callback: Callable[[TCPROSServer, socket, object], None]
