"""Run by the Python of nodes, for `bench_ros`: an empty service, a node that shows sensors, and who calls and listens.

ros_peer.py empty       answers /bench/empty (std_srvs/Trigger) by rospy alone
ros_peer.py sensors     tells 50 times a second where a robot is that moves, as the nodes of the controller layer do
ros_peer.py calls       does what lines say ("NUMBER SERVICE kept|new") and says how long a call took [s]
ros_peer.py listens     listens to what the sensors show
"""

from __future__ import annotations

import asyncio
import sys
import time
from collections.abc import AsyncIterator
from dataclasses import replace

import rospy
import rosservice
from std_srvs.srv import Trigger, TriggerResponse

RATE = 50.0


def empty() -> None:
    rospy.init_node("bench_empty")
    rospy.Service("/bench/empty", Trigger, lambda _: TriggerResponse(success=True))
    print("ready", flush=True)
    rospy.spin()


def calls() -> None:
    rospy.init_node("bench_calls", disable_signals=True)
    kept: dict[str, rospy.ServiceProxy] = {}
    print("ready", flush=True)
    for line in sys.stdin:
        number, service, how = line.split()
        kind = rosservice.get_service_class_by_name(service)
        request = kind._request_class()
        if hasattr(request, "task"):
            request.task.command = "can_teleop"
        proxy = rospy.ServiceProxy(service, kind)
        if how == "kept":
            proxy = kept.setdefault(service, rospy.ServiceProxy(service, kind, persistent=True))
        proxy(request)
        begun = time.perf_counter()
        for _ in range(int(number)):
            proxy(request)
        print((time.perf_counter() - begun) / int(number), flush=True)


def listens() -> None:
    from geometry_msgs.msg import Point
    from sensor_msgs.msg import JointState

    rospy.init_node("bench_listens")
    rospy.Subscriber("/maya_position", Point, lambda _: None)
    rospy.Subscriber("/joint_states", JointState, lambda _: None)
    print("ready", flush=True)
    rospy.spin()


def sensors() -> None:
    from maya_ros.graph.servers.sensors import SensorServer
    from maya_ros.ros1.controlling import ros_time
    from maya_ros.ros1.node import RosNode, run
    from maya_un.config import Config
    from maya_un.kinematics.mechanism import Mechanism
    from maya_un.kinematics.workspace import Workspace
    from maya_un.values import Joints, Mode, State

    config = Config()
    mechanism = Mechanism.of(config)

    class Moving:
        """A robot that turns its boom."""

        def __init__(self) -> None:
            self.workspace = Workspace.of(config)
            self.state = State(
                time=0.0, mode=Mode.MOVING, homed=True, counts=(0, 0, 0), joints=None, point=None,
                velocity=(0.1, 0.0, 0.0), moving=True, motors_on=(True, True, True),
                forward_limit=(False, False, False), reverse_limit=(False, False, False), stop_code=(0, 0, 0),
                gripper_closed=False, progress=None, fault=None,
            )  # fmt: skip

        async def watch(self) -> AsyncIterator[State]:
            """Yield a state 50 times a second."""
            due = now = asyncio.get_running_loop().time()
            while True:
                joints = Joints(0.5 + 0.1 * ((now * 0.1) % 1.0), 1.7, 1.7)
                self.state = replace(self.state, joints=joints, point=mechanism.fk(joints))
                yield self.state
                due = max(due + 1.0 / RATE, now)
                await asyncio.sleep(due - now)
                now = asyncio.get_running_loop().time()

    async def serve(node: RosNode) -> None:
        async with SensorServer(Moving(), config, clock=ros_time).open(node.graph):
            print("ready", flush=True)
            await asyncio.Event().wait()

    raise SystemExit(run("bench_sensors", serve))


if __name__ == "__main__":
    {"empty": empty, "sensors": sensors, "calls": calls, "listens": listens}[sys.argv[1]]()
