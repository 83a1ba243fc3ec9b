"""Print messages on /maya_event over all restarts of the other side: roslibpy_faithful.py PORT."""

from __future__ import annotations

import sys

import roslibpy


def main() -> None:
    ros = roslibpy.Ros("127.0.0.1", int(sys.argv[1]))
    topic = roslibpy.Topic(ros, "/maya_event", "std_msgs/String")
    topic.subscribe(lambda message: print("event", message["data"].split()[0], flush=True))
    ros.connect()
    ros.run_forever()


if __name__ == "__main__":
    main()
