from collections.abc import Callable
from types import TracebackType
from typing import Any

from genpy import Message
from genpy import Service as ServiceKind

class ROSException(Exception): ...
class ROSInitException(ROSException): ...
class ROSInterruptException(ROSException, KeyboardInterrupt): ...
class ROSSerializationException(ROSException): ...
class ServiceException(Exception): ...

DEBUG: int
INFO: int
WARN: int
ERROR: int
FATAL: int

class Time:
    secs: int
    nsecs: int
    @staticmethod
    def now() -> Time: ...
    def to_sec(self) -> float: ...

class SubscribeListener:
    def peer_subscribe(
        self, topic_name: str, topic_publish: Callable[..., Any], peer_publish: Callable[..., Any]
    ) -> None: ...
    def peer_unsubscribe(self, topic_name: str, num_peers: int) -> None: ...

class _Transport:
    socket: Any
    done: bool
    endpoint_id: str
    callerid_pub: str

class _TopicImpl:
    connections: list[_Transport]
    def add_subscriber_listener(self, l: SubscribeListener) -> None: ...

class _Topic:
    impl: _TopicImpl | None
    resolved_name: str
    def get_num_connections(self) -> int: ...
    def unregister(self) -> None: ...

class Publisher(_Topic):
    def __init__(
        self,
        name: str,
        data_class: type[Message],
        subscriber_listener: SubscribeListener | None = None,
        tcp_nodelay: bool = False,
        latch: bool = False,
        headers: dict[str, str] | None = None,
        queue_size: int | None = None,
    ) -> None: ...
    def publish(self, *args: Any, **kwds: Any) -> None: ...

class Subscriber(_Topic):
    def __init__(
        self,
        name: str,
        data_class: type[Message],
        callback: Callable[..., Any] | None = None,
        callback_args: Any = None,
        queue_size: int | None = None,
        buff_size: int = 65536,
        tcp_nodelay: bool = False,
    ) -> None: ...

class Service:
    resolved_name: str
    def __init__(
        self,
        name: str,
        service_class: type[ServiceKind],
        handler: Callable[[Any], Any],
        buff_size: int = 65536,
        error_handler: Callable[[Exception, type, BaseException, TracebackType], None] | None = None,
    ) -> None: ...
    def shutdown(self, reason: str = "") -> None: ...
    def _handle_request(self, transport: Any, request: Message) -> None: ...

class ServiceProxy:
    transport: Any
    def __init__(
        self,
        name: str,
        service_class: type[ServiceKind],
        persistent: bool = False,
        headers: dict[str, str] | None = None,
    ) -> None: ...
    def __call__(self, *args: Any, **kwds: Any) -> Any: ...
    def close(self) -> None: ...

def init_node(
    name: str,
    argv: list[str] | None = None,
    anonymous: bool = False,
    log_level: int | None = None,
    disable_rostime: bool = False,
    disable_rosout: bool = False,
    disable_signals: bool = False,
    xmlrpc_port: int = 0,
    tcpros_port: int = 0,
) -> None: ...
def get_name() -> str: ...
def get_param(param_name: str, default: Any = ...) -> Any: ...
def set_param(param_name: str, param_value: Any) -> None: ...
def has_param(param_name: str) -> bool: ...
def delete_param(param_name: str) -> None: ...
def resolve_name(name: str, caller_id: str | None = None) -> str: ...
def myargv(argv: list[str] | None = None) -> list[str]: ...
def on_shutdown(h: Callable[[], object]) -> None: ...
def signal_shutdown(reason: str) -> None: ...
def is_shutdown() -> bool: ...
def get_rostime() -> Time: ...
def logdebug(msg: str, *args: object, **kwds: object) -> None: ...
def loginfo(msg: str, *args: object, **kwds: object) -> None: ...
def logwarn(msg: str, *args: object, **kwds: object) -> None: ...
def logerr(msg: str, *args: object, **kwds: object) -> None: ...
def logfatal(msg: str, *args: object, **kwds: object) -> None: ...

from rospy import core as core
