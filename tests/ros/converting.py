"""Run by the Python of nodes: takes a message through ROS' own class and its bytes, for `test_converting`.

Every line of the input is [form, type, message]; the line that answers it is {"bytes", "back"} or {"error"}.
"""

from __future__ import annotations

import json
import sys
from io import BytesIO
from typing import Any

from maya_ros.ros1.convert import converter_of, message_class, service_class
from maya_un.errors import MayaError


def there_and_back(form: str, kind: str, message: Any) -> dict[str, object]:
    """Return the bytes that ROS sends for a message, and the message that it makes of them."""
    if form == "message":
        found = message_class(kind)
    else:
        service = service_class(kind)
        found = service.request if form == "request" else service.response
    converter = converter_of(found)
    buffer = BytesIO()
    converter.made(message).serialize(buffer)
    back = converter.plain(found().deserialize(buffer.getvalue()))
    return {"bytes": buffer.getvalue().hex(), "back": back}


for line in sys.stdin:
    try:
        answer = there_and_back(*json.loads(line))
    except MayaError as error:
        answer = {"error": error.code, "sentence": str(error)}
    print(json.dumps(answer), flush=True)
