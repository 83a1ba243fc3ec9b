"""The ROS graph of Maya without ROS: its names and types, servers of each layer, and clients of each layer.

table         every topic, service and action, from the manual's chapter Communications
catalogue     definitions of all types; `types` completes and checks messages, `validation` converts fields
protocol      the interface of a graph; `bus` is one within a process, `maya_ros.ros1` a real one
goals         the server's side of actions, for both
events        /maya_event; `conversions` paths and primitives, `outcome` results and errors, as messages
halts         the number of stops and faults; `timing` how long motions take, computed in a worker
urdf          joints and description of the robot; `markers` the scene in rviz, `diagnostics` /diagnostics
servers       topics, services and actions that a layer offers
clients       a client of each layer over a graph, with the protocol of the layer
distributed   the layers above the controller as nodes: each a client of the layer below and a server
"""
