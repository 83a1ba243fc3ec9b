"""Use our endpoint by roslibpy, with output as JSON, a line each: roslibpy_client.py PORT."""

from __future__ import annotations

import json
import sys
import threading
from typing import Any

import roslibpy
from roslibpy.ros1.actionlib import ActionClient, Goal

PATIENCE = 50


def tell(name: str, value: Any) -> None:
    print(json.dumps({name: value}, default=dict), flush=True)


def messages(topic: roslibpy.Topic, count: int, begin: Any = None) -> list[Any]:
    """Return the next messages of a topic, once `begin` has been called."""
    found: list[Any] = []
    enough = threading.Event()

    def heard(message: Any) -> None:
        found.append(dict(message))
        if len(found) >= count:
            enough.set()

    topic.subscribe(heard)
    if begin is not None:
        begin()
    assert enough.wait(PATIENCE), f"{topic.name} told only {found}"
    topic.unsubscribe()
    return found[:count]


def primitive(command: str, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> dict[str, Any]:
    return {"command": command, "target": {"x": x, "y": y, "z": z}, "open": False}


def ask(ros: roslibpy.Ros) -> None:
    """Ask the graph about itself."""
    tell("time", ros.get_time()["secs"])
    topics = ros.get_topics()
    tell("topics", topics)
    tell("topic type", ros.get_topic_type("/maya_position"))
    tell("topics for type", ros.get_topics_for_type("geometry_msgs/Point"))
    tell("services", ros.get_services())
    tell("service type", ros.get_service_type("/maya_command"))
    tell("services for type", ros.get_services_for_type("maya_robot/MayaCommand"))
    tell("request", ros.get_service_request_details("maya_robot/MayaCommand")["typedefs"][0]["fieldnames"])
    tell("response", ros.get_service_response_details("maya_robot/MayaCommand")["typedefs"][0]["fieldnames"])
    tell("message", [one["type"] for one in ros.get_message_details("maya_robot/MayaPrimitive")["typedefs"]])
    tell("nodes", ros.get_nodes())
    tell("node", ros.get_node_details("/robot_controller"))
    servers: list[Any] = []
    there = threading.Event()
    ros.get_action_servers(lambda answer: (servers.append(answer), there.set()))
    assert there.wait(PATIENCE)
    tell("action servers", servers[0]["action_servers"])


def parameters(ros: roslibpy.Ros) -> None:
    param = roslibpy.Param(ros, "/mine/limit")
    param.set({"a": [1, 2.5, "x"]})
    tell("param", param.get())
    tell("params", [name for name in ros.get_params() if name.startswith("/mine")])
    param.delete()
    tell("params after", [name for name in ros.get_params() if name.startswith("/mine")])


def topics(ros: roslibpy.Ros) -> None:
    here, there = (roslibpy.Topic(ros, "/chatter", "std_msgs/String") for _ in range(2))
    there.advertise()
    tell("chatter", messages(here, 3, lambda: [there.publish({"data": f"{number}"}) for number in range(3)]))
    there.unadvertise()
    tell("event", messages(roslibpy.Topic(ros, "/maya_event", "std_msgs/String"), 1)[0]["data"].split()[0])


def services(ros: roslibpy.Ros) -> None:
    def answered(request: Any, response: Any) -> bool:
        response["success"] = request["data"]
        response["message"] = "by roslibpy"
        return True

    mine = roslibpy.Service(ros, "/mine", "std_srvs/SetBool")
    mine.advertise(answered)
    done = threading.Event()
    answers: list[Any] = []
    other = roslibpy.Service(ros, "/mine", "std_srvs/SetBool")
    other.call({"data": True}, lambda answer: (answers.append(dict(answer)), done.set()), answers.append)
    assert done.wait(PATIENCE), answers
    tell("own service", answers[0])
    mine.unadvertise()
    try:
        roslibpy.Service(ros, "/nobody", "std_srvs/SetBool").call({"data": True}, timeout=PATIENCE)
    except roslibpy.core.ServiceException as refused:
        tell("nobody", str(refused))


def move(ros: roslibpy.Ros) -> None:
    """Home by an action, pick by the service, place by the action, and a goal that is cancelled."""
    command = roslibpy.Service(ros, "/maya_command", "maya_robot/MayaCommand")
    tell("before", command.call({"task": primitive("can_teleop")}, timeout=PATIENCE))
    client = ActionClient(ros, "/task", "maya_robot/TaskAction")
    phases: list[str] = []
    goal = Goal(client, {"task": primitive("home")})
    goal.on("feedback", lambda feedback: phases.append(feedback["phase"]))
    goal.send()
    tell("homed", goal.wait(PATIENCE))
    tell("phases", sorted(set(phases)))
    tell("pick", command.call({"task": primitive("pick", 0.41, 1.13, 0.4)}, timeout=PATIENCE))
    goal = Goal(client, {"task": primitive("place", 1.18, 0.21, 0.4)})
    goal.send()
    tell("place", goal.wait(PATIENCE))
    goal = Goal(client, {"task": primitive("approach", 0.41, 1.13, 0.4)})
    goal.on("feedback", lambda _: goal.cancel())
    goal.send()
    tell("cancelled", goal.wait(PATIENCE))
    client.dispose()


def main() -> None:
    ros = roslibpy.Ros("127.0.0.1", int(sys.argv[1]))
    ros.run()
    ask(ros)
    parameters(ros)
    topics(ros)
    services(ros)
    move(ros)
    tell("done", value=True)
    ros.terminate()


if __name__ == "__main__":
    main()
