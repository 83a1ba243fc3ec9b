"""Run by the Python of nodes: connects a subscription to one publisher twice, as rospy does; for `test_graph`.

Prints a JSON list: for each attempt, whether rospy keeps the connection; then whether the first one is still open.
"""

from __future__ import annotations

import json
from importlib import import_module

from rospy.impl.registration import Registration
from rospy.impl.tcpros_base import TCPROSTransport
from rospy.impl.tcpros_pubsub import TCPROSSub
from rospy.topics import get_topic_manager
from std_msgs.msg import String

TOPIC, PUBLISHER = "/speed", "http://127.0.0.1:1/"


def connection() -> TCPROSTransport:
    """Return a new connection to the publisher."""
    made = TCPROSTransport(TCPROSSub(TOPIC, String), TOPIC)
    made.set_endpoint_id(PUBLISHER)
    return made


import_module("maya_ros.ros1.topics")  # it mends rospy
subscription = get_topic_manager().acquire_impl(Registration.SUB, TOPIC, String)
attempts = [connection(), connection()]
kept = [subscription.add_connection(one) for one in attempts]
print(json.dumps([*kept, not attempts[0].done]))
