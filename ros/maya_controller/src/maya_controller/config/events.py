"""The words that messages on /maya_event begin with, and how to read one.

A message is a word, a space, and one JSON object that says how everything stands; the last one is latched.
"""

from __future__ import annotations

import json
from typing import Any

CONNECTED = "connected"
DISCONNECTED = "disconnected"
NOT_HOMED = "not_homed"
HOMING = "homing"
HOMED = "homed"
MOVING = "moving"
IDLE = "idle"
STOPPED = "stopped"
PAUSED = "paused"
RESUMED = "resumed"
SPEED = "speed"
ZONES = "zones"
GRIPPER_OPEN = "gripper_open"
GRIPPER_CLOSED = "gripper_closed"
LIMIT = "limit"
FAULT = "fault"
ESTOP = "estop"
RECOVERED = "recovered"
REFUSED = "refused"  # a wish on a topic; the code says why


def read(text: str) -> tuple[str, dict[str, Any]]:
    """Return the word of a message on /maya_event, and how everything stands as a dict."""
    word, _, rest = text.partition(" ")
    return word, json.loads(rest) if rest else {}
