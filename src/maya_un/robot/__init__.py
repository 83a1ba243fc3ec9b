"""The robot layer: Maya's primitives. One file declares one primitive, and a preview is the plan that runs.

Import from the modules: `robot.robot` (the layer itself), `robot.planning` (planning shared by all robot
implementations), `robot.protocol` (the interface), `robot.primitives` (the primitives as data), `robot.plan` (plans).
"""
