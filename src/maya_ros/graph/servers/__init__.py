"""The topics, services and actions that each layer offers to a graph.

A server declares by a Protocol the part of its layer that it needs. It is opened on a node:

    async with ControllerServer(controller).open(bus.node("hw_simulator")):
        ...

controller   /home, /move, /controller/..., /gripper, /maya_event       sensors   positions, joints, raw data, markers
robot        /task, /maya_command, /maya_move                           process   /send_task, /start_queue, /stop_queue
steps        /step_command and /step_result                             tasks     shared by all servers

Every server publishes the status of its layer on /diagnostics.
"""
