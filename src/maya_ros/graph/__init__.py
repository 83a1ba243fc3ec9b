"""The ROS graph of Maya without ROS: its names and types, what serves them, and the floors as clients of it.

table        every topic, service and action, the manual's chapter Communications (what drives all edges)
types        the definitions of their messages, as data; messages completed and checked
protocol     what a graph is: in one process `bus`, in a real one `maya_ros.ros1`
goals        the server's side of actions, on either of them
events       /maya_event in words; `paths` trajectories, `primitives` tasks, `outcome` results and errors in messages
drawn        the joints of the model; `description` its urdf, `markers` what rviz draws beside it, `diagnostics`
steps        steps of processes that others drive, each carried out once
doors        what a floor offers to a graph
clients      a floor on the other side of a graph, by the floors' own protocols
apart        the floors above the controller as nodes: a client below, a door above
"""
