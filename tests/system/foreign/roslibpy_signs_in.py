"""Sign in by roslibpy, with output as JSON, a line each: roslibpy_signs_in.py PORT TOKEN header|auth."""

from __future__ import annotations

import json
import sys

import roslibpy

PATIENCE = 50


def tell(name: str, value: object) -> None:
    print(json.dumps({name: value}, default=dict), flush=True)


def main(port: int, token: str, way: str) -> None:
    headers = {"Authorization": f"Bearer {token}"} if way == "header" else None
    ros = roslibpy.Ros("127.0.0.1", port, headers=headers)
    if way == "auth":
        ros.authenticate(token, "", "", "", 0, "", 0)  # roslibpy sends it as soon as it is connected
    ros.run(PATIENCE)
    stop = roslibpy.Service(ros, "/controller/stop", "std_srvs/Trigger")
    tell("stop", stop.call(roslibpy.ServiceRequest({}), timeout=PATIENCE)["success"])
    tell("speed", ros.get_param("/maya/speed"))
    gripper = roslibpy.Service(ros, "/gripper", "std_srvs/SetBool")
    tell("gripper", gripper.call(roslibpy.ServiceRequest({"data": True}), timeout=PATIENCE)["success"])
    tell("done", True)
    ros.terminate()


main(int(sys.argv[1]), sys.argv[2], sys.argv[3])
