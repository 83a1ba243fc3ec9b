from typing import Any

class Transport:
    socket: Any
    done: bool
    endpoint_id: str
    callerid_pub: str
