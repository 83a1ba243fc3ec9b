"""What each floor offers to a graph.

A door needs little of its floor, says so by a Protocol, and opens itself:

    async with ControllerDoor(controller).open(bus.node("hw_simulator")):
        ...

controller   /home, /move, /controller/..., /gripper, /maya_event       sensors   positions, joints, raw data, markers
robot        /task, /maya_command, /maya_move                           process   /send_task, /start_queue, /stop_queue
bridge       /step_command and /step_result

Every door tells on /diagnostics how its floor is.
"""
